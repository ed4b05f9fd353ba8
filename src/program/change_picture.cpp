#include "change_picture.hpp"

#include <Eigen/Geometry>
#include <cstdint>

namespace dynains::program {
namespace {

Eigen::AlignedBox2d bounds_of(const std::vector<SessionInfo>& sessions) {
  if (sessions.empty()) return Eigen::AlignedBox2d(Eigen::Vector2d::Zero());
  Eigen::AlignedBox2d bounds;
  for (const SessionInfo& session : sessions) {
    bounds.extend(Eigen::Vector2d(session.lowest.head<2>()));
    bounds.extend(Eigen::Vector2d(session.highest.head<2>()));
  }
  return bounds;
}

Eigen::Vector2d origin_of(const std::vector<SessionInfo>& sessions) {
  constexpr double kStep = 10000.0;  // m: maps near the origin of the world keep it
  return (bounds_of(sessions).min().array() / kStep).cast<std::int64_t>().cast<double>() * kStep;
}

}  // namespace

ChangePicture::ChangePicture(const std::vector<SessionInfo>& sessions, int pixels)
    : origin_(origin_of(sessions)),
      view_(bounds_of(sessions).min() - origin_, bounds_of(sessions).max() - origin_, pixels, 3,
            {{"ground", kStandingGroundColour},
             {"standing", kStandingObjectColour},
             {"added", kAddedColour},
             {"removed", kRemovedColour}}) {}

}  // namespace dynains::program
