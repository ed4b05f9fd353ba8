# Tables of a small sequence, drawn by examples/draw_experiments.py.
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_QUIET ERROR_VARIABLE error)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${ARGN}: ${result}\n${error}")
  endif()
endfunction()

file(REMOVE_RECURSE ${WORK_DIR})
file(MAKE_DIRECTORY ${WORK_DIR})
run(${PROGRAM}_simulate ${WORK_DIR}/street --scans 6 --sensor vlp16)
run(${PROGRAM} experiment sweep ${WORK_DIR}/street --quiet --values 0.2,0.6
  --csv ${WORK_DIR}/sweep.csv)
run(${PROGRAM} experiment runtime ${WORK_DIR}/street --repeat 1 --csv ${WORK_DIR}/runtime.csv)
run(${PYTHON} -B ${SOURCE_DIR}/examples/draw_experiments.py ${WORK_DIR}/sweep.csv
  ${WORK_DIR}/runtime.csv)
foreach(name sweep runtime)
  file(READ ${WORK_DIR}/${name}.png begin LIMIT 8 HEX)
  if(NOT begin STREQUAL "89504e470d0a1a0a")
    message(SEND_ERROR "${name}.png is no picture")
  endif()
endforeach()
