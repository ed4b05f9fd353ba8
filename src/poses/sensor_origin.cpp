#include "dynains/poses/sensor_origin.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iomanip>
#include <limits>
#include <sstream>
#include <type_traits>
#include <utility>
#include <vector>

#include "dynains/simd/pack_geometry.hpp"
#include "dynains/simd/pack_loops.hpp"
#include "in_two_threads.hpp"
#include "io/finite_points.hpp"
#include "io/text.hpp"

namespace dynains {
namespace {

constexpr float kNearest = 1.5F;    // m; nearer points belong to the vehicle, or are noise
constexpr float kFarthest = 50.0F;  // m; farther points hardly depend on the origin
constexpr detail::PackConstant kToDegrees(static_cast<float>(180.0 / M_PI));

/// Calls `use(at, x, y, planar, range, elevation)` for packs of points `at`, seen from a candidate
/// for the origin: m, and deg.
template <class Use>
void for_rays(PointsView points, const Eigen::Vector3d& origin, Use&& use) {
  const std::array<detail::PackConstant, 3> o = {
      detail::PackConstant(static_cast<float>(origin.x())),
      detail::PackConstant(static_cast<float>(origin.y())),
      detail::PackConstant(static_cast<float>(origin.z()))};
  detail::for_packs(points.size(), [&](auto at) {
    const auto x = at.load(points.x.data()) - o[0];
    const auto y = at.load(points.y.data()) - o[1];
    const auto z = at.load(points.z.data()) - o[2];
    const auto planar = sqrt(x * x + y * y);
    const auto range = sqrt(planar * planar + z * z);
    use(at, x, y, planar, range, detail::elevation_of(z, planar, range) * kToDegrees);
  });
}

/// Tells how sharply the elevations of points gather, as those of the beams of a spinning sensor do
/// around its origin: about 1 for smooth distributions.
class BeamSharpness {
 public:
  explicit BeamSharpness(PointBuffer points)
      : points_(std::move(points)), bins_(points_.size() + detail::kMaxPackWidth) {}

  double at(const Eigen::Vector3d& origin) {
    for_rays(points_, origin, [&](auto at, auto&, auto&, auto&, const auto& range, auto elevation) {
      static constexpr detail::PackConstant kLowest(90.5F), kPerDegree(kBinsPerDegree),
          kLeast(kNearest), kMost(kFarthest);
      const auto bin = truncate((elevation + kLowest) * kPerDegree);
      const auto is_seen = (range > kLeast) & (range < kMost);
      select(is_seen, bin, std::decay_t<decltype(bin)>(std::int32_t{kUnseen}))
          .store(&bins_[at.begin]);
    });
    std::array<std::array<std::uint32_t, kBins>, 2> halves{};  // neighbours are mostly of one bin
    for (std::size_t i = 0; i < points_.size(); ++i) {
      ++halves[i % 2][static_cast<std::size_t>(bins_[i])];
    }
    std::uint64_t squares = 0;
    std::uint64_t smooth_squares = 0;  // of each count with the sum of its surroundings
    std::uint64_t around = 0;
    for (std::size_t i = 0; i < kBins; ++i) {
      counts_[kReach + i] = i == kUnseen ? 0 : halves[0][i] + halves[1][i];
    }
    for (std::size_t i = 0; i < 2 * kReach; ++i) around += counts_[i];
    for (std::size_t i = 0; i < kBins; ++i) {
      around += counts_[i + 2 * kReach];
      const std::uint64_t count = counts_[i + kReach];
      squares += count * count;
      smooth_squares += count * around;
      around -= counts_[i];
    }
    if (smooth_squares == 0) return 0.0;
    return static_cast<double>((2 * kReach + 1) * squares) / static_cast<double>(smooth_squares);
  }

 private:
  static constexpr float kBinsPerDegree = 10.0F;
  static constexpr std::size_t kBins = 1820;
  static constexpr std::size_t kUnseen = 0;  // no elevation is so low
  static constexpr std::size_t kReach = 20;  // bins on both sides

  PointBuffer points_;
  std::vector<std::int32_t> bins_;                               // of points
  std::array<std::uint32_t, kReach + kBins + kReach> counts_{};  // by bin, zeros at both ends
};

/// Ratio of points that are clearly farther than another point in their direction. Around the
/// origin of the rays, only points beside the edges of objects are.
class HiddenPoints {
 public:
  explicit HiddenPoints(std::vector<PointsView> scans) : scans_(std::move(scans)) {}

