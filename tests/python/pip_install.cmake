# Installs the module by pip, without network and into a folder of its own, and imports it.
execute_process(COMMAND ${PYTHON} -c "import setuptools, wheel, pip" RESULT_VARIABLE absent
  OUTPUT_QUIET ERROR_QUIET)
if(absent)
  message("SKIPPED: pip, setuptools or wheel are not installed")
  return()
endif()

set(target ${WORK_DIR}/pip)
file(REMOVE_RECURSE ${target})
file(MAKE_DIRECTORY ${WORK_DIR}/pip_build)
# All files that pip writes are outside the source folder.
file(WRITE ${WORK_DIR}/pip.cfg
  "[build]\nbuild_base = ${WORK_DIR}/pip_build\n[egg_info]\negg_base = ${WORK_DIR}/pip_build\n")
set(ENV{DIST_EXTRA_CONFIG} ${WORK_DIR}/pip.cfg)
# The test checks the build only. Optimization would cost minutes.
set(ENV{CMAKE_ARGS} "-DCMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER} -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS_DEBUG=-O0 -DCMAKE_UNITY_BUILD=ON")
set(ENV{PIP_DISABLE_PIP_VERSION_CHECK} 1)
execute_process(
  COMMAND ${PYTHON} -m pip install --no-build-isolation --no-index --no-deps
    --target ${target} ${SOURCE_DIR}/src/python
  RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "pip failed:\n${output}")
endif()

set(ENV{PYTHONPATH} ${target})
execute_process(COMMAND ${PYTHON} -B -c
    "import dynains, sys; assert dynains.__file__.startswith('${target}'); sys.stdout.write(dynains.__version__)"
  WORKING_DIRECTORY ${WORK_DIR} RESULT_VARIABLE result OUTPUT_VARIABLE version)
if(NOT result EQUAL 0 OR NOT version STREQUAL VERSION)
  message(FATAL_ERROR "the installed module says version '${version}', expected ${VERSION}")
endif()
