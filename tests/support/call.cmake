# call(<what> <command>...): runs a command in WORK_DIR; a failure ends the test. Sets `output`, which
# has both of its streams.
function(call what)
  file(MAKE_DIRECTORY ${WORK_DIR})
  execute_process(COMMAND ${ARGN} WORKING_DIRECTORY ${WORK_DIR}
    RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${what} failed: ${result}\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

# expect(<what> <expression>...): `output` matches each expression.
function(expect what)
  foreach(expression IN LISTS ARGN)
    if(NOT output MATCHES "${expression}")
      message(SEND_ERROR "${what}: expected '${expression}' in:\n${output}")
    endif()
  endforeach()
endfunction()
