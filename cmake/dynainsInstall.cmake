# Install rules, and the package's config file for the install tree and the build tree.
#
# Every part has an export set and an install component of its own (dynains_core, dynains_io, ...,
# dynains_program), so that each can be installed without the others:
#   cmake --install build --component dynains_core     headers only
include(CMakePackageConfigHelpers)

set(dynains_cmake_dir ${CMAKE_INSTALL_LIBDIR}/cmake/dynains)
get_property(dynains_components GLOBAL PROPERTY DYNAINS_COMPONENTS)

# Libraries that a component links, publicly or privately, through all its components.
function(dynains_collect_needs name components_out packages_out)
  set(components "")
  set(packages "")
  get_target_property(libraries dynains_${name} LINK_LIBRARIES)
  foreach(library IN LISTS libraries)
    if(library MATCHES "^dynains(::|_)(.+)$" AND CMAKE_MATCH_2 IN_LIST dynains_components)
      dynains_collect_needs(${CMAKE_MATCH_2} more_components more_packages)
      list(APPEND components ${more_components})
      list(APPEND packages ${more_packages})
    elseif(library MATCHES "^([A-Za-z0-9_]+)::")
      list(APPEND packages ${CMAKE_MATCH_1})
    endif()
  endforeach()
  list(APPEND components ${name})
  list(REMOVE_DUPLICATES components)
  list(REMOVE_ITEM packages dynains Eigen3)
  list(REMOVE_DUPLICATES packages)
  set(${components_out} ${components} PARENT_SCOPE)
  set(${packages_out} ${packages} PARENT_SCOPE)
endfunction()

function(dynains_install_part part target)
  install(TARGETS ${target} EXPORT dynains-${part}-targets
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dynains_${part}
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dynains_${part}
    RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT dynains_${part})
  install(EXPORT dynains-${part}-targets NAMESPACE dynains::
    DESTINATION ${dynains_cmake_dir} COMPONENT dynains_${part})
  export(EXPORT dynains-${part}-targets NAMESPACE dynains::
    FILE ${PROJECT_BINARY_DIR}/dynains-${part}-targets.cmake)
endfunction()

# The build folder may hold files of components that are switched off by now.
file(GLOB dynains_stale ${PROJECT_BINARY_DIR}/dynains-*-targets.cmake)
if(dynains_stale)
  file(REMOVE ${dynains_stale})
endif()

dynains_install_part(core dynains)
set(dynains_needs "")
foreach(name IN LISTS dynains_components)
  dynains_install_part(${name} dynains_${name})
  dynains_collect_needs(${name} components packages)
  string(APPEND dynains_needs "set(_dynains_components_of_${name} ${components})\n"
                              "set(_dynains_packages_of_${name} ${packages})\n")
  if(IS_DIRECTORY ${PROJECT_SOURCE_DIR}/include/dynains/${name})
    install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/dynains/${name}
      DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/dynains COMPONENT dynains_${name}
      FILES_MATCHING PATTERN "*.hpp")
  endif()
endforeach()

# Shared libraries find each other, and the program finds them, wherever the tree is put.
if(BUILD_SHARED_LIBS AND NOT DEFINED CMAKE_INSTALL_RPATH)
  foreach(name IN LISTS dynains_components)
    set_target_properties(dynains_${name} PROPERTIES INSTALL_RPATH "$ORIGIN")
  endforeach()
  if(TARGET dynains_program)
    file(RELATIVE_PATH dynains_bin_to_lib ${CMAKE_INSTALL_FULL_BINDIR} ${CMAKE_INSTALL_FULL_LIBDIR})
    set_target_properties(dynains_program PROPERTIES INSTALL_RPATH "$ORIGIN/${dynains_bin_to_lib}")
  endif()
endif()

# Headers of components stay out of the core, also of those that are not built.
set(dynains_not_core "")
foreach(room IN LISTS dynains_rooms)
  list(APPEND dynains_not_core PATTERN "dynains/${room}" EXCLUDE)
endforeach()
install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/dynains
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT dynains_core
  FILES_MATCHING PATTERN "*.hpp" ${dynains_not_core})

configure_file(${PROJECT_SOURCE_DIR}/cmake/dynainsConfig.cmake.in
  ${PROJECT_BINARY_DIR}/dynainsConfig.cmake @ONLY)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/dynainsConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/dynainsConfig.cmake
              ${PROJECT_BINARY_DIR}/dynainsConfigVersion.cmake
  DESTINATION ${dynains_cmake_dir} COMPONENT dynains_core)

# Relative to the file itself, so that the installed tree can be moved.
file(RELATIVE_PATH dynains_pc_to_prefix
  ${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig ${CMAKE_INSTALL_PREFIX})
string(REGEX REPLACE "/$" "" dynains_pc_to_prefix "${dynains_pc_to_prefix}")
set(dynains_pc_includedir "\${prefix}/${CMAKE_INSTALL_INCLUDEDIR}")
if(IS_ABSOLUTE "${CMAKE_INSTALL_INCLUDEDIR}")
  set(dynains_pc_includedir "${CMAKE_INSTALL_INCLUDEDIR}")
endif()
configure_file(${PROJECT_SOURCE_DIR}/cmake/dynains.pc.in ${PROJECT_BINARY_DIR}/dynains.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/dynains.pc
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT dynains_core)
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE
  DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT dynains_core)

if(TARGET dynains_program)
  install(TARGETS dynains_program
    RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT dynains_program)
endif()