  double at(const Eigen::Vector3d& origin) {
    std::size_t hidden = 0;
    std::size_t all = 0;
    for (const PointsView& scan : scans_) {
      for (auto* const values : {&azimuth_, &elevation_, &range_}) {
        values->resize(scan.size() + detail::kMaxPackWidth);
      }
      for_rays(scan, origin, [&](auto at, auto& x, auto& y, auto& planar, auto& range, auto up) {
        (detail::azimuth_of(y, x, planar) * kToDegrees).store(&azimuth_[at.begin]);
        up.store(&elevation_[at.begin]);
        range.store(&range_[at.begin]);
      });
      nearest_.assign(kColumns * kRows, std::numeric_limits<float>::max());
      seen_.clear();
      for (std::size_t i = 0; i < scan.size(); ++i) {
        if (!(range_[i] > kNearest && range_[i] < kFarthest)) continue;
        seen_.emplace_back(cell(i), range_[i]);
        float& nearest = nearest_[seen_.back().first];
        nearest = std::min(nearest, range_[i]);
      }
      all += seen_.size();
      for (const auto& [at, range] : seen_) {
        if (range > 1.25F * nearest_[at] + 0.5F) ++hidden;
      }
    }
    return all == 0 ? 0.0 : static_cast<double>(hidden) / static_cast<double>(all);
  }

  /// Whether every horizontal displacement moves rays sideways: along a ray, it changes nothing
  /// that the ray hides. In an even view, whether that is wider than 109 deg.
  bool shows_place() const {
    constexpr double kMostAligned = 0.5;
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();  // of axes, as directions of the double azimuth
    std::size_t all = 0;
    for (const PointsView& scan : scans_) {
      for (std::size_t i = 0; i < scan.size(); ++i) {
        const double x = scan.x[i], y = scan.y[i], squared = x * x + y * y;
        if (!(squared > 0.0)) continue;
        sum += Eigen::Vector2d(x * x - y * y, 2.0 * x * y) / squared;
        ++all;
      }
    }
    return sum.norm() < kMostAligned * static_cast<double>(all);
  }

 private:
  static constexpr float kCell = 0.8F;  // deg
  static constexpr std::size_t kColumns = 452;
  static constexpr std::size_t kRows = 227;

  std::size_t cell(std::size_t i) const {
    const auto column = static_cast<std::size_t>((azimuth_[i] + 180.5F) / kCell);
    const auto row = static_cast<std::size_t>((elevation_[i] + 90.5F) / kCell);
    return std::min(column, kColumns - 1) * kRows + std::min(row, kRows - 1);
  }

