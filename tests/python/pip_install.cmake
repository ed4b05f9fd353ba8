# Builds a wheel by pip, from the module of the build folder, and installs it into a fresh virtual
# environment, all without network. Then checks the build that pip starts where no build folder is
# given: make goes through all its targets, but touches the files instead of compiling them, which
# would take minutes.
include(${CMAKE_CURRENT_LIST_DIR}/../support/call.cmake)
execute_process(COMMAND ${PYTHON} -c "import setuptools, wheel, pip, venv" RESULT_VARIABLE absent
  OUTPUT_QUIET ERROR_QUIET)
if(absent)
  message("SKIPPED: pip, setuptools, wheel or venv are not installed")
  return()
endif()

set(wheels ${WORK_DIR}/wheels)
set(environment ${WORK_DIR}/venv)
file(REMOVE_RECURSE ${wheels} ${environment} ${WORK_DIR}/pip_build)
file(MAKE_DIRECTORY ${WORK_DIR}/pip_build)
# All files that pip writes are outside the source folder.
file(WRITE ${WORK_DIR}/pip.cfg
  "[build]\nbuild_base = ${WORK_DIR}/pip_build\n[egg_info]\negg_base = ${WORK_DIR}/pip_build\n")
set(ENV{DIST_EXTRA_CONFIG} ${WORK_DIR}/pip.cfg)
set(ENV{PIP_DISABLE_PIP_VERSION_CHECK} 1)
set(ENV{DYNAINS_BUILD_DIR} ${BUILD_DIR})
call("pip wheel" ${PYTHON} -m pip wheel --no-build-isolation --no-index --no-deps
  --wheel-dir ${wheels} ${SOURCE_DIR}/src/python)
file(GLOB wheel ${wheels}/dynains-${VERSION}-*.whl)
if(NOT wheel)
  message(FATAL_ERROR "no wheel of version ${VERSION} in ${wheels}")
endif()

# NumPy is that of the system. Without ensurepip, which Debian has in a package of its own, pip of
# the system installs into the environment.
call("venv" ${PYTHON} -m venv --without-pip --system-site-packages ${environment})
call("pip install" ${PYTHON} -m pip --python ${environment}/bin/python install --no-index
  ${wheel})
set(ENV{PYTHONPATH})
call("import" ${environment}/bin/python -B -c
  "import dynains, pathlib
folder = pathlib.Path(dynains.__file__).parent
assert str(folder).startswith('${environment}'), folder
assert {'__init__.pyi', 'py.typed'} <= {file.name for file in folder.iterdir()}
import numpy
points = numpy.random.default_rng(1).uniform([-30, -30, -2], [30, 30, 1], (5000, 3))
frame = dynains.DynaInsRemover().push(points, numpy.eye(4))
assert len(frame.newest.labels) == len(points)
print(dynains.__version__, end='')")
if(NOT output STREQUAL VERSION)
  message(FATAL_ERROR "the installed module says version '${output}', expected ${VERSION}")
endif()

set(ENV{DYNAINS_BUILD_DIR})
set(ENV{CMAKE_ARGS} "-G 'Unix Makefiles' -DCMAKE_CXX_COMPILER=${COMPILER}")
set(ENV{CMAKE_BUILD_ARGS} "-- -t")
file(REMOVE_RECURSE ${WORK_DIR}/pip_build ${WORK_DIR}/touched)
file(MAKE_DIRECTORY ${WORK_DIR}/pip_build)
call("pip wheel of the sources" ${PYTHON} -m pip wheel --no-build-isolation --no-index --no-deps
  --wheel-dir ${WORK_DIR}/touched ${SOURCE_DIR}/src/python)
file(GLOB touched ${WORK_DIR}/touched/*.whl)
call("list the wheel" ${PYTHON} -m zipfile --list ${touched})
expect("the wheel of the sources" dynains/__init__.py dynains/__init__.pyi dynains/py.typed
  dynains/_dynains.cpython)
