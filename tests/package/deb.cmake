# Packs BUILD_DIR, installs the package into an empty root and starts the installed program.
file(REMOVE_RECURSE ${WORK_DIR}/deb ${WORK_DIR}/deb_root)
execute_process(
  COMMAND ${CPACK} -G DEB -C "${CONFIG}" -B ${WORK_DIR}/deb --config ${BUILD_DIR}/CPackConfig.cmake
  RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
file(GLOB packages ${WORK_DIR}/deb/dynains_${VERSION}_*.deb)
list(LENGTH packages count)
if(NOT result EQUAL 0 OR NOT count EQUAL 1)
  message(FATAL_ERROR "cpack made ${count} packages:\n${output}")
endif()

# The dependencies of the package are installed on this machine, not in the empty root.
set(root ${WORK_DIR}/deb_root)
file(MAKE_DIRECTORY ${root}/var/lib/dpkg/info ${root}/var/lib/dpkg/updates)
file(WRITE ${root}/var/lib/dpkg/status "")
execute_process(COMMAND ${DPKG} --root=${root} --force-depends -i ${packages}
  RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "dpkg failed:\n${output}")
endif()

execute_process(COMMAND ${DPKG} --root=${root} --status dynains OUTPUT_VARIABLE status)
foreach(line "Status: install ok installed" "Version: ${VERSION}" "Depends: [^\n]*libeigen3-dev")
  if(NOT status MATCHES "${line}")
    message(SEND_ERROR "the package should have '${line}':\n${status}")
  endif()
endforeach()
foreach(name doc/dynains/copyright doc/dynains/changelog.gz)
  if(NOT EXISTS ${root}/usr/share/${name})
    message(SEND_ERROR "the package should have /usr/share/${name}")
  endif()
endforeach()

if(PROGRAM)
  execute_process(COMMAND ${root}/usr/${BIN_DIR}/${PROGRAM} --version OUTPUT_VARIABLE output)
  if(NOT output MATCHES "${VERSION}")
    message(SEND_ERROR "the installed program says '${output}'")
  endif()
endif()
