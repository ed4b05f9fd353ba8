# cmake --build build --target docs   writes the pages of the public headers to build/docs/html.
find_program(dynains_doxygen doxygen)
if(dynains_doxygen)
  file(WRITE ${PROJECT_BINARY_DIR}/Doxyfile
    "@INCLUDE = docs/Doxyfile\nOUTPUT_DIRECTORY = ${PROJECT_BINARY_DIR}/docs\n")
  add_custom_target(docs COMMAND ${dynains_doxygen} ${PROJECT_BINARY_DIR}/Doxyfile
    WORKING_DIRECTORY ${PROJECT_SOURCE_DIR} VERBATIM)
else()
  add_custom_target(docs
    COMMAND ${CMAKE_COMMAND} -E echo "The target docs needs doxygen (Debian: doxygen)"
    COMMAND ${CMAKE_COMMAND} -E false VERBATIM)
endif()
