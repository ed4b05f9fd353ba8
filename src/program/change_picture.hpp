// A picture of a map of many sessions from above: what stands, what came and what left.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "dynains/city/city.hpp"
#include "figure.hpp"

namespace dynains::program {

inline constexpr Colour kStandingGroundColour = {205, 205, 205};
inline constexpr Colour kStandingObjectColour = {130, 130, 130};
inline constexpr Colour kAddedColour = {30, 80, 220};
inline constexpr Colour kRemovedColour = {220, 20, 30};

/// Added points cover removed points, and both cover standing points.
class ChangePicture {
 public:
  /// Shows the places of all sessions; the longer side has `pixels` pixels.
  ChangePicture(const std::vector<SessionInfo>& sessions, int pixels);

  /// `position`: m, world frame.
  void add_standing(const Eigen::Vector3d& position, bool is_above_ground) {
    add(position, 0, is_above_ground ? kStandingObjectColour : kStandingGroundColour);
  }
  void add_removed(const Eigen::Vector3d& position) { add(position, 1, kRemovedColour); }
  void add_added(const Eigen::Vector3d& position) { add(position, 2, kAddedColour); }

  Figure figure() const { return view_.figure(origin_); }

 private:
  void add(const Eigen::Vector3d& position, std::size_t layer, Colour colour) {
    view_.add(position - Eigen::Vector3d(origin_.x(), origin_.y(), 0.0), layer, colour);
  }

  Eigen::Vector2d origin_;  // m, world: coordinates of a figure are floats
  ViewFromAbove view_;
};

}  // namespace dynains::program
