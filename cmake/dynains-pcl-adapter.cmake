# dynains::pcl: the header dynains/adapters/pcl.hpp and the library that it needs.
find_package(PCL QUIET COMPONENTS common)
if(NOT TARGET pcl_common)
  set(_dynains_obstacle "component 'pcl' needs PCL, which was not found")
elseif(NOT TARGET dynains::pcl)
  add_library(dynains::pcl INTERFACE IMPORTED)
  target_link_libraries(dynains::pcl INTERFACE dynains::dynains pcl_common)
endif()
