// Lacks an include of Eigen, which is the base of other headers.
#pragma once

#include "right.hpp"

struct ReliesOnBase {
  Eigen::Vector3d point;
  Right right;
};