  std::vector<PointsView> scans_;
  std::vector<float> azimuth_, elevation_, range_;   // deg, deg, m
  std::vector<float> nearest_;                       // m, by cell
  std::vector<std::pair<std::size_t, float>> seen_;  // cells of points, and their ranges, m
};

/// About `count` points of all scans.
PointBuffer sample_of(const std::vector<PointBuffer>& scans, std::size_t count) {
  std::size_t all = 0;
  for (const PointBuffer& scan : scans) all += scan.size();
  const std::size_t step = std::max<std::size_t>(1, all / count) | 1U;
  PointBuffer sample;
  for (const PointBuffer& scan : scans) {
    for (std::size_t i = 0; i < scan.size(); i += step) {
      sample.push_back(scan.x[i], scan.y[i], scan.z[i]);
    }
  }
  return sample;
}

struct Candidate {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  double value = 0.0;
};

// Positions that sensors have on usual vehicles, m.
const Eigen::Vector3d kLowest(-4.0, -1.0, -2.0);
const Eigen::Vector3d kHighest(4.0, 1.0, 3.0);

/// The positions of a grid that stand out most among those of their height, best first, at least
/// 0.6 m apart. Seen from near the ground, all elevations are alike, wherever the rays begin.
std::vector<Candidate> best_on_grid(const BeamSharpness& sharpness) {
  constexpr double kStep = 0.25;  // m
  constexpr std::size_t kKept = 6;
  const double height = kHighest.z() - kLowest.z();
  const auto layers =
      in_two_threads(static_cast<std::size_t>(height / kStep) + 1, [&](std::size_t layer) {
        BeamSharpness own = sharpness;
        std::vector<Candidate> candidates;
        const double z = kLowest.z() + kStep * static_cast<double>(layer);
        double sum = 0.0;
        for (double x = kLowest.x(); x <= kHighest.x(); x += kStep) {
          for (double y = kLowest.y(); y <= kHighest.y(); y += kStep) {
            const Eigen::Vector3d position(x, y, z);
            candidates.push_back({position, own.at(position)});
            sum += candidates.back().value;
          }
        }
        const double mean = sum / static_cast<double>(candidates.size());
        for (Candidate& candidate : candidates) candidate.value /= std::max(mean, 1e-9);
        return candidates;
      });
  std::vector<Candidate> all;
  for (const auto& layer : layers) all.insert(all.end(), layer.begin(), layer.end());
  std::stable_sort(all.begin(), all.end(),
                   [](const Candidate& a, const Candidate& b) { return a.value > b.value; });
  std::vector<Candidate> kept;
  for (const Candidate& candidate : all) {
    const bool is_apart = std::all_of(kept.begin(), kept.end(), [&](const Candidate& other) {
      return (candidate.position - other.position).norm() > 0.6;
    });
    if (is_apart) kept.push_back(candidate);
    if (kept.size() == kKept) break;
  }
  return kept;
}

/// The largest value at `distance` (m) from `centre` along each axis.
double largest_around(BeamSharpness& sharpness, const Eigen::Vector3d& centre, double distance) {
  double largest = 0.0;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    for (const double sign : {-1.0, 1.0}) {
      largest =
          std::max(largest, sharpness.at(centre + sign * distance * Eigen::Vector3d::Unit(axis)));
    }
  }
  return largest;
}

/// Climbs from `start` in ever smaller steps along the first `axes` axes while `gain(value, best)`.
template <class Measure, class Gain>
Candidate climbed(Measure& measure, const Candidate& start, const std::vector<double>& steps,
                  Eigen::Index axes, Gain&& gain) {
  Candidate best = start;
  best.value = measure.at(best.position);
  for (const double step : steps) {
    for (bool is_better = true; is_better;) {
      is_better = false;
      for (Eigen::Index axis = 0; axis < axes; ++axis) {
        for (const double sign : {-1.0, 1.0}) {
          Eigen::Vector3d position = best.position;
          position[axis] += sign * step;
          if ((position - kLowest).minCoeff() < -0.25 || (kHighest - position).minCoeff() < -0.25) {
            continue;
          }
          const double value = measure.at(position);
          if (!gain(value, best.value)) continue;
          best = {position, value};
          is_better = true;
        }
      }
    }
  }
  return best;
}

constexpr double kLeastOffset = 0.4;  // m; beams of one sensor begin at places that differ less

/// Estimate of the origin by the elevations of beams.
enum class BeamFinding { kAsGiven, kElsewhere, kPerhapsElsewhere, kNothing };

BeamFinding origin_of_beams(const std::vector<PointBuffer>& scans, Eigen::Vector3d& position) {
  constexpr double kSharper = 1.3;      // up to 1.33 in de-skewed clouds of fast drives
  constexpr double kMuchSharper = 2.0;  // origins that were moved gave 3 and more
  BeamSharpness fine(sample_of(scans, 32000));
  const Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  const double given = std::max(fine.at(origin), largest_around(fine, origin, 0.1));
  if (given > 1.5 * largest_around(fine, origin, 0.5)) return BeamFinding::kAsGiven;
  const std::vector<Candidate> starts = best_on_grid(BeamSharpness(sample_of(scans, 4000)));
  const auto tops = in_two_threads(starts.size(), [&](std::size_t i) {
    BeamSharpness own = fine;
    return climbed(own, starts[i], {0.1, 0.05, 0.02}, 3,
                   [](double value, double best) { return value > best; });
  });
  Candidate found;
  for (const Candidate& top : tops) {
    if (top.value > found.value) found = top;
  }
  // On open ground, rings are rings seen from any height: then the maximum is not sharp.
  const double others = std::max(given, largest_around(fine, found.position, 0.5));
  if (found.position.norm() < kLeastOffset || !(found.value > kSharper * others)) {
    return BeamFinding::kNothing;
  }
  position = found.position;
  return found.value > kMuchSharper * others ? BeamFinding::kElsewhere
                                             : BeamFinding::kPerhapsElsewhere;
}

/// Whether clearly fewer points are hidden from elsewhere than from the origin as given.
bool are_fewer_hidden(double elsewhere, double as_given) {
  constexpr double kFewer = 0.6;
  constexpr double kLeast = 0.01;
  return as_given - elsewhere > kLeast && elsewhere < kFewer * as_given;
}

/// A horizontal position from which fewer points are hidden.
Candidate least_hidden(HiddenPoints& hidden) {
  return climbed(hidden, {}, {1.0, 0.5, 0.25, 0.1}, 2,
                 [](double value, double best) { return value < 0.99 * best; });
}

/// By points that are hidden by nearer ones. Seen from above, few are, so that this shows x and y
/// at most. All scans are looked at if a middle one speaks for another place.
std::optional<RayOrigin> origin_of_shadows(const std::vector<PointBuffer>& scans,
                                           HiddenPoints& hidden, double as_given) {
  constexpr double kTooMany = 0.18;  // scans of one sensor had up to 0.14
  constexpr double kSpeaks = 0.8;    // ratio
  HiddenPoints of_one({scans[scans.size() / 2]});
  const double of_one_as_given = of_one.at(Eigen::Vector3d::Zero());
  if (least_hidden(of_one).value < kSpeaks * of_one_as_given && hidden.shows_place()) {
    const Candidate found = least_hidden(hidden);
    const bool is_there =
        found.position.norm() > kLeastOffset && are_fewer_hidden(found.value, as_given);
    if (is_there) {
      return RayOrigin{RayOrigin::Known::kHorizontal, found.position, as_given, found.value};
    }
  }
  if (as_given < kTooMany) return std::nullopt;
  return RayOrigin{RayOrigin::Known::kNothing, Eigen::Vector3d::Zero(), as_given, as_given};
}

/// Between the sensor at scans i and k, m.
double distance(const Recording& recording, std::size_t i, std::size_t k) {
  return (recording.T_world_sensor(k).translation() - recording.T_world_sensor(i).translation())
      .norm();
}

}  // namespace

