# Compiles SOURCE, and links a program of the compiled remover, with the flags of pkg-config alone.
if(NOT PKG_CONFIG)
  message("SKIPPED: pkg-config is not installed")
  return()
endif()

set(ENV{PKG_CONFIG_PATH} ${PREFIX}/${DATA_DIR}/pkgconfig)
execute_process(COMMAND ${PKG_CONFIG} --exact-version=${VERSION} --print-errors dynains
  RESULT_VARIABLE result)
execute_process(COMMAND ${PKG_CONFIG} --atleast-version=99 dynains RESULT_VARIABLE too_new)
if(NOT result EQUAL 0 OR too_new EQUAL 0)
  message(FATAL_ERROR "pkg-config does not report version ${VERSION}")
endif()

execute_process(COMMAND ${PKG_CONFIG} --cflags --libs dynains
  OUTPUT_VARIABLE flags OUTPUT_STRIP_TRAILING_WHITESPACE)
separate_arguments(flags)
foreach(flag IN LISTS flags)
  if(NOT flag MATCHES "^(-I|-pthread$)")
    message(FATAL_ERROR "the package forces the flag ${flag} on its users")
  endif()
endforeach()

execute_process(COMMAND ${COMPILER} -std=c++17 -fsyntax-only ${SOURCE} ${flags}
  RESULT_VARIABLE result)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "does not compile with: ${flags}")
endif()

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
  execute_process(COMMAND ${PKG_CONFIG} --cflags --libs --print-errors dynains-${component}
    OUTPUT_VARIABLE flags OUTPUT_STRIP_TRAILING_WHITESPACE)
  separate_arguments(flags)
  set(program ${WORK_DIR}/pkg_config_${component})
  file(REMOVE ${program})
  file(WRITE ${program}.cpp "${${component}}")
  execute_process(
    COMMAND ${COMPILER} -std=c++17 ${program}.cpp ${INSTRUMENTED} ${flags} -o ${program}
    RESULT_VARIABLE result)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "the ${component} does not link with: ${flags}")
  endif()
  execute_process(COMMAND ${CMAKE_COMMAND} -E env LD_LIBRARY_PATH=${PREFIX}/${LIB_DIR} ${program}
    RESULT_VARIABLE result)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "the program of the ${component} ended with ${result}")
  endif()
endforeach()
