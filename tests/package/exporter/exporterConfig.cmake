include(CMakeFindDependencyMacro)
find_dependency(dynains 1.0 CONFIG)
include("${CMAKE_CURRENT_LIST_DIR}/exporter-targets.cmake")
