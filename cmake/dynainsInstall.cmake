# Install rules, and the config file of the package for the install tree and the build tree.
#
# Each part has an export set and an install component of its own: dynains_core, dynains_io, ...,
# dynains_program. So each part can be installed without the others:
#   cmake --install build --component dynains_core     headers only
include(CMakePackageConfigHelpers)

set(dynains_cmake_dir ${CMAKE_INSTALL_LIBDIR}/cmake/dynains)
get_property(dynains_components GLOBAL PROPERTY DYNAINS_COMPONENTS)

# dynains_install_library(<part> <target>): the library and its file of exported targets.
function(dynains_install_library part target)
  install(TARGETS ${target} EXPORT dynains-${part}-targets
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dynains_${part}
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dynains_${part}
    RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT dynains_${part})
  install(EXPORT dynains-${part}-targets NAMESPACE dynains::
    DESTINATION ${dynains_cmake_dir} COMPONENT dynains_${part})
  export(EXPORT dynains-${part}-targets NAMESPACE dynains::
    FILE ${PROJECT_BINARY_DIR}/dynains-${part}-targets.cmake)
endfunction()

# dynains_install_headers(<part> <folder> [PATTERN <folder> EXCLUDE]...)
function(dynains_install_headers part folder)
  get_filename_component(parent include/${folder} DIRECTORY)
  string(REPLACE include ${CMAKE_INSTALL_INCLUDEDIR} destination ${parent})
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/${folder} DESTINATION ${destination}
    COMPONENT dynains_${part} FILES_MATCHING PATTERN "*.hpp" ${ARGN})
endfunction()

set(dynains_not_core "")
foreach(folder IN LISTS dynains_component_folders)
  list(APPEND dynains_not_core PATTERN "dynains/${folder}" EXCLUDE)
endforeach()
dynains_install_library(core dynains)
dynains_install_headers(core dynains ${dynains_not_core})
foreach(component IN LISTS dynains_components)
  dynains_install_library(${component} dynains_${component})
  if(component IN_LIST dynains_component_folders)
    dynains_install_headers(${component} dynains/${component})
  endif()
endforeach()
if(TARGET dynains_program)
  install(TARGETS dynains_program
    RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT dynains_program)
endif()

# Programs and shared libraries find the shared libraries after the tree was moved.
if(BUILD_SHARED_LIBS AND NOT DEFINED CMAKE_INSTALL_RPATH)
  foreach(component IN LISTS dynains_components)
    set_target_properties(dynains_${component} PROPERTIES INSTALL_RPATH "$ORIGIN")
  endforeach()
  if(TARGET dynains_program)
    file(RELATIVE_PATH dynains_bin_to_lib ${CMAKE_INSTALL_FULL_BINDIR} ${CMAKE_INSTALL_FULL_LIBDIR})
    set_target_properties(dynains_program PROPERTIES INSTALL_RPATH "$ORIGIN/${dynains_bin_to_lib}")
  endif()
endif()

configure_file(cmake/dynainsConfig.cmake.in ${PROJECT_BINARY_DIR}/dynainsConfig.cmake @ONLY)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/dynainsConfigVersion.cmake
  COMPATIBILITY SameMajorVersion)
set(dynains_adapters cmake/dynains-pcl-adapter.cmake cmake/dynains-sophus-adapter.cmake)
file(COPY ${dynains_adapters} DESTINATION ${PROJECT_BINARY_DIR})
install(FILES ${PROJECT_BINARY_DIR}/dynainsConfig.cmake
  ${PROJECT_BINARY_DIR}/dynainsConfigVersion.cmake ${dynains_adapters}
  DESTINATION ${dynains_cmake_dir} COMPONENT dynains_core)

# The pkg-config files name the prefix relative to themselves, so that the tree can be moved. That of
# the headers is of every architecture, those of compiled components are not.
foreach(kind includedir libdir)
  string(TOUPPER ${kind} upper_kind)
  set(dynains_pc_${kind} "\${prefix}/${CMAKE_INSTALL_${upper_kind}}")
  if(IS_ABSOLUTE "${CMAKE_INSTALL_${upper_kind}}")
    set(dynains_pc_${kind} "${CMAKE_INSTALL_${upper_kind}}")
  endif()
endforeach()
# dynains_install_pc(<part> <template> <name> <parent folder>)
function(dynains_install_pc part template name parent)
  set(folder ${parent}/pkgconfig)
  get_filename_component(full_folder ${folder} ABSOLUTE BASE_DIR ${CMAKE_INSTALL_PREFIX})
  file(RELATIVE_PATH dynains_pc_to_prefix ${full_folder} ${CMAKE_INSTALL_PREFIX})
  string(REGEX REPLACE "/$" "" dynains_pc_to_prefix "${dynains_pc_to_prefix}")
  configure_file(cmake/${template}.pc.in ${PROJECT_BINARY_DIR}/${name}.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/${name}.pc DESTINATION ${folder} COMPONENT dynains_${part})
endfunction()
dynains_install_pc(core dynains dynains ${CMAKE_INSTALL_DATADIR})
if(TARGET dynains_remover)
  set(dynains_pc_requires dynains)
  set(dynains_pc_libs -ldynains_remover)
  dynains_install_pc(remover dynains-component dynains-remover ${CMAKE_INSTALL_LIBDIR})
endif()
if(TARGET dynains_odometry)
  set(dynains_pc_requires dynains-remover)
  set(dynains_pc_libs "-ldynains_odometry -ldynains_surfaces")
  dynains_install_pc(odometry dynains-component dynains-odometry ${CMAKE_INSTALL_LIBDIR})
endif()
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT dynains_core)
