# One Debian package of everything that is installed:
#   cmake --build build --target dynains_installed && (cd build && cpack)
if(NOT DYNAINS_INSTALL)
  return()
endif()

# Builds all that is installed, and nothing else. cpack then does not build tests and examples.
# Without them, the target install builds what it installs, as vcpkg expects.
get_property(dynains_components GLOBAL PROPERTY DYNAINS_COMPONENTS)
add_custom_target(dynains_installed)
foreach(part ${dynains_components} program python)
  if(TARGET dynains_${part})
    add_dependencies(dynains_installed dynains_${part})
  endif()
endforeach()
if(dynains_has_tests OR dynains_has_examples)
  set(CMAKE_SKIP_INSTALL_ALL_DEPENDENCY ON)
endif()
file(WRITE ${PROJECT_BINARY_DIR}/build_installed.cmake
  "execute_process(COMMAND \"${CMAKE_COMMAND}\" --build \"${PROJECT_BINARY_DIR}\"
    --target dynains_installed RESULT_VARIABLE failed)
  if(failed)
    message(FATAL_ERROR \"The target dynains_installed was not built\")
  endif()\n")
set(CPACK_INSTALL_SCRIPTS ${PROJECT_BINARY_DIR}/build_installed.cmake)
set(CPACK_PRE_BUILD_SCRIPTS ${PROJECT_SOURCE_DIR}/cmake/debian_documents.cmake)

set(CPACK_PACKAGE_NAME dynains)
set(CPACK_PACKAGE_VENDOR dynains)
set(CPACK_PACKAGE_CONTACT "DynaInsRemover <noreply@dynains.invalid>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_PACKAGE_DESCRIPTION
    "C++ library, program and, if built, Python module that label the points of\nmoving objects in LiDAR scans and keep them out of maps.")
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_GENERATOR DEB)
set(CPACK_STRIP_FILES ON)

set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_DEPENDS libeigen3-dev)
if(TARGET dynains_python)
  math(EXPR dynains_next_minor "${Python3_VERSION_MINOR} + 1")
  string(APPEND CPACK_DEBIAN_PACKAGE_DEPENDS ", python3-numpy, python3"
    " (>= 3.${Python3_VERSION_MINOR}), python3 (<< 3.${dynains_next_minor})")
endif()
foreach(library IN LISTS dynains_log_libraries)
  string(APPEND CPACK_DEBIAN_PACKAGE_DEPENDS ", lib${library}-dev")
endforeach()
# dpkg-shlibdeps, where it is installed, finds the libraries that the program needs.
find_program(dynains_shlibdeps dpkg-shlibdeps)
if(dynains_shlibdeps)
  set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
endif()
include(CPack)
