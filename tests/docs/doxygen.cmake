# Doxygen gives no warning for the public headers, and describes the facade.
if(NOT DOXYGEN)
  message("SKIPPED: doxygen is not installed")
  return()
endif()

file(WRITE ${WORK_DIR}/Doxyfile
  "@INCLUDE = docs/Doxyfile\nOUTPUT_DIRECTORY = ${WORK_DIR}/api\n")
execute_process(COMMAND ${DOXYGEN} ${WORK_DIR}/Doxyfile WORKING_DIRECTORY ${SOURCE_DIR}
  RESULT_VARIABLE result OUTPUT_VARIABLE warnings ERROR_VARIABLE warnings)
if(NOT result EQUAL 0 OR NOT warnings STREQUAL "")
  message(FATAL_ERROR "doxygen says:\n${warnings}")
endif()
if(NOT EXISTS ${WORK_DIR}/api/html/classdynains_1_1BasicDynaInsRemover.html)
  message(FATAL_ERROR "doxygen did not describe the facade")
endif()
