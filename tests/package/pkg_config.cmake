# Compiles SOURCE with the flags of pkg-config alone.
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

set(program ${WORK_DIR}/pkg_config_consumer)
file(REMOVE ${program})
execute_process(COMMAND ${COMPILER} -std=c++17 ${SOURCE} ${flags} -o ${program}
  RESULT_VARIABLE result)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "does not compile with: ${flags}")
endif()
execute_process(COMMAND ${program} RESULT_VARIABLE result)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "${program} ended with ${result}")
endif()
