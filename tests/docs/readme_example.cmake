# README shows the first example word for word.
file(READ "${SOURCE_DIR}/README.md" readme)
file(READ "${SOURCE_DIR}/examples/01_minimal_raw_arrays.cpp" example)
string(FIND "${readme}" "${example}" at)
if(at EQUAL -1)
  message(FATAL_ERROR "README.md does not show examples/01_minimal_raw_arrays.cpp as it is")
endif()
