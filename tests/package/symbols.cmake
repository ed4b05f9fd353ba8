# Refuses compiled components with weak functions of Eigen on aligned types. The linker keeps one copy
# of a weak function. If the copy of a consumer has wider registers, it needs an alignment that the
# objects of the component do not have. Types without alignment have the option 2 (DontAlign).
file(GLOB libraries ${LIB_DIR}/libdynains_*.a)
if(NOT NM OR NOT libraries)
  message("SKIPPED: no nm, or no static libraries")
  return()
endif()

set(aligned "Transform<(double|float), [23], [0-9]+, 0>|Quaternion<(double|float), 0>"
  "|(Matrix|Array)<double, (2|4|6|8), [0-9]+, [01],|(Matrix|Array)<float, (4|8), [0-9]+, [01],")
string(CONCAT aligned ${aligned})
foreach(library IN LISTS libraries)
  execute_process(COMMAND ${NM} -C ${library} OUTPUT_VARIABLE symbols ERROR_QUIET
    RESULT_VARIABLE result)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${NM} cannot read ${library}")
  endif()
  string(REGEX MATCHALL "[^\n]* W [^\n]*Eigen::[^\n]*" weak "${symbols}")
  list(FILTER weak INCLUDE REGEX "${aligned}")
  # Consumers have no functions on both kinds of types.
  list(FILTER weak EXCLUDE REGEX "Matrix<double, [0-9], [0-9], 2,|Quaternion<double, 2>")
  if(weak)
    list(REMOVE_DUPLICATES weak)
    string(REPLACE ";" "\n  " weak "${weak}")
    message(SEND_ERROR "${library} has\n  ${weak}")
  endif()
endforeach()
