# Compiles the C++ blocks of PAGES, which the sources of FOLDER include as <page>_<number>.inc; only
# the sources CONTEXTS are compiled, because the others need a library that is missing.
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
  file(READ ${SOURCE_DIR}/docs/${page}.md rest)
  set(count 0)
  string(FIND "${rest}" "```cpp\n" begin)
  while(NOT begin EQUAL -1)
    math(EXPR begin "${begin} + 7")
    math(EXPR count "${count} + 1")
    string(SUBSTRING "${rest}" ${begin} -1 rest)
    string(FIND "${rest}" "```" end)
    string(SUBSTRING "${rest}" 0 ${end} block)
    file(WRITE ${WORK_DIR}/${page}_${count}.inc "${block}")
    list(APPEND blocks ${page}_${count}.inc)
    string(FIND "${rest}" "```cpp\n" begin)
  endwhile()
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
