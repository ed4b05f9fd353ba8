# Compiles the C++ blocks of PAGES, which the sources of FOLDER include as <page>_<number>.inc; only
# the sources CONTEXTS are compiled, because the others need a library that is missing.
include(${CMAKE_CURRENT_LIST_DIR}/blocks.cmake)
file(REMOVE_RECURSE ${WORK_DIR})
set(used "")
file(GLOB sources ${FOLDER}/*.cpp)
foreach(source IN LISTS sources)
  file(READ ${source} text)
  string(REGEX MATCHALL "[a-z_]+_[0-9]+[.]inc" names "${text}")
  list(APPEND used ${names})
endforeach()

set(blocks "")
foreach(page IN LISTS PAGES)
  extract_blocks(${SOURCE_DIR}/docs/${page}.md ${WORK_DIR}/${page} files)
  foreach(file IN LISTS files)
    get_filename_component(name ${file} NAME)
    list(APPEND blocks ${name})
  endforeach()
endforeach()

list(SORT used)
list(SORT blocks)
if(blocks STREQUAL "" OR NOT used STREQUAL blocks)
  message(FATAL_ERROR "the pages have the blocks ${blocks}, the contexts include ${used}")
endif()

set(system "")
foreach(folder IN LISTS SYSTEM_INCLUDE_DIRS)
  list(APPEND system -isystem ${folder})
endforeach()
foreach(context IN LISTS CONTEXTS)
  execute_process(
    COMMAND ${COMPILER} -std=c++17 -fsyntax-only ${WARNINGS} -Werror
      -Wno-unused-parameter -Wno-unused-variable -Wno-unused-but-set-variable -I${WORK_DIR}
      -I${SOURCE_DIR}/include -I${SOURCE_DIR}/tests ${system} ${FOLDER}/${context}.cpp
    RESULT_VARIABLE result ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    message(SEND_ERROR "${context}:\n${output}")
  endif()
endforeach()
