include(CMakeFindDependencyMacro)
find_dependency(dynains 0.1 CONFIG)
include("${CMAKE_CURRENT_LIST_DIR}/exporter-targets.cmake")
