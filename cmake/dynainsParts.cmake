# Optional parts. Each part has an option with three values:
#   AUTO   build the part if this is the top-level project and all needs of the part are found
#   ON     build the part; a missing need is an error
#   OFF    leave the part out
# The result is dynains_has_<part>. One status line for each part names what is missing.

# dynains_part(<part> <option> <description> <need>...); a need is written package=debian-package.
# This is a macro, because packages set variables in the scope of the caller.
macro(dynains_part part option description)
  if(NOT DEFINED ${option})
    set(${option} AUTO CACHE STRING "Build the ${description}: AUTO, ON or OFF")
    set_property(CACHE ${option} PROPERTY STRINGS AUTO ON OFF)
  endif()
  set(wanted ${${option}})
  if(wanted STREQUAL "AUTO")
    set(wanted ${dynains_top_level})
  endif()

  set(missing "")
  if(wanted)
    foreach(need ${ARGN})
      string(REGEX MATCH "^(.+)=(.+)$" need ${need})
      set(package ${CMAKE_MATCH_1})
      set(debian_package ${CMAKE_MATCH_2})
      if(NOT ${package}_FOUND)
        find_package(${package} QUIET)
      endif()
      if(NOT ${package}_FOUND)
        list(APPEND missing "${package} (Debian: ${debian_package})")
      endif()
    endforeach()
    string(REPLACE ";" ", " missing "${missing}")
  endif()

  set(dynains_has_${part} OFF)
  if(missing AND NOT ${option} STREQUAL "AUTO")
    message(FATAL_ERROR "${option} = ${${option}}, but this was not found: ${missing}")
  elseif(missing)
    message(STATUS "dynains: no ${description}: not found: ${missing}")
  elseif(wanted)
    message(STATUS "dynains: ${description}: yes")
    set(dynains_has_${part} ON)
  elseif(dynains_top_level OR "${part}" MATCHES "^(remover|components)$")
    message(STATUS "dynains: no ${description}: set ${option} to ON to build it")
  endif()
endmacro()

set(json nlohmann_json=nlohmann-json3-dev)
set(search nanoflann=libnanoflann-dev)
dynains_part(program DYNAINS_BUILD_PROGRAM "program" CLI11=libcli11-dev
  PNG=libpng-dev ZLIB=zlib1g-dev ${json} ${search})
if(NOT DYNAINS_BUILD_PYTHON STREQUAL "OFF")
  find_package(Python3 QUIET COMPONENTS Interpreter Development.Module)
endif()
dynains_part(python DYNAINS_BUILD_PYTHON "Python module"
  Python3=python3-dev pybind11=pybind11-dev PNG=libpng-dev ZLIB=zlib1g-dev ${json}
  ${search})
dynains_part(remover DYNAINS_BUILD_REMOVER "compiled remover")
if(dynains_has_program OR dynains_has_python)
  set(dynains_has_components ON)
  set(dynains_has_evaluation ON)
else()
  dynains_part(components DYNAINS_BUILD_COMPONENTS "io and poses components" ${search})
  dynains_part(evaluation DYNAINS_BUILD_COMPONENTS "city and evaluation components" ${json} ${search})
endif()

# dynains_log_library(<name> <header> <description> [<package>]): a library that some files need. It
# has no CMake package or pkg-config file. Its Debian package is <package>, or lib<name>-dev.
macro(dynains_log_library name header description)
  string(TOUPPER ${name} upper_name)
  find_library(DYNAINS_${upper_name}_LIBRARY ${name})
  find_path(DYNAINS_${upper_name}_HEADERS ${header})
  mark_as_advanced(DYNAINS_${upper_name}_LIBRARY DYNAINS_${upper_name}_HEADERS)
  if(DYNAINS_${upper_name}_LIBRARY AND DYNAINS_${upper_name}_HEADERS)
    set(lib${name}_FOUND ON)
  endif()
  set(debian_package lib${name}-dev)
  if(${ARGC} GREATER 3)
    set(debian_package ${ARGV3})
  endif()
  dynains_part(${name} DYNAINS_WITH_${upper_name} "${description}" lib${name}=${debian_package})
  if(dynains_has_${name})
    list(APPEND dynains_log_libraries ${name})
  endif()
endmacro()

set(dynains_log_libraries "")
if(dynains_has_components)
  dynains_log_library(lz4 lz4frame.h "logs with lz4 chunks (.mcap, .bag)")
  dynains_log_library(zstd zstd.h "logs with zstd chunks (.mcap)")
  dynains_log_library(bz2 bzlib.h "logs with bz2 chunks (.bag)")
  dynains_log_library(z zlib.h "checksums of logs" zlib1g-dev)
  dynains_log_library(sqlite3 sqlite3.h "logs in SQLite (.db3)")
endif()

dynains_part(tests DYNAINS_BUILD_TESTS "tests" Catch2=catch2)
dynains_part(examples DYNAINS_BUILD_EXAMPLES "examples")

# Folders of src/ and include/dynains/ that form one compiled component each.
set(dynains_component_folders io surfaces poses odometry recording city evaluation)
