#include "pose_test.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "agreement_sum.hpp"
#include "io/median.hpp"
#include "scan_registration.hpp"

namespace dynains {
namespace {

constexpr std::size_t kShortestWay = 4;  // scans

/// A place of the test, and the scans from which on motions are registered.
struct Place {
  std::size_t scan;
  bool is_long;  // whether scans farther apart are registered, too
};

/// Scans up to `merged` before a place, and behind the end of its motions, belong to the test.
std::vector<Place> list_places(const TestPlaces& wanted, std::size_t merged) {
  std::vector<Place> places;
  const std::size_t first = wanted.first + merged - 1;
  if (wanted.last < first + merged) return places;
  const std::size_t last = wanted.last - merged;
  const auto add = [&](std::size_t scan, bool is_long) {
    const bool is_new = places.empty() || scan > places.back().scan;
    if (scan <= last && is_new) places.push_back({scan, is_long});
  };
  add(first, true);
  if (wanted.looks_at_start) {
    for (const std::size_t behind : {1, 2}) add(first + behind, false);
  }
  // The last place leaves room for a motion over some scans.
  const std::size_t end = std::max(first, last - std::min(last, kShortestWay));
  for (std::size_t k = 1; k < wanted.count; ++k) {
    add(first + k * (end - first) / std::max<std::size_t>(1, wanted.count - 1), true);
  }
  return places;
}

class Tester {
 public:
  Tester(const Recording& recording, const PoseOfScan& pose_of, const ScanMerger::OnScan& on_scan)
      : pose_of_(pose_of),
        merger_(recording, pose_of, on_scan),
        merged_(scans_to_merge(recording)) {}

  std::size_t merged() const { return merged_; }

  void look_at(const Place& place, std::size_t chain, std::size_t last) {
    const PointBuffer points = merger_.merge(place.scan, place.scan + 1 - merged_, place.scan);
    const RegistrationScan a(points);
    register_to(a, chain, place.scan, place.scan + 1);
    if (!place.is_long) return;
    const std::size_t far = place.scan + long_step(place.scan, last);
    if (far <= place.scan + 1) return;
    const PointBuffer far_points = register_to(a, chain, place.scan, far);
    compare(points, far_points, place.scan, far);
  }

  PoseTest result() {
    test_.as_given = given_.mean();
    test_.standing = standing_.mean();
    test_.stride = static_cast<std::size_t>(median(strides_));
    return std::move(test_);
  }

 private:
  /// Registers scans that begin with `second`; returns their points.
  PointBuffer register_to(const RegistrationScan& a, std::size_t chain, std::size_t first,
                          std::size_t second) {
    constexpr double kUncertain = 0.05;  // m
    constexpr double kDistinct = 0.5;    // m
    PointBuffer points = merger_.merge(second, second, second + merged_ - 1);
    const auto given = motion(first, second);
    if (!given) return points;
    std::vector<Pose> guesses = {*given};
    // In traffic of the own speed, no motion may fit as well.
    const bool is_step = second == first + 1;
    if (is_step && given->translation().norm() > kDistinct) {
      guesses.push_back(Pose::Identity());
    }
    const RegistrationScan b(points);
    const auto forth = register_scans(a, b, guesses);
    if (!forth) return points;
    const auto found = checked(forth, register_near(b, a, forth->T_a_b.inverse()), kUncertain, 0.0);
    if (found)
      test_.motions.push_back({chain, first, second, found->T_a_b, found->difference, 0.0});
    return points;
  }

  std::optional<Pose> motion(std::size_t first, std::size_t second) const {
    const auto T_world_first = pose_of_(first);
    const auto T_world_second = pose_of_(second);
    if (!T_world_first || !T_world_second) return std::nullopt;
    return T_world_first->inverse() * *T_world_second;
  }

  /// Number of scans to one that is some metres away or turned, by the poses.
  std::size_t long_step(std::size_t scan, std::size_t last) const {
    constexpr std::size_t kLongest = 16;  // scans
    constexpr double kFar = 3.0;          // m
    constexpr double kTurned = 0.25;      // rad
    const std::size_t most = std::min(kLongest, last + 1 - merged_ - scan);
    for (std::size_t step = kShortestWay; step <= most; ++step) {
      const auto way = motion(scan, scan + step);
      if (way && (way->translation().norm() > kFar || rotation_angle(*way) > kTurned)) return step;
    }
    return most;
  }

  void compare(const PointBuffer& a, const PointBuffer& b, std::size_t first, std::size_t second) {
    const auto given = motion(first, second);
    if (!given) return;
    const Mounting mounting = estimate_mounting(a);
    test_.mountings.push_back(mounting);
    const Landmarks of_a(a, mounting);
    const Landmarks of_b(b, mounting);
    given_.add(of_a.compare(of_b, *given));
    standing_.add(of_a.compare(of_b, Pose::Identity()));
    strides_.push_back(static_cast<double>(second - first));
  }

  PoseOfScan pose_of_;
  ScanMerger merger_;
  std::size_t merged_;
  PoseTest test_;
  AgreementSum given_;
  AgreementSum standing_;
  std::vector<double> strides_;
};

}  // namespace

PoseTest test_poses(const Recording& recording, const PoseOfScan& pose_of, const TestPlaces& places,
                    const ScanMerger::OnScan& on_scan) {
  Tester tester(recording, pose_of, on_scan);
  std::size_t chain = 0;
  for (const Place& place : list_places(places, tester.merged())) {
    tester.look_at(place, chain++, places.last);
  }
  return tester.result();
}

}  // namespace dynains
