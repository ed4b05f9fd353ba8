# Compiles SOURCE, and links a program of the compiled remover, with the flags of pkg-config alone.
if(NOT PKG_CONFIG)
  message("SKIPPED: pkg-config is not installed")
  return()
endif()

set(ENV{PKG_CONFIG_PATH} ${PREFIX}/${DATA_DIR}/pkgconfig)
execute_process(COMMAND ${PKG_CONFIG} --exact-version=${VERSION} --print-errors dynains
  RESULT_VARIABLE result)
execute_process(COMMAND ${PKG_CONFIG} --atleast-version=99 dynains RESULT_VARIABLE too_new)
if(NOT result EQUAL 0 OR too_new EQUAL 0)
  message(FATAL_ERROR "pkg-config does not report version ${VERSION}")
endif()

execute_process(COMMAND ${PKG_CONFIG} --cflags --libs dynains
  OUTPUT_VARIABLE flags OUTPUT_STRIP_TRAILING_WHITESPACE)
separate_arguments(flags)
foreach(flag IN LISTS flags)
  if(NOT flag MATCHES "^(-I|-pthread$)")
    message(FATAL_ERROR "the package forces the flag ${flag} on its users")
  endif()
endforeach()

execute_process(COMMAND ${COMPILER} -std=c++17 -fsyntax-only ${SOURCE} ${flags}
  RESULT_VARIABLE result)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "does not compile with: ${flags}")
endif()

# The compiled remover, where it is installed.
set(ENV{PKG_CONFIG_PATH} ${PREFIX}/${DATA_DIR}/pkgconfig:${PREFIX}/${LIB_DIR}/pkgconfig)
if(NOT EXISTS ${PREFIX}/${LIB_DIR}/pkgconfig/dynains-remover.pc)
  return()
endif()
execute_process(COMMAND ${PKG_CONFIG} --cflags --libs --print-errors dynains-remover
  OUTPUT_VARIABLE flags OUTPUT_STRIP_TRAILING_WHITESPACE)
separate_arguments(flags)
set(program ${WORK_DIR}/pkg_config_remover)
file(REMOVE ${program})
file(WRITE ${WORK_DIR}/pkg_config_remover.cpp
  "#include <dynains/compiled_remover.hpp>\n"
  "int main() { return dynains::DynaInsRemover().latency() == 0 ? 1 : 0; }\n")
execute_process(
  COMMAND ${COMPILER} -std=c++17 ${WORK_DIR}/pkg_config_remover.cpp ${INSTRUMENTED} ${flags} -o ${program}
  RESULT_VARIABLE result)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "does not link with: ${flags}")
endif()
execute_process(COMMAND ${CMAKE_COMMAND} -E env LD_LIBRARY_PATH=${PREFIX}/${LIB_DIR} ${program}
  RESULT_VARIABLE result)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "the program of the compiled remover ended with ${result}")
endif()
