#include "pose_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "dynains/median.hpp"
#include "dynains/poses/diagnosis.hpp"
#include "dynains/surfaces/landmarks.hpp"
#include "dynains/surfaces/way_search.hpp"
#include "dynains/threads/in_two_threads.hpp"
#include "io/points/finite_points.hpp"

namespace dynains {
namespace {

/// A scan, as planes and as landmarks.
struct ChainScan : RegistrationScan {
  ChainScan(const Recording& recording, std::size_t i)
      : ChainScan(sampled_points(recording.read_scan(i))) {}
  explicit ChainScan(const PointBuffer& points)
      : RegistrationScan(points), landmarks(points, estimate_mounting(points), kWayRange) {}

  Landmarks landmarks;
};

constexpr double kMaxFromGuess = 1.5;  // m
constexpr double kOpen = 0.025;        // m, uncertainty of a direction that planes leave open

/// Guesses of the motion to the next scan: as given, none, the given distance in each direction,
/// less than `farthest` (m), and the motion at another place.
std::vector<Pose> first_guesses(const Pose& given, const std::optional<Pose>& elsewhere,
                                double farthest) {
  std::vector<Pose> guesses = {Pose::Identity()};
  const double way = given.translation().norm();
  if (way < farthest) {
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

bool is_certain(const std::optional<Registration>& registration) {
  constexpr double kUncertain = 0.08;  // m
  return registration && registration->score > kMinScore &&
         registration->uncertainty < kUncertain && !registration->is_ambiguous;
}

bool is_exact(const Pose& T, const Pose& given) { return extent_of(given.inverse() * T) < kExact; }

/// Residual of a motion: translation, and rotation times kLever, m.
Vector6 residual(const Pose& body, const Pose& sensor, const Pose& T_body_sensor) {
  const Pose E = (body * T_body_sensor).inverse() * T_body_sensor * sensor;
  const Eigen::AngleAxisd rotation(detail::Quaternion(E.linear()));
  Vector6 r;
  r << E.translation(), kLever * rotation.angle() * rotation.axis();
  return r;
}

/// A motion by two registrations, forth and back.
std::optional<RegisteredMotion> checked(const std::optional<Registration>& forth,
                                        const std::optional<Registration>& back, double deviation) {
  constexpr double kNoisy = 0.25;  // m, 10 m from the sensor
  if (!is_certain(forth) || !is_certain(back)) return std::nullopt;
  const Vector6 difference = residual(forth->T_a_b, back->T_a_b.inverse(), Pose::Identity());
  if (difference.norm() > kNoisy) return std::nullopt;
  return RegisteredMotion{forth->T_a_b, difference, deviation};
}

/// Completes a registration by planes that leaves a direction open: landmarks determine the motion
/// along it, less than `farthest` (m) from the registration. The least certain direction is not
/// always the open one: the back of a vehicle ahead is a plane, too. Empty if landmarks agree
/// better without motion along it, or with the distant motion `given`: they can meet by oncoming
/// traffic.
std::optional<RegisteredMotion> complete(const ChainScan& a, const ChainScan& b,
                                         const Registration& by_planes, const Pose& given,
                                         double farthest) {
  std::optional<Registration> best;
  double min_gap = 1.0;
  for (const Eigen::Vector3d& direction : by_planes.uncertain) {
    const auto along = [&](const Pose& T, const Eigen::Vector3d& open, double most) {
      return register_along(a.surfaces(), b.points(), a.landmarks, b.landmarks, T, open, most);
    };
    auto found = along(given, direction, kMaxFromGuess);
    const bool fits = found && is_exact(found->T_a_b, given);
    if (!fits) {
      found = along(by_planes.T_a_b, direction, farthest);
      if (!found) continue;
      // The planes that meet at the found pose determine the open direction better.
      if (const auto again = along(found->T_a_b, found->uncertain[0], kMaxFromGuess)) {
        found = again;
      }
    }
    const double gap = mean_gap(a.landmarks, b.landmarks, found->T_a_b);
    Pose standing = by_planes.T_a_b;
    standing.translation() -= direction.dot(standing.translation()) * direction;
    if (gap < min_gap && gap <= mean_gap(a.landmarks, b.landmarks, standing)) {
      best = found;
      min_gap = gap;
      if (fits) break;
    }
  }
  if (!best) return std::nullopt;
  const Pose& found = best->T_a_b;
  const bool is_distant = (found.translation() - given.translation()).norm() > kDistinct;
  if (is_distant && mean_gap(a.landmarks, b.landmarks, given) < min_gap) return std::nullopt;
  const Pose T_b_a = best->T_a_b.inverse();
  const Eigen::Vector3d direction = T_b_a.linear() * best->way->direction;
  const KnownTranslation way{direction, direction.dot(T_b_a.translation()), best->way->deviation};
  return checked(best, register_near(b.surfaces(), a.points(), T_b_a, way), best->way->deviation);
}

/// Whether two motions are distant, and differ along `direction` alone.
bool differ_along(const Eigen::Vector3d& direction, const Pose& T, const Pose& other) {
  constexpr double kAside = 0.1;  // ratio
  const Eigen::Vector3d way = T.translation() - other.translation();
  return way.norm() > kDistinct && direction.cross(way).norm() < kAside * way.norm();
}

/// Registers b to a. Empty if the motion is uncertain, or if landmarks meet better under the
/// `given` one: planes also meet that move with the sensor, as traffic, rails and the rings of
/// beams do.
std::optional<RegisteredMotion> register_both_ways(const ChainScan& a, const ChainScan& b,
                                                   const Pose& given,
                                                   const std::vector<Pose>& guesses,
                                                   double farthest) {
  constexpr double kWorse = 1.02;  // ratio of gaps
  // Poses that are exact need no other guesses, unless they stand, as those of another recording.
  auto forth = register_near(a.surfaces(), b.points(), given);
  if (!is_certain(forth) || !is_exact(forth->T_a_b, given) || extent_of(given) < kAgreeing) {
    forth = register_scans(a.surfaces(), b.points(), guesses);
  }
  if (!forth) return std::nullopt;
  const bool is_open = forth->is_ambiguous || forth->uncertainty > kOpen;
  auto found = is_open ? complete(a, b, *forth, given, farthest) : std::nullopt;
  // Samples of smooth walls keep their place beside the sensor: an open direction that landmarks do
  // not determine says nothing about another motion along it.
  if (!found && !(is_open && differ_along(forth->uncertain[0], forth->T_a_b, given))) {
    found = checked(forth, register_near(b.surfaces(), a.points(), forth->T_a_b.inverse()), 0.0);
  }
  const auto gap_under = [&](const Pose& T) { return a.landmarks.compare(b.landmarks, T).gap; };
  return found && gap_under(found->T_first_second) < kWorse * gap_under(given) ? found
                                                                               : std::nullopt;
}

struct BothMotions {
  Pose body;
  Pose sensor;
};

double robust_cost(const std::vector<BothMotions>& motions, const Pose& T_body_sensor) {
  double cost = 0.0;
  for (const BothMotions& m : motions)
    cost += std::log1p(residual(m.body, m.sensor, T_body_sensor).squaredNorm() / 0.01);
  return cost;
}

/// Gauss-Newton with Cauchy weights and a weak prior that the lever arm is 0.
Pose refine(const std::vector<BothMotions>& motions, Pose T_body_sensor) {
  constexpr double kScale = 0.1;   // m, of a residual
  constexpr double kPrior = 0.02;  // m per m of the lever arm
  constexpr double kStep = 1e-6;
  for (int k = 0; k < 25; ++k) {
    detail::NormalEquations<6> equations;
    for (std::size_t i = 0; i < 3; ++i) {
      equations.attract(i, -T_body_sensor(static_cast<int>(i), 3), kPrior * kPrior);
      equations.attract(3 + i, 0.0, kPrior * kPrior);
    }
    for (const BothMotions& m : motions) {
      const Vector6 r = residual(m.body, m.sensor, T_body_sensor);
      Matrix6 J;
      for (std::size_t j = 0; j < 6; ++j) {
        detail::PoseStep step = {};
        step[j] = kStep;
        J.col(static_cast<Eigen::Index>(j)) =
            (residual(m.body, m.sensor, detail::moved(T_body_sensor, step)) - r) / kStep;
      }
      const double weight = 1.0 / (1.0 + r.squaredNorm() / (kScale * kScale));
      for (Eigen::Index i = 0; i < 6; ++i) {
        equations.add({J(i, 0), J(i, 1), J(i, 2), J(i, 3), J(i, 4), J(i, 5)}, r[i], weight);
      }
    }
    const detail::PoseStep step = equations.solve();
    const Pose T_next = orthonormalized(detail::moved(T_body_sensor, step));
    if (!T_next.matrix().allFinite()) break;
    const double change = extent_of(T_body_sensor.inverse() * T_next);
    T_body_sensor = T_next;
    if (change < 1e-7) break;
  }
  return T_body_sensor;
}

/// The 24 rotations that map axes to axes.
std::vector<Eigen::Matrix3d> axis_rotations() {
  std::vector<Eigen::Matrix3d> rotations;
  for (int x = 0; x < 3; ++x) {
    for (int y = 0; y < 3; ++y) {
      if (x == y) continue;
      for (const double x_sign : {1.0, -1.0}) {
        for (const double y_sign : {1.0, -1.0}) {
          Eigen::Matrix3d R;
          R.col(0) = x_sign * Eigen::Vector3d::Unit(x);
          R.col(1) = y_sign * Eigen::Vector3d::Unit(y);
          R.col(2) = R.col(0).cross(R.col(1));
          rotations.push_back(R);
        }
      }
    }
  }
  std::stable_sort(rotations.begin(), rotations.end(),
                   [](const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
                     return angle_of(a) < angle_of(b) - 1e-6;
                   });
  return rotations;
}

/// Scans at which chains begin, evenly spread. If the sensor is at rest for most of the time, they
/// begin where the poses move for three steps or more, since one step alone may be a jump. The
/// recording has two scans or more.
std::vector<std::size_t> starts_of_chains(const Recording& recording) {
  constexpr std::size_t kChains = 12, kApart = 4;
  const std::size_t all = recording.size() - 1;
  std::vector<std::size_t> moving;
  std::size_t steps = 0;  // that move, up to here
  for (std::size_t i = 0; i < all; ++i) {
    steps = extent_of(motion_between(recording, i, i + 1)) > kExact ? steps + 1 : 0;
    if (steps == 3) moving.insert(moving.end(), {i - 2, i - 1});
    if (steps >= 3) moving.push_back(i);
  }
  const bool stands = 2 * moving.size() < all && moving.size() >= kMinMotions;
  const std::size_t places = stands ? moving.size() : all;
  std::vector<std::size_t> starts;
  const std::size_t count = std::min(kChains, places);
  for (std::size_t offset = 0; offset < kApart; ++offset) {
    for (std::size_t k = offset; k < count; k += kApart) {
      const std::size_t place = count == 1 ? 0 : k * (places - 1) / (count - 1);
      starts.push_back(stands ? moving[place] : place);
    }
  }
  return starts;
}

/// Motions from scan `first` to others behind it, ever farther apart. `elsewhere`: a motion from
/// one scan to the next at another place.
std::vector<RegisteredMotion> chain_at(const Recording& recording, std::size_t number,
                                       std::size_t first, const std::optional<Pose>& elsewhere) {
  constexpr double kFar = 3.0;  // m, at points kLever away
  const ChainScan a(recording, first);
  std::vector<RegisteredMotion> motions;
  const auto add = [&](std::size_t second, const std::vector<Pose>& guesses, double farthest) {
    auto found = register_both_ways(a, ChainScan(recording, second),
                                    motion_between(recording, first, second), guesses, farthest);
    if (!found) return false;
    found->first = first;
    found->second = second;
    found->chain = number;
    motions.push_back(*found);
    return true;
  };
  const double farthest = longest_way(recording.time(first + 1) - recording.time(first));
  add(first + 1, first_guesses(motion_between(recording, first, first + 1), elsewhere, farthest),
      farthest);
  for (std::size_t step = 3; step <= kMaxSpan && !motions.empty(); step *= 3) {
    const Pose T = motions.back().T_first_second;
    if (extent_of(T) > kFar || first + step >= recording.size()) break;
    const Pose guess = T * T * T;
    if (!add(first + step, {guess}, kMaxFromGuess)) break;
    const Pose& found = motions.back().T_first_second;
    if ((found.translation() - guess.translation()).norm() < kMaxFromGuess) continue;
    motions.pop_back();
    break;
  }
  return motions;
}

/// Weights of the axes of residuals, at most 1, from the differences of both registrations.
Vector6 weights_of_axes(const std::vector<RegisteredMotion>& motions) {
  constexpr double kGood = 0.02;  // m
  Vector6 weights;
  for (Eigen::Index axis = 0; axis < 6; ++axis) {
    std::vector<double> differences;
    differences.reserve(motions.size());
    for (const RegisteredMotion& m : motions) differences.push_back(std::abs(m.difference[axis]));
    weights[axis] = kGood / std::max(kGood, median(std::move(differences)));
  }
  return weights;
}

}  // namespace

std::vector<RegisteredMotion> register_motions(
    const Recording& recording,
    const std::function<bool(const std::vector<RegisteredMotion>&)>& suffice) {
  std::vector<RegisteredMotion> motions;
  if (recording.size() < 2) return motions;
  const std::vector<std::size_t> starts = starts_of_chains(recording);
  std::optional<Pose> elsewhere;
  for (std::size_t number = 0; number < starts.size(); number += 3) {
    const auto chains =
        in_two_threads(std::min<std::size_t>(3, starts.size() - number), [&](std::size_t k) {
          return chain_at(recording, number + k, starts[number + k], elsewhere);
        });
    for (const std::vector<RegisteredMotion>& chain : chains) {
      motions.insert(motions.end(), chain.begin(), chain.end());
      if (!chain.empty()) elsewhere = chain.front().T_first_second;
    }
    if (suffice(motions) || (motions.empty() && number > 0)) break;
  }
  return motions;
}

std::vector<RegisteredMotion> by_other_ways(const Recording& recording,
                                            const std::vector<RegisteredMotion>& motions,
                                            std::size_t gap) {
  const auto other_way = [&](std::size_t i) -> std::optional<RegisteredMotion> {
    RegisteredMotion motion = motions[i];
    const std::size_t between = motion.first + (gap == 1 ? 2 : gap / 3);
    if (motion.second != motion.first + gap || between >= recording.size()) return std::nullopt;
    const ChainScan via(recording, between);
    const auto motion_to = [&](std::size_t scan) {
      const double ratio = (double(scan) - double(between)) / double(gap);
      const Pose guess = detail::scaled_motion(motion.T_first_second, ratio);
      return register_both_ways(via, ChainScan(recording, scan),
                                motion_between(recording, between, scan), {guess}, kMaxFromGuess);
    };
    const auto first = motion_to(motion.first), second = motion_to(motion.second);
    if (!first || !second) return std::nullopt;
    const Pose T_other = first->T_first_second.inverse() * second->T_first_second;
    motion.difference = residual(motion.T_first_second, T_other, Pose::Identity());
    motion.T_first_second = T_other;
    return motion;
  };
  std::vector<RegisteredMotion> others;
  for (const auto& one : in_two_threads(motions.size(), other_way)) {
    if (one) others.push_back(*one);
  }
  return others;
}

bool are_poses_exact(const Recording& recording) {
  constexpr std::size_t kPlaces = 3, kDense = 20000;  // points; of more, a third is enough
  constexpr double kTelling = 2.0;                    // m, at points kLever away
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  std::size_t first = 0;
  for (std::size_t i = 0; i < recording.size(); ++i) {
    if (extent_of(motion_between(recording, first, i)) < kTelling) continue;
    pairs.emplace_back(first, i);
    first = i;
  }
  const std::size_t places = std::min(kPlaces, pairs.size());
  const auto is_confirmed = [&](std::size_t place) {
    const auto [from, to] =
        pairs[place * (pairs.size() - 1) / std::max<std::size_t>(1, places - 1)];
    const auto read = [&](std::size_t i) {
      const RecordedScan scan = recording.read_scan(i);
      return RegistrationScan(finite_points(scan, scan.size() < kDense ? 1 : 3));
    };
    const RegistrationScan a = read(from), b = read(to);
    const auto meets = [](const RegistrationScan& one, const RegistrationScan& other,
                          const Pose& given) {
      const auto found = register_near(one.surfaces(), other.points(), given);
      return is_certain(found) && is_exact(found->T_a_b, given);
    };
    const Pose given = motion_between(recording, from, to);
    return meets(a, b, given) && meets(b, a, given.inverse());
  };
  const std::vector<bool> confirmed = in_two_threads(places, is_confirmed);
  return places > 0 && std::find(confirmed.begin(), confirmed.end(), false) == confirmed.end();
}

MotionError motion_error(const std::vector<RegisteredMotion>& motions, const BodyMotion& body,
                         const Pose& T_body_sensor, std::size_t gap) {
  std::array<std::vector<double>, 6> columns;  // in the order of MotionError
  const Vector6 weights = weights_of_axes(motions);
  for (const RegisteredMotion& motion : motions) {
    if (gap > 0 && motion.second != motion.first + gap) continue;
    const auto T_body = body(motion.first, motion.second);
    if (!T_body) continue;
    const Vector6 r = residual(*T_body, motion.T_first_second, T_body_sensor);
    const Vector6& d = motion.difference;
    const double row[] = {r.head<3>().norm(),
                          r.tail<3>().norm() / kLever,
                          std::hypot(d.head<3>().norm(), motion.deviation),
                          d.tail<3>().norm() / kLever,
                          r.cwiseProduct(weights).norm(),
                          std::hypot(d.cwiseProduct(weights).norm(), motion.deviation)};
    for (std::size_t k = 0; k < columns.size(); ++k) columns[k].push_back(row[k]);
  }
  const auto middle = [&](std::size_t k) { return median(columns[k]); };
  return {middle(0), middle(1), middle(2), middle(3), middle(4), middle(5), columns[0].size()};
}

double error_at_points(const std::vector<RegisteredMotion>& motions, const BodyMotion& body) {
  return motion_error(motions, body).at_points;
}

BodyMotion with_drift(const BodyMotion& body, const std::vector<RegisteredMotion>& motions) {
  std::array<std::vector<double>, 3> turns;  // from scan to scan, rad times kLever
  for (const RegisteredMotion& motion : motions) {
    const auto T = body(motion.first, motion.second);
    if (!T) continue;
    const Vector6 r = residual(*T, motion.T_first_second, Pose::Identity());
    const auto scans = static_cast<double>(motion.second - motion.first);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      turns[axis].push_back(r[static_cast<Eigen::Index>(3 + axis)] / scans);
    }
  }
  detail::PoseStep drift = {};
  for (std::size_t axis = 0; axis < 3; ++axis) drift[3 + axis] = median(turns[axis]) / kLever;
  const Pose T_drift = detail::moved(Pose::Identity(), drift);
  return [=](std::size_t first, std::size_t second) {
    auto T = body(first, second);
    if (T) *T = *T * detail::scaled_motion(T_drift, static_cast<double>(second - first));
    return T;
  };
}

std::optional<Pose> fit_extrinsic(const std::vector<RegisteredMotion>& registered,
                                  const BodyMotion& body) {
  constexpr std::size_t kMin = 4;
  std::vector<BothMotions> motions;
  for (const RegisteredMotion& motion : registered) {
    const auto T_body = body(motion.first, motion.second);
    if (T_body) motions.push_back({*T_body, motion.T_first_second});
  }
  if (motions.size() < kMin) return std::nullopt;
  std::optional<Pose> best;
  double least = 0.0;
  for (const Eigen::Matrix3d& R : axis_rotations()) {
    Pose T_body_sensor = Pose::Identity();
    T_body_sensor.linear() = R;
    T_body_sensor = refine(motions, T_body_sensor);
    const double cost = robust_cost(motions, T_body_sensor);
    // The rotations are sorted by their angle: the first of equal results stays.
    if (best && !(cost < kAlmost * least)) continue;
    best = T_body_sensor;
    least = cost;
  }
  return best;
}

}  // namespace dynains
