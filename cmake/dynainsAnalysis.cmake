# Static analysis of include/ and src/:
#   cmake --build build --target analysis              all files, in some minutes
#   cmake --build build --target analysis_of_changes   after a build: files that differ from $CI_BASE
#
# .clang-tidy lists the checks of clang-tidy, .cppcheck the suppressed checks of cppcheck, each with
# its reason. A finding makes the target fail.
find_program(dynains_run_clang_tidy NAMES run-clang-tidy-14 run-clang-tidy)
find_program(dynains_cppcheck NAMES cppcheck)
if(NOT dynains_run_clang_tidy OR NOT dynains_cppcheck)
  return()
endif()

# cppcheck reads each file alone, and the pipeline once with all its headers, because it skips
# templates without an instance.
set(dynains_cppcheck_call ${dynains_cppcheck} --quiet --error-exitcode=1 --std=c++17 --language=c++
    --enable=warning,style,performance,portability --suppressions-list=.cppcheck)
file(GLOB_RECURSE dynains_analysed CONFIGURE_DEPENDS RELATIVE ${PROJECT_SOURCE_DIR}
     include/*.hpp src/*.hpp src/*.cpp)

# clang-tidy 14 needs a flag for C++17 even where the compiler needs none. Some of src/ is compiled
# as part of larger units, which are in the build folder.
add_custom_target(analysis
  COMMAND ${dynains_cppcheck_call} -j2 ${dynains_analysed}
  COMMAND ${dynains_cppcheck_call} -I include src/remover/remover.cpp
  COMMAND ${dynains_run_clang_tidy} -quiet -p ${PROJECT_BINARY_DIR} -extra-arg=-std=c++17
          "^${PROJECT_SOURCE_DIR}/src/|^${PROJECT_BINARY_DIR}/src/.*/unity_"
  WORKING_DIRECTORY ${PROJECT_SOURCE_DIR} USES_TERMINAL VERBATIM)
add_custom_target(analysis_of_changes
  COMMAND bash ${CMAKE_CURRENT_LIST_DIR}/analyse_changes.sh ${PROJECT_BINARY_DIR}
    ${dynains_run_clang_tidy} ${dynains_cppcheck_call}
  WORKING_DIRECTORY ${PROJECT_SOURCE_DIR} USES_TERMINAL VERBATIM)
