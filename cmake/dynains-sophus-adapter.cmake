# dynains::sophus: the header dynains/adapters/sophus.hpp and the library that it needs.
find_package(Sophus QUIET)
if(NOT TARGET Sophus::Sophus)
  set(_dynains_obstacle "component 'sophus' needs Sophus, which was not found")
elseif(NOT TARGET dynains::sophus)
  add_library(dynains::sophus INTERFACE IMPORTED)
  target_link_libraries(dynains::sophus INTERFACE dynains::dynains Sophus::Sophus)
endif()
