# One binary package of everything that is installed:  cd build && cpack -G DEB
set(CPACK_PACKAGE_NAME dynains)
set(CPACK_PACKAGE_VENDOR dynains)
set(CPACK_PACKAGE_CONTACT "DynaInsRemover <noreply@dynains.invalid>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_PACKAGE_DESCRIPTION
    "C++ library, program and, if built, Python module that label the points of moving\nobjects in LiDAR scans and keep them out of maps.")
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_GENERATOR DEB)
set(CPACK_STRIP_FILES ON)

set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_PACKAGE_DEPENDS libeigen3-dev)
if(TARGET dynains_python)
  string(APPEND CPACK_DEBIAN_PACKAGE_DEPENDS ", python3-numpy")
endif()
# Libraries of the program, found by dpkg-shlibdeps where it is installed.
find_program(dynains_shlibdeps dpkg-shlibdeps)
if(dynains_shlibdeps)
  set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
endif()
include(CPack)
