# VERSION of the project, the header, the installed package files, the program and the recipes of
# packagers have one version.
include(${CMAKE_CURRENT_LIST_DIR}/../support/call.cmake)

function(expect_version where found)
  if(NOT found STREQUAL VERSION)
    message(SEND_ERROR "${where} says '${found}', the project says '${VERSION}'")
  endif()
endfunction()

file(READ ${PREFIX}/include/dynains/version.hpp header)
string(REGEX MATCH "kVersionString\\[\\] = \"([^\"]*)\"" line "${header}")
expect_version("kVersionString" "${CMAKE_MATCH_1}")
set(parts "")
foreach(part Major Minor Patch)
  string(REGEX MATCH "kVersion${part} = ([0-9]+)" line "${header}")
  list(APPEND parts ${CMAKE_MATCH_1})
endforeach()
string(REPLACE ";" "." parts "${parts}")
expect_version("kVersionMajor, kVersionMinor, kVersionPatch" "${parts}")

set(PACKAGE_FIND_VERSION ${VERSION})
include(${PREFIX}/${CONFIG_DIR}/dynainsConfigVersion.cmake)
expect_version("dynainsConfigVersion.cmake" "${PACKAGE_VERSION}")

file(STRINGS ${PREFIX}/${DATA_DIR}/pkgconfig/dynains.pc line REGEX "^Version: ")
string(REPLACE "Version: " "" line "${line}")
expect_version("dynains.pc" "${line}")

if(PROGRAM)
  call("${PROGRAM} --version" ${PREFIX}/${BIN_DIR}/${PROGRAM} --version)
  string(REGEX MATCH "[0-9]+\\.[0-9]+\\.[0-9]+" found "${output}")
  expect_version("${PROGRAM} --version" "${found}")
endif()

if(PYTHON)
  execute_process(COMMAND ${PYTHON} -B ${CMAKE_CURRENT_LIST_DIR}/recipes.py ${SOURCE_DIR}
    OUTPUT_VARIABLE output RESULT_VARIABLE result)
  string(REGEX MATCHALL "[^\n]+" lines "${output}")
  list(LENGTH lines count)
  if(NOT result EQUAL 0 OR NOT count EQUAL 4)
    message(SEND_ERROR "Recipes of packagers: ${result}\n${output}")
  endif()
  foreach(line IN LISTS lines)
    string(REGEX MATCH "^([^ ]+) (.*)$" line "${line}")
    expect_version("${CMAKE_MATCH_1}" "${CMAKE_MATCH_2}")
  endforeach()
endif()
