# Compiles SOURCE, and links a program of the compiled remover, with the flags of pkg-config alone.
if(NOT PKG_CONFIG)
  message("SKIPPED: pkg-config is not installed")
  return()
endif()

include(${CMAKE_CURRENT_LIST_DIR}/../support/call.cmake)
# flags_of(<package>): sets `flags`.
function(flags_of package)
  call("pkg-config" ${PKG_CONFIG} --cflags --libs --print-errors ${package})
  string(STRIP "${output}" flags)
  separate_arguments(flags)
  set(flags "${flags}" PARENT_SCOPE)
endfunction()

set(ENV{PKG_CONFIG_PATH} ${PREFIX}/${DATA_DIR}/pkgconfig)
call("pkg-config of ${VERSION}" ${PKG_CONFIG} --exact-version=${VERSION} --print-errors dynains)
execute_process(COMMAND ${PKG_CONFIG} --atleast-version=99 dynains RESULT_VARIABLE too_new)
if(too_new EQUAL 0)
  message(FATAL_ERROR "pkg-config reports a version above ${VERSION}")
endif()

flags_of(dynains)
foreach(flag IN LISTS flags)
  if(NOT flag MATCHES "^(-I|-pthread$)")
    message(FATAL_ERROR "the package forces the flag ${flag} on its users")
  endif()
endforeach()

call("compiling with ${flags}" ${COMPILER} -std=c++17 -fsyntax-only ${SOURCE} ${flags})

# Compiled components, where they are installed.
set(ENV{PKG_CONFIG_PATH} ${PREFIX}/${DATA_DIR}/pkgconfig:${PREFIX}/${LIB_DIR}/pkgconfig)
set(remover "#include <dynains/compiled_remover.hpp>
int main() { return dynains::DynaInsRemover().latency() == 0 ? 1 : 0; }\n")
set(odometry "#include <dynains/odometry/odometry.hpp>
int main() {
  const float point[3] = {5, 0, 0};
  dynains::Odometry odometry;
  const auto result = odometry.push(dynains::RawPoints{point, 1, 3}, {}, 0.0);
  return result.loss == dynains::OdometryLoss::kFewPoints ? 0 : 1;
}\n")
foreach(component remover odometry)
  if(NOT EXISTS ${PREFIX}/${LIB_DIR}/pkgconfig/dynains-${component}.pc)
    continue()
  endif()
  flags_of(dynains-${component})
  set(program ${WORK_DIR}/pkg_config_${component})
  file(REMOVE ${program})
  file(WRITE ${program}.cpp "${${component}}")
  call("linking the ${component} with ${flags}"
    ${COMPILER} -std=c++17 ${program}.cpp ${INSTRUMENTED} ${flags} -o ${program})
  call("the program of the ${component}"
    ${CMAKE_COMMAND} -E env LD_LIBRARY_PATH=${PREFIX}/${LIB_DIR} ${program})
endforeach()
