# For a registry: fill in OWNER, and SHA512 of the archive of the release. In a checkout, this is an
# overlay port: vcpkg install dynains --overlay-ports=dynains/cmake/packaging/vcpkg
get_filename_component(SOURCE_PATH "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)
if(NOT EXISTS "${SOURCE_PATH}/include/dynains")
  vcpkg_from_github(OUT_SOURCE_PATH SOURCE_PATH
    REPO OWNER/dynains
    REF "v${VERSION}"
    SHA512 0
    HEAD_REF main)
endif()

set(options -DDYNAINS_BUILD_COMPONENTS=ON)
foreach(part PROGRAM PYTHON EXAMPLES TESTS)
  list(APPEND options -DDYNAINS_BUILD_${part}=OFF)
endforeach()
foreach(library LZ4 ZSTD BZ2 Z SQLITE3)
  list(APPEND options -DDYNAINS_WITH_${library}=OFF)
endforeach()

vcpkg_cmake_configure(SOURCE_PATH "${SOURCE_PATH}" OPTIONS ${options})
vcpkg_cmake_install()
vcpkg_cmake_config_fixup(CONFIG_PATH lib/cmake/dynains)
vcpkg_fixup_pkgconfig()
file(REMOVE_RECURSE "${CURRENT_PACKAGES_DIR}/debug/include" "${CURRENT_PACKAGES_DIR}/debug/share")
file(INSTALL "${CMAKE_CURRENT_LIST_DIR}/usage" DESTINATION "${CURRENT_PACKAGES_DIR}/share/${PORT}")
vcpkg_install_copyright(FILE_LIST "${SOURCE_PATH}/LICENSE")
