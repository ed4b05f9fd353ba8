# Static analysis of include/ and src/, when asked for:  cmake --build build --target analysis
#
# .clang-tidy holds the chosen checks of clang-tidy, .cppcheck what cppcheck is not asked for, each
# with its reason. A finding makes the target fail.
find_program(dynains_run_clang_tidy NAMES run-clang-tidy-14 run-clang-tidy)
find_program(dynains_cppcheck cppcheck)
if(NOT dynains_run_clang_tidy OR NOT dynains_cppcheck)
  return()
endif()

# Compilers that are at C++17 anyway get no flag for it; clang-tidy 14 is at C++14. Some of src/ is
# compiled as part of larger units, which lie in the build folder.
add_custom_target(analysis
  COMMAND ${dynains_run_clang_tidy} -quiet -p ${PROJECT_BINARY_DIR} -extra-arg=-std=c++17
          "^${PROJECT_SOURCE_DIR}/src/|^${PROJECT_BINARY_DIR}/src/.*/unity_"
  COMMAND ${dynains_cppcheck} --quiet --error-exitcode=1 --std=c++17 --language=c++
          --enable=warning,style,performance,portability --suppressions-list=.cppcheck
          -I include src
  WORKING_DIRECTORY ${PROJECT_SOURCE_DIR} VERBATIM)
