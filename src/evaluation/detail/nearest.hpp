// Nearest of several points, independent of rounding.
#pragma once

namespace dynains::evaluation::detail {

/// Whether a squared distance (m^2) is less than the best one by more than rounding. The two points
/// of a voxel with two points are equally near to its centroid: without a margin, rounding would
/// choose the class, and another world frame would change the score. 1e-8 m^2 is 50 nm at 0.1 m;
/// rounding of coordinates of 5e6 m (UTM) is 1 nm.
constexpr bool is_nearer(double squared, double best) { return squared + 1e-8 < best; }

}  // namespace dynains::evaluation::detail