std::optional<RayOrigin> find_ray_origin(const std::vector<PointBuffer>& scans) {
  constexpr std::size_t kFewestPoints = 4000;
  std::size_t points = 0;
  for (const PointBuffer& scan : scans) points += scan.size();
  if (points < kFewestPoints) return std::nullopt;
  RayOrigin result;
  const BeamFinding by_beams = origin_of_beams(scans, result.position);
  if (by_beams == BeamFinding::kAsGiven) return std::nullopt;
  HiddenPoints hidden({scans.begin(), scans.end()});
  result.hidden_as_given = hidden.at(Eigen::Vector3d::Zero());
  if (by_beams != BeamFinding::kNothing) {
    constexpr double kFewer = 0.9;
    result.hidden = hidden.at(result.position);
    result.known = RayOrigin::Known::kPosition;
    const bool is_there = by_beams == BeamFinding::kElsewhere
                              ? result.hidden < kFewer * result.hidden_as_given
                              : are_fewer_hidden(result.hidden, result.hidden_as_given);
    if (is_there) return result;
  }
  return origin_of_shadows(scans, hidden, result.hidden_as_given);
}

std::optional<RayOrigin> find_ray_origin(const Recording& recording, std::size_t first,
                                         std::size_t last) {
  constexpr std::size_t kScans = 4;
  constexpr double kOfStep = 0.75;
  const std::size_t count = std::min(kScans, last - first + 1);
  std::vector<PointBuffer> scans;
  RecordedScan scan;
  double step = 0.0;  // m, longest way during a scan
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i = first + (count == 1 ? 0 : k * (last - first) / (count - 1));
    recording.read_scan(i, scan);
    scans.push_back(finite_points(scan));
    const std::size_t neighbour = i < last ? i + 1 : std::max(first + 1, i) - 1;
    step = std::max(step, distance(recording, i, neighbour));
  }
  std::optional<RayOrigin> origin = find_ray_origin(scans);
  // If the motion during a scan was compensated, rays begin along a step, with its middle half a
  // step from the origin. Only beams that meet in one point contradict that.
  const bool may_be_compensated = origin && origin->known == RayOrigin::Known::kHorizontal &&
                                  origin->position.norm() < kOfStep * step;
  if (may_be_compensated) return std::nullopt;
  if (origin) origin->position += recording.sensor_origin();
  return origin;
}

std::string option_for(const RayOrigin& origin) {
  if (origin.known == RayOrigin::Known::kNothing) return {};
  std::ostringstream text;
  text::exact(text);
  text << std::fixed << std::setprecision(2) << "--sensor-origin \"";
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const double value = origin.position[axis];
    text << (axis > 0 ? " " : "") << (std::abs(value) < 0.005 ? 0.0 : value);
  }
  text << '"';
  return text.str();
}

std::string advice(const RayOrigin& origin) {
  std::ostringstream text;
  text::exact(text);
  text << std::fixed << std::setprecision(1)
       << "The rays do not begin at the origin of the clouds, as if these were moved into a body "
          "frame: seen from there, "
       << 100.0 * origin.hidden_as_given << " % of the points lie behind nearer ones";
  switch (origin.known) {
    case RayOrigin::Known::kNothing:
      text << ". Pass the position of the sensor in the clouds, --sensor-origin \"X Y Z\".";
      break;
    case RayOrigin::Known::kHorizontal:
      text << "; seen from the best place, " << 100.0 * origin.hidden << " %: pass "
           << option_for(origin) << ", with the height of the sensor in place of 0.";
      break;
    case RayOrigin::Known::kPosition:
      text << "; seen from the place where all beams meet, " << 100.0 * origin.hidden << " %: pass "
           << option_for(origin) << '.';
      break;
  }
  return text.str();
}

}  // namespace dynains
