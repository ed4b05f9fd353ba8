# Configures the project without any optional package, and expects one status line for each part
# that is left out. Then configures it as part of a parent project, and expects a status line with
# the option that builds the components.
set(common -G "${GENERATOR}" -DCMAKE_CXX_COMPILER=${COMPILER} -DEigen3_DIR=${EIGEN_DIR})
set(without "")
foreach(package Catch2 CLI11 PNG nanoflann nlohmann_json pybind11 Python3)
  list(APPEND without -DCMAKE_DISABLE_FIND_PACKAGE_${package}=ON)
endforeach()

include(${CMAKE_CURRENT_LIST_DIR}/../support/call.cmake)
file(REMOVE_RECURSE ${WORK_DIR}/parts)
call("configuring with Eigen and a compiler alone"
  ${CMAKE_COMMAND} -S ${SOURCE_DIR} -B ${WORK_DIR}/parts/eigen_alone ${common} ${without})
expect("with Eigen alone" "no program: not found: CLI11 .Debian: libcli11-dev." "no Python module: not found: "
  "no io and poses components: not found: nanoflann"
  "no city and evaluation components: not found: nlohmann_json" "no tests: not found: Catch2")

# vcpkg builds the target install alone. A dry run of make tells what that builds, one of Ninja not.
set(off "")
foreach(part PROGRAM PYTHON EXAMPLES TESTS)
  list(APPEND off -DDYNAINS_BUILD_${part}=OFF)
endforeach()
call("configuring the port" ${CMAKE_COMMAND} -S ${SOURCE_DIR} -B ${WORK_DIR}/parts/port
  -G "Unix Makefiles" -DCMAKE_CXX_COMPILER=${COMPILER} -DEigen3_DIR=${EIGEN_DIR} ${off})
call("the port" ${CMAKE_COMMAND} --build ${WORK_DIR}/parts/port --target install -- -n)
expect("the port" libdynains_remover)

execute_process(
  COMMAND ${CMAKE_COMMAND} -S ${SOURCE_DIR} -B ${WORK_DIR}/parts/required ${common} ${without}
    -DDYNAINS_BUILD_PYTHON=ON
  RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
if(result EQUAL 0)
  message(SEND_ERROR "a part that was asked for was left out without an error:\n${output}")
endif()
expect("a part that was asked for" "DYNAINS_BUILD_PYTHON = ON" "pybind11")

file(WRITE ${WORK_DIR}/parts/parent/CMakeLists.txt
  "cmake_minimum_required(VERSION 3.16)\nproject(parent LANGUAGES CXX)\n"
  "add_subdirectory(${SOURCE_DIR} dynains)\n")
call("configuring a parent project"
  ${CMAKE_COMMAND} -S ${WORK_DIR}/parts/parent -B ${WORK_DIR}/parts/parent/build ${common})
expect("a parent project" "set DYNAINS_BUILD_COMPONENTS to ON to build it"
  "set DYNAINS_BUILD_REMOVER to ON to build it")
