// Lacks an include of right.hpp, which is compiled before other headers.
#pragma once

#include <Eigen/Geometry>

struct ReliesOnRight {
  Eigen::Vector3d point;
  Right right;
};
