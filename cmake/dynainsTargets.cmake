# Compiler settings of the project's own targets. They have no effect on consumers.

option(DYNAINS_WARNINGS_AS_ERRORS "Refuse warnings in our own targets" OFF)

# Both are for developers and have an effect only when this is the top-level project:
#   cmake -B build-asan -DDYNAINS_SANITIZE="address;undefined"    or "thread"
#   cmake -B build-cov  -DDYNAINS_COVERAGE=ON    then ctest, then gcovr on the build folder
set(DYNAINS_SANITIZE "" CACHE STRING "Sanitizers for our own targets, as a list")
option(DYNAINS_COVERAGE "Count executed lines in our own targets" OFF)

#   CXX=clang++ cmake -B build-fuzz -DDYNAINS_BUILD_FUZZERS=ON   then ctest -R fuzz
option(DYNAINS_BUILD_FUZZERS "Build the fuzzers (libFuzzer, Clang), with ASan and UBSan" OFF)

set(dynains_warnings -Wall -Wextra -Wpedantic -Wconversion -Wshadow)

# Flags to compile and link all code that uses instrumented targets.
set(dynains_instrumentation "")
if(dynains_top_level AND DYNAINS_SANITIZE)
  string(REPLACE ";" "," dynains_sanitizers "${DYNAINS_SANITIZE}")
  list(APPEND dynains_instrumentation
    -fsanitize=${dynains_sanitizers} -fno-sanitize-recover=all -fno-omit-frame-pointer)
endif()
if(dynains_top_level AND DYNAINS_COVERAGE)
  # Atomic: races between threads can make counts negative, and gcovr then refuses the file.
  list(APPEND dynains_instrumentation --coverage -fprofile-update=atomic)
endif()

if(dynains_top_level AND DYNAINS_BUILD_FUZZERS)
  list(APPEND dynains_instrumentation
    -fsanitize=fuzzer-no-link,address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer)
endif()

# Strict warnings. Without fused multiply-add, all compilers give equal bits.
function(dynains_own_target target)
  target_compile_features(${target} PRIVATE cxx_std_17)
  target_compile_options(${target} PRIVATE
    ${dynains_warnings} -ffp-contract=off
    $<$<BOOL:${DYNAINS_WARNINGS_AS_ERRORS}>:-Werror>
    ${dynains_instrumentation}
    # Checked operator[], iterators and preconditions of libstdc++, with unchanged layout.
    $<$<CONFIG:Debug>:-D_GLIBCXX_ASSERTIONS>
    # Fast enough to run the whole suite, and each line keeps its own count.
    $<$<AND:$<BOOL:${dynains_top_level}>,$<BOOL:${DYNAINS_COVERAGE}>>:-O1>)
  target_link_options(${target} PRIVATE ${dynains_instrumentation})
  set_target_properties(${target} PROPERTIES CXX_EXTENSIONS OFF)
endfunction()

# dynains_few_units(<name>): twelve source files are compiled as one, because most of the time of
# compilers and of the analysis goes to the headers that each of them includes. A library of few units
# does not wait for the libraries that it links.
function(dynains_few_units name)
  set_target_properties(${name} PROPERTIES
    UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 12 OPTIMIZE_DEPENDENCIES ON)
endfunction()

# dynains_quick_target(<name>): a target of this project that compiles quickly, with less
# optimization: tests and examples. Tests of fully optimized code use the shared facade and programs
# (reliability, program).
function(dynains_quick_target name)
  dynains_own_target(${name})
  target_compile_options(${name} PRIVATE $<$<NOT:$<CONFIG:Debug>>:-O1>)
endfunction()

# A compiled component: library dynains_<name>, alias and export name dynains::<name>. Its public
# headers are in include/dynains/<name>. The config file of the package finds again all libraries
# that it links as Package::target (see dynainsInstall.cmake).
function(dynains_component name)
  add_library(dynains_${name} ${ARGN})
  add_library(dynains::${name} ALIAS dynains_${name})
  set_target_properties(dynains_${name} PROPERTIES
    EXPORT_NAME ${name} POSITION_INDEPENDENT_CODE ON
    VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
  target_link_libraries(dynains_${name} PUBLIC dynains)
  dynains_own_target(dynains_${name})
  dynains_few_units(dynains_${name})
  set_property(GLOBAL APPEND PROPERTY DYNAINS_COMPONENTS ${name})
endfunction()

# dynains_private_headers(<target> <library>...): header-only libraries for source files only. In
# contrast to a link, they do not appear in the exported target, and consumers do not need them.
function(dynains_private_headers target)
  foreach(library IN LISTS ARGN)
    target_include_directories(${target} SYSTEM PRIVATE
      $<TARGET_PROPERTY:${library},INTERFACE_INCLUDE_DIRECTORIES>)
  endforeach()
endfunction()
