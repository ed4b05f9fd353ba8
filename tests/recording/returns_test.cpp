// Returns to a place, and the error of poses there.
#include "dynains/recording/returns.hpp"

#include "support/box_street.hpp"
#include "support/catch.hpp"

using namespace dynains;
using namespace dynains::test;

namespace {

/// Drives along a street to and fro and to, under poses that are off by `T_error` from the first
/// turn on.
struct Drives {
  explicit Drives(const Pose& T_error = Pose::Identity()) {
    const std::vector<StreetBox> boxes = {{{-12, 8, 0}, {-6, 11, 4}, 50},
                                          {{28, 8, 0}, {34, 11, 5}, 50},
                                          {{-24, -11, 0}, {-18, -8, 5}, 50},
                                          {{8, -7, 0}, {12, -5, 1.6}, 50}};
    FreeSpaceConfig evidence;
    evidence.lookback_scans = 10;
    evidence.lookahead_scans = 4;
    Returns returns(store, evidence);
    for (int i = 0; i < 60; ++i) {
      const double x = std::abs(20.0 - std::abs(i - 20.0)) - 10.0;
      const BoxScan scan = scan_boxes(boxes, x, 0.0);
      T_given.push_back(i < 20 ? Pose(scan.T_world_sensor) : Pose(T_error * scan.T_world_sensor));
      T_true.push_back(scan.T_world_sensor);
      visits.push_back(returns.add(scan.points, scan.verdicts, {T_given.back()}));
    }
    found = returns.found();
  }

  ByteStore store{std::filesystem::temp_directory_path()};
  std::vector<Pose> T_given, T_true;
  std::vector<std::uint32_t> visits;
  std::vector<ReturnToPlace> found;
};

}  // namespace

TEST_CASE("exact poses fit at all returns, which are one visit") {
  const Drives drives;
  REQUIRE(drives.found.size() > 10);
  for (const ReturnToPlace& place : drives.found) {
    CAPTURE(place.earlier, place.later, place.distance, place.movement, place.deviation);
    CHECK(place.inliers > 0.9);
    CHECK(place.movement < 0.1);
    if (place.distance < 5.0) CHECK(place.fits());
  }
  CHECK(drives.visits.back() == 0);
}

TEST_CASE("the error of a return is known, also if it is larger than planes are") {
  for (const double metres : {0.4, 0.9, 1.6}) {
    CAPTURE(metres);
    Pose T_error(Eigen::AngleAxisd(0.02, Eigen::Vector3d::UnitZ()));
    T_error.translation() = metres * Eigen::Vector3d(0.8, 0.6, 0.0);
    const Drives drives(T_error);
    int known = 0;
    for (const ReturnToPlace& place : drives.found) {
      if (place.earlier >= 20 || !place.is_known()) continue;
      ++known;
      CHECK(place.is_wrong());
      const Pose T_left = place.T_earlier_later.inverse() * drives.T_true[place.earlier].inverse() *
                          drives.T_true[place.later];
      CHECK(T_left.translation().norm() < 0.1);
      CHECK(Eigen::AngleAxisd(T_left.linear()).angle() < 0.005);
      for (std::size_t i = 0; i < 6; ++i) CHECK(place.covariance[7 * i] > 0.0);
    }
    CHECK(known > 5);
  }
}
