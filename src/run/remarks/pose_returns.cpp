#include "pose_returns.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iomanip>
#include <ostream>

#include "dynains/errors.hpp"
#include "dynains/evidence/free_space_config.hpp"
#include "dynains/surfaces/landmarks.hpp"
#include "dynains/surfaces/motion_size.hpp"
#include "io/text.hpp"
#include "run/recorded_scans.hpp"

namespace dynains::run {
namespace {

std::size_t distance(std::size_t a, std::size_t b) { return a > b ? a - b : b - a; }

void add(std::vector<ReturnError>& errors, std::size_t earlier, std::size_t later, double metres,
         double degrees) {
  constexpr std::size_t kNear = 100;  // scans
  const auto is_near = [&](const ReturnError& error) {
    return distance(earlier, error.last_earlier) <= kNear && later - error.last_later <= kNear;
  };
  const auto found = std::find_if(errors.rbegin(), errors.rend(), is_near);
  if (found == errors.rend()) {
    errors.push_back({earlier, earlier, later, later, metres, degrees});
    return;
  }
  found->first_earlier = std::min(found->first_earlier, earlier);
  found->last_earlier = std::max(found->last_earlier, earlier);
  found->last_later = later;
  if (metres <= found->metres) return;
  found->metres = metres;
  found->degrees = degrees;
}

}  // namespace

std::vector<ReturnToPlace> find_returns(const Recording& recording,
                                        const std::filesystem::path& folder) {
  ByteStore store(folder);
  Returns returns(store, FreeSpaceConfig());
  PointBuffer points;
  std::vector<PointLabel> all_static;
  for (std::size_t i = 0; i < recording.size(); ++i) {
    copy_points(recording.read_scan(i), points);
    all_static.assign(points.size(), PointLabel::kStatic);
    returns.add(points, all_static, {orthonormalized(recording.T_world_sensor(i)), i == 0});
  }
  return returns.found();
}

std::vector<ReturnError> return_errors(const Recording& recording, std::size_t first,
                                       const std::vector<ReturnToPlace>& returns) {
  std::vector<ReturnError> errors;
  for (const ReturnToPlace& place : returns) {
    if (!place.is_known()) continue;
    const std::size_t earlier = first + place.earlier, later = first + place.later;
    const Pose T_error = recording.T_world_sensor(later).inverse() *
                         recording.T_world_sensor(earlier) * place.T_earlier_later;
    const double metres = T_error.translation().norm();
    const double degrees = 180.0 / M_PI * angle_of(T_error.linear());
    if (metres >= kAgreeing) add(errors, earlier, later, metres, degrees);
  }
  return errors;
}

std::string sentence(const ReturnError& error, const Recording& recording) {
  const auto names = [&](std::size_t first, std::size_t last) {
    if (first == last) return "scan " + recording.name(first);
    return "scans " + recording.name(first) + " to " + recording.name(last);
  };
  return "the trajectory returns to " + names(error.first_earlier, error.last_earlier) + " in " +
         names(error.first_later, error.last_later) + " with an error of " +
         text::fixed(error.metres, 2) + " m and " + text::fixed(error.degrees, 1) + " deg";
}

void write_closures(std::ostream& text, const std::vector<ReturnToPlace>& returns) {
  text << std::setprecision(9);
  for (const ReturnToPlace& place : returns) {
    if (!place.is_known()) continue;
    const Eigen::Quaterniond q(Eigen::Matrix3d(place.T_earlier_later.linear()));
    const Eigen::Vector3d t = place.T_earlier_later.translation();
    text << "EDGE_SE3:QUAT " << place.earlier << ' ' << place.later << ' ' << t.x() << ' ' << t.y()
         << ' ' << t.z() << ' ' << q.x() << ' ' << q.y() << ' ' << q.z() << ' ' << q.w();
    // g2o counts a rotation as the vector of its quaternion: half of its angle.
    Eigen::Matrix<double, 6, 6> scale = Eigen::Matrix<double, 6, 6>::Identity();
    scale.bottomRows<3>() *= 0.5;
    const Eigen::Map<const Eigen::Matrix<double, 6, 6>> covariance(place.covariance.data());
    const Eigen::Matrix<double, 6, 6> information = (scale * covariance * scale).inverse();
    for (Eigen::Index i = 0; i < 6; ++i) {
      for (Eigen::Index j = i; j < 6; ++j) text << ' ' << information(i, j);
    }
    text << '\n';
  }
}

}  // namespace dynains::run
