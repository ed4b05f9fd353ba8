# Installs BUILD_DIR into WORK_DIR, moves the result and searches it for the original paths.
include(${CMAKE_CURRENT_LIST_DIR}/../support/call.cmake)

# install_tree(<name> <option>...) installs to a temporary place and moves it to WORK_DIR/<name>.
function(install_tree name)
  set(passing ${WORK_DIR}/passing_${name})
  file(REMOVE_RECURSE ${passing} ${WORK_DIR}/${name})
  call("install"
    ${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${passing} --config "${CONFIG}" ${ARGN})
  file(RENAME ${passing} ${WORK_DIR}/${name})

  # Debug information and instrumentation contain paths of source files.
  set(searched "")
  if(INSTRUMENTED OR NOT CONFIG STREQUAL "Release")
    set(searched --include=*.hpp --include=*.cmake --include=*.pc)
  endif()
  execute_process(
    COMMAND grep -r -F -l ${searched} -e ${passing} -e ${BUILD_DIR} -e ${SOURCE_DIR} ${WORK_DIR}/${name}
    RESULT_VARIABLE absent OUTPUT_VARIABLE files)
  if(NOT absent EQUAL 1)
    message(SEND_ERROR "files contain paths of the install or the build:\n${files}")
  endif()
endfunction()

install_tree(prefix)
if(PROGRAM AND NOT EXISTS ${WORK_DIR}/prefix/${BIN_DIR}/${PROGRAM})
  message(SEND_ERROR "the program ${PROGRAM} was not installed")
endif()

install_tree(prefix_core --component dynains_core)
file(GLOB_RECURSE compiled
  ${WORK_DIR}/prefix_core/*.a ${WORK_DIR}/prefix_core/*.so* ${WORK_DIR}/prefix_core/${BIN_DIR}/*)
if(compiled)
  message(SEND_ERROR "the core is headers only, but these were installed: ${compiled}")
endif()
if(NOT EXISTS ${WORK_DIR}/prefix_core/include/dynains/version.hpp)
  message(SEND_ERROR "the core was installed without its headers")
endif()
