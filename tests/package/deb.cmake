# Packs BUILD_DIR, installs the package into an empty root and starts the installed program.
include(${CMAKE_CURRENT_LIST_DIR}/../support/call.cmake)
file(REMOVE_RECURSE ${WORK_DIR}/deb ${WORK_DIR}/deb_root)
call("cpack"
  ${CPACK} -G DEB -C "${CONFIG}" -B ${WORK_DIR}/deb --config ${BUILD_DIR}/CPackConfig.cmake)
file(GLOB packages ${WORK_DIR}/deb/dynains_${VERSION}_*.deb)
list(LENGTH packages count)
if(NOT count EQUAL 1)
  message(FATAL_ERROR "cpack made ${count} packages:\n${output}")
endif()

# The dependencies of the package are installed on this machine, not in the empty root.
set(root ${WORK_DIR}/deb_root)
file(MAKE_DIRECTORY ${root}/var/lib/dpkg/info ${root}/var/lib/dpkg/updates)
file(WRITE ${root}/var/lib/dpkg/status "")
call("dpkg" ${DPKG} --root=${root} --force-depends -i ${packages})

call("the status" ${DPKG} --root=${root} --status dynains)
expect("the package" "Status: install ok installed" "Version: ${VERSION}"
  "Depends: [^\n]*libeigen3-dev")
foreach(name doc/dynains/copyright doc/dynains/changelog.gz)
  if(NOT EXISTS ${root}/usr/share/${name})
    message(SEND_ERROR "the package should have /usr/share/${name}")
  endif()
endforeach()

if(PROGRAM)
  call("the installed program" ${root}/usr/${BIN_DIR}/${PROGRAM} --version)
  expect("the installed program" ${VERSION})
endif()
