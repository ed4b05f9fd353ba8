#include "motion_registration.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <utility>

#include "io/finite_points.hpp"
#include "scan_registration.hpp"
#include "way_search.hpp"

namespace dynains {
namespace {

/// A scan, as planes and as landmarks.
class ChainScan {
 public:
  explicit ChainScan(PointBuffer points) : points_(std::move(points)), planes_(points_) {}

  const RegistrationScan& planes() const { return planes_; }
  const Landmarks& landmarks() {
    if (!landmarks_) landmarks_.emplace(points_, estimate_mounting(points_), kWayRange);
    return *landmarks_;
  }

 private:
  PointBuffer points_;
  RegistrationScan planes_;
  std::optional<Landmarks> landmarks_;
};

/// Reads scans on demand and keeps those of one chain.
class ChainScans {
 public:
  explicit ChainScans(const Recording& recording) : recording_(recording) {}

  ChainScan& get(std::size_t i) {
    std::unique_ptr<ChainScan>& entry = scans_[i];
    if (entry == nullptr) {
      recording_.read_scan(i, scan_);
      entry = std::make_unique<ChainScan>(finite_points(scan_));
    }
    return *entry;
  }
  void clear() { scans_.clear(); }

 private:
  const Recording& recording_;
  RecordedScan scan_;
  std::map<std::size_t, std::unique_ptr<ChainScan>> scans_;
};

/// Guesses of the motion to the next scan: as given, none, the given distance in each direction,
/// and the motion at another place.
std::vector<Pose> first_guesses(const Pose& given, const std::optional<Pose>& elsewhere) {
  constexpr double kFarthest = 6.0;  // m
  std::vector<Pose> guesses = {Pose::Identity()};
  const double way = given.translation().norm();
  if (way < kFarthest) {
    guesses.push_back(given);
    for (const Eigen::Vector2d& direction : {Eigen::Vector2d(1, 0), Eigen::Vector2d(-1, 0),
                                             Eigen::Vector2d(0, 1), Eigen::Vector2d(0, -1)}) {
      if (way < 0.3) continue;
      guesses.push_back(Pose::Identity());
      guesses.back().translation().head<2>() = way * direction;
    }
  }
  if (elsewhere) guesses.push_back(*elsewhere);
  return guesses;
}

/// `uncertain`: m, uncertainty of the translation.
bool is_certain(const std::optional<Registration>& registration, double uncertain) {
  constexpr double kLeastScore = 0.45;
  return registration && registration->score > kLeastScore &&
         registration->uncertainty < uncertain && !registration->is_ambiguous;
}

}  // namespace

std::optional<CheckedMotion> checked(const std::optional<Registration>& forth,
                                     const std::optional<Registration>& back, double uncertain,
                                     double deviation) {
  constexpr double kNoisy = 0.25;  // m, 10 m from the sensor
  if (!is_certain(forth, uncertain) || !is_certain(back, uncertain)) return std::nullopt;
  const Vector6 difference = motion_residual(forth->T_a_b, back->T_a_b.inverse());
  if (difference.norm() > kNoisy) return std::nullopt;
  return CheckedMotion{forth->T_a_b, difference, deviation};
}

namespace {

/// A registration by planes and landmarks, and the direction along which landmarks decide.
struct GuidedRegistration {
  Registration registration;
  KnownWay way;
};

/// Moves `T_a_b` along `direction` to where landmarks meet, less than `farthest` (m), and registers
/// again.
std::optional<GuidedRegistration> register_along(ChainScan& a, ChainScan& b, const Pose& T_a_b,
                                                 const Eigen::Vector3d& direction,
                                                 double farthest) {
  constexpr double kDeviation = 0.04;  // m, of search_way()
  const auto guess = search_way(a.landmarks(), b.landmarks(), T_a_b, direction, farthest);
  if (!guess) return std::nullopt;
  const KnownWay way{direction, kDeviation};
  const auto found = register_near(a.planes(), b.planes(), *guess, way);
  if (!found) return std::nullopt;
  return GuidedRegistration{*found, way};
}

/// Completes a registration by planes that leaves a direction open: landmarks tell the way along
/// it, less than `farthest` (m) from what planes say. The least certain direction is not always the
/// open one: the back of a vehicle ahead is a plane, too. Empty if landmarks agree better without
/// motion along it.
std::optional<CheckedMotion> complete(ChainScan& a, ChainScan& b, const Registration& by_planes,
                                      double farthest) {
  constexpr double kUncertain = 0.08;  // m; a narrow view tells less of other directions, too
  constexpr double kNear = 1.0;        // m
  std::optional<GuidedRegistration> best;
  double least_gap = 1.0;
  for (const Eigen::Vector3d& direction : by_planes.uncertain) {
    auto found = register_along(a, b, by_planes.T_a_b, direction, farthest);
    if (!found) continue;
    // The planes that meet at the found pose determine the open direction better.
    if (const auto again = register_along(a, b, found->registration.T_a_b,
                                          found->registration.uncertain[0], kNear)) {
      found = again;
    }
    const double gap = mean_gap(a.landmarks(), b.landmarks(), found->registration.T_a_b);
    Pose standing = by_planes.T_a_b;
    standing.translation() -= direction.dot(standing.translation()) * direction;
    if (gap < least_gap && gap <= mean_gap(a.landmarks(), b.landmarks(), standing)) {
      best = found;
      least_gap = gap;
    }
  }
  if (!best) return std::nullopt;
  const Pose T_b_a = best->registration.T_a_b.inverse();
  const KnownWay way{T_b_a.linear() * best->way.direction, best->way.deviation};
  return checked(best->registration, register_near(b.planes(), a.planes(), T_b_a, way), kUncertain,
                 best->way.deviation);
}

/// Registers b to a. Empty if the motion is uncertain.
std::optional<CheckedMotion> register_both_ways(ChainScan& a, ChainScan& b,
                                                const std::vector<Pose>& guesses, double farthest) {
  constexpr double kOpen = 0.025;      // m, uncertainty of a direction that planes leave open
  constexpr double kUncertain = 0.06;  // m
  const auto found = register_scans(a.planes(), b.planes(), guesses);
  if (!found) return std::nullopt;
  if (found->is_ambiguous || found->uncertainty > kOpen) return complete(a, b, *found, farthest);
  return checked(found, register_scans(b.planes(), a.planes(), {found->T_a_b.inverse()}),
                 kUncertain, 0.0);
}

}  // namespace

namespace {

/// Scans at which chains begin: 0, 2 and 4, the others evenly spread. `scans`: at least 2.
std::vector<std::size_t> starts_of_chains(std::size_t scans) {
  constexpr std::size_t kChains = 12;
  constexpr std::size_t kAtStart = kStartScans / 2;
  std::vector<std::size_t> starts;
  if (scans - 1 <= kChains) {
    starts.resize(scans - 1);
    std::iota(starts.begin(), starts.end(), std::size_t{0});
    return starts;
  }
  for (std::size_t k = 0; k < kAtStart; ++k) starts.push_back(2 * k);
  constexpr std::size_t kLast = kChains - kAtStart;
  for (std::size_t k = 1; k <= kLast; ++k) {
    const std::size_t start = k * (scans - 2) / kLast;
    if (start > starts.back()) starts.push_back(start);
  }
  return starts;
}

}  // namespace

std::vector<RegisteredMotion> register_motions(const Recording& recording) {
  constexpr std::size_t kLongest = 16;        // scans
  constexpr std::size_t kLongEnough = 4;      // scans
  constexpr double kFar = 3.0;                // m
  constexpr double kFarthestStep = 6.0;       // m
  constexpr double kFarthestFromGuess = 1.5;  // m
  constexpr double kTurned = 0.25;            // rad
  std::vector<RegisteredMotion> motions;
  if (recording.size() < 2) return motions;
  const std::vector<std::size_t> starts = starts_of_chains(recording.size());
  ChainScans scans(recording);
  std::optional<Pose> elsewhere;
  for (std::size_t chain = 0; chain < starts.size(); ++chain) {
    scans.clear();
    const std::size_t first = starts[chain];
    const Pose given =
        recording.T_world_sensor(first).inverse() * recording.T_world_sensor(first + 1);
    std::vector<Pose> guesses = first_guesses(given, elsewhere);
    for (std::size_t step = 1; step <= kLongest && first + step < recording.size(); step *= 2) {
      const auto found = register_both_ways(scans.get(first), scans.get(first + step), guesses,
                                            step == 1 ? kFarthestStep : kFarthestFromGuess);
      const bool is_steady =
          found &&
          (step == 1 || (found->T_a_b.translation() - guesses.front().translation()).norm() <
                            kFarthestFromGuess);
      if (!is_steady) break;
      motions.push_back(
          {chain, first, first + step, found->T_a_b, found->difference, found->deviation});
      if (step == 1) elsewhere = found->T_a_b;
      const bool is_far = found->T_a_b.translation().norm() > kFar && step >= kLongEnough;
      if (is_far || rotation_angle(found->T_a_b) > kTurned) break;
      guesses = {found->T_a_b * found->T_a_b};
    }
  }
  return motions;
}

}  // namespace dynains
