// Includes what it needs, among it the base.
#pragma once

#include <Eigen/Geometry>

struct NeedsBase {
  Eigen::Vector3d point;
};
