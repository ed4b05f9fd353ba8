# The table of parameters in docs/ is the output of write_parameters.
execute_process(COMMAND ${PROGRAM} OUTPUT_VARIABLE expected RESULT_VARIABLE result)
file(READ ${FILE} found)
if(NOT result EQUAL 0 OR expected STREQUAL "" OR NOT found STREQUAL expected)
  message(FATAL_ERROR "${FILE} is out of date: ${PROGRAM} > docs/parameters.md")
endif()
