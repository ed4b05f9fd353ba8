# Clouds that the library does not know give one error, which says what to do.
foreach(cloud "std::vector<float>" "std::vector<MyPoint>" HalfCloud "dynains::RawPoints<float>")
  set(system "")
  foreach(folder IN LISTS SYSTEM_INCLUDE_DIRS)
    list(APPEND system -isystem ${folder})
  endforeach()
  execute_process(
    COMMAND ${COMPILER} -std=c++17 -fsyntax-only "-DCLOUD=${cloud}" -I${INCLUDE_DIR} ${system}
      ${SOURCE}
    RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  string(REPLACE ";" "," output "${output}")
  string(REGEX MATCHALL "error:[^\n]*" errors "${output}")
  list(LENGTH errors count)
  if(cloud STREQUAL "dynains::RawPoints<float>")
    if(NOT result EQUAL 0)
      message(SEND_ERROR "${cloud}:\n${output}")
    endif()
  elseif(NOT count EQUAL 1 OR NOT output MATCHES
         "no cloud of points: specialise dynains::PointCloudTraits.*dynains::RawPoints{")
    message(SEND_ERROR "${cloud}: expected one error that says what to do, found\n${output}")
  endif()
endforeach()
