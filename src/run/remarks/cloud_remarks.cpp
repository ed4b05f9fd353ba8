#include "cloud_remarks.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "dynains/errors.hpp"
#include "dynains/median.hpp"
#include "dynains/poses/diagnosis.hpp"
#include "dynains/sensor/mounting.hpp"
#include "dynains/surfaces/landmarks.hpp"
#include "dynains/threads/in_two_threads.hpp"
#include "io/points/finite_points.hpp"
#include "io/text.hpp"

namespace dynains::run {
namespace {

/// Whether nearly all coordinates of an axis in the frame `file` lie multiples of `step` (m) apart.
bool are_multiples(const RecordedScan& scan, const Pose& T_file_sensor, Eigen::Index axis,
                   double step) {
  constexpr std::size_t kMin = 100;
  constexpr double kNear = 0.1;  // of a step
  std::size_t count = 0, off_grid = 0;
  double first = 0.0;
  for (std::size_t i = 0; i < scan.size() && off_grid * 20 <= scan.size(); ++i) {
    const Eigen::Vector3d p = scan.point(i).position;
    if (!p.allFinite() || p.isZero(0.0)) continue;
    const double place = (T_file_sensor * p)[axis];
    if (count == 0) first = place;
    const double steps = (place - first) / step;
    off_grid += std::abs(steps - std::round(steps)) < kNear ? 0 : 1;
    ++count;
  }
  return count >= kMin && off_grid * 20 <= count;
}

/// Upward normals (sensor frame) under which a scan has ground below the sensor, for a sensor that
/// lies on one of its sides, 0.2 to 5 times `scale` m over the ground.
std::vector<Eigen::Vector3d> sideways_normals(const PointBuffer& scan, double scale) {
  std::vector<Eigen::Vector3d> normals;
  const auto z = Eigen::Vector3d::UnitZ();
  for (const Eigen::Vector3d& up : {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(-1, 0, 0),
                                    Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(0, -1, 0)}) {
    Eigen::Matrix3d R;  // from the sensor to a frame whose z axis is `up`
    R.row(0) = z;
    R.row(1) = up.cross(Eigen::Vector3d(z));
    R.row(2) = up;
    PointBuffer turned;
    for (std::size_t i = 0; i < scan.size(); ++i) {
      const Eigen::Vector3d p =
          R * Eigen::Vector3f(scan.x[i], scan.y[i], scan.z[i]).cast<double>() / scale;
      turned.push_back(static_cast<float>(p.x()), static_cast<float>(p.y()),
                       static_cast<float>(p.z()));
    }
    const Mounting mounting = estimate_mounting(turned);
    const bool is_upright = mounting.known && mounting.up_sensor.z() > 0.0;
    if (is_upright) normals.emplace_back(R.transpose() * mounting.up_sensor);
  }
  return normals;
}

/// The normal of all `scans` that lies nearest to `z_sensor`, the z axis of the world in the first
/// one; empty if they have none in common that is upward in the world. `scale`: see
/// sideways_normals().
std::optional<Eigen::Vector3d> common_normal(const std::vector<PointBuffer>& scans,
                                             const Eigen::Vector3d& z_sensor, double scale) {
  constexpr double kNear = 0.99;  // cosine
  std::vector<Eigen::Vector3d> common = sideways_normals(scans.front(), scale);
  for (std::size_t k = 1; k < scans.size() && !common.empty(); ++k) {
    const std::vector<Eigen::Vector3d> found = sideways_normals(scans[k], scale);
    const auto is_missing = [&](const Eigen::Vector3d& normal) {
      return std::none_of(found.begin(), found.end(),
                          [&](const Eigen::Vector3d& n) { return n.dot(normal) > kNear; });
    };
    common.erase(std::remove_if(common.begin(), common.end(), is_missing), common.end());
  }
  const auto upmost = std::max_element(
      common.begin(), common.end(),
      [&](const auto& a, const auto& b) { return a.dot(z_sensor) < b.dot(z_sensor); });
  if (upmost == common.end() || upmost->dot(z_sensor) < 0.5) return std::nullopt;
  return *upmost;
}

/// A remark if the points of a scan lie on a grid of 5 cm or more.
std::optional<std::string> remark_on_grid(const RecordedScan& scan, const Pose& T_file_sensor) {
  for (const double step : {1.0, 0.5, 0.4, 0.3, 0.25, 0.2, 0.15, 0.1, 0.05}) {
    if (!are_multiples(scan, T_file_sensor, 0, step) ||
        !are_multiples(scan, T_file_sensor, 1, step)) {
      continue;
    }
    return "points lie on a grid of " + text::fixed(step, 2) +
           " m, as after a voxel filter or a coarse conversion: record the clouds before it";
  }
  return std::nullopt;
}

/// Whether cloud `i` and the next one have points, all of them with equal bits.
bool is_repeated(const Recording& recording, std::size_t i) {
  if (recording.point_count(i) == 0 || recording.point_count(i) != recording.point_count(i + 1)) {
    return false;
  }
  const RecordedScan a = recording.read_scan(i), b = recording.read_scan(i + 1);
  return std::memcmp(a.xyzi.data(), b.xyzi.data(), a.xyzi.size() * sizeof(float)) == 0;
}

std::optional<std::string> remark_on_stripes(const Recording& recording) {
  constexpr double kMin = 0.01;  // m
  const RecordedScan scan = recording.read_scan(0);
  if (recording.frame() != PointFrame::kWorld) return remark_on_grid(scan, Pose::Identity());
  const Pose& T_world_sensor = recording.T_world_sensor(0);
  double widest = 0.0;
  double far = 0.0;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const double place = std::abs(T_world_sensor.translation()[axis]);
    if (!(place > 1.0)) continue;
    const double step = std::exp2(std::floor(std::log2(place)) - 23.0);  // of a float32
    if (step < kMin || !are_multiples(scan, T_world_sensor, axis, step)) continue;
    widest = std::max(widest, step);
    far = std::max(far, place);
  }
  if (widest == 0.0) return remark_on_grid(scan, T_world_sensor);
  return "points were stored as float32 " + text::fixed(far, 0) +
         " m from the origin of the world, and lie in stripes of " + text::fixed(widest, 2) +
         " m: store float64, or subtract an offset from points and poses before they are stored";
}

std::optional<std::string> remark_on_copies(const Recording& recording, const ScanRange& range) {
  constexpr double kMinMotion = 0.05;  // m
  if (range.size() < 3) return std::nullopt;
  for (const std::size_t first : ScanRange{range.first, range.last - 2}.sample()) {
    for (std::size_t i = first; i < first + 2; ++i) {
      const Pose T = recording.T_world_sensor(i).inverse() * recording.T_world_sensor(i + 1);
      if (T.translation().norm() > kMinMotion && is_repeated(recording, i)) {
        return "clouds " + recording.name(i) + " and " + recording.name(i + 1) +
               " are equal, though the sensor moves between them: leave copies of clouds out";
      }
    }
  }
  return std::nullopt;
}

/// A remark if the clouds of a sensor that moves are more than a turn, so that both ends show the
/// same place from two poses.
std::optional<std::string> remark_on_turns(const Recording& recording, const ScanRange& range) {
  constexpr double kMinMotion = 0.05;  // m, from scan to scan
  const double way = (recording.T_world_sensor(range.last).translation() -
                      recording.T_world_sensor(range.first).translation())
                         .norm();
  if (way < kMinMotion * static_cast<double>(range.size())) return std::nullopt;
  const double overlap = overlap_of_turns(recording, range.first, range.last);
  if (overlap == 0.0) return std::nullopt;
  return "clouds go around by " + text::fixed(360.0 * (1.0 + overlap), 0) +
         " deg, so that their ends overlap, measured a turn apart: each point needs a time "
         "(--deskew), or clouds should be single turns";
}

std::optional<std::string> remark_on_tilt(const Recording& recording, const ScanRange& range) {
  // The remover finds the ground below the mean of several sensors, not below the origin.
  if (!recording.sensors().empty()) return std::nullopt;
  std::vector<PointBuffer> scans;
  for (const std::size_t i : range.sample()) {
    scans.push_back(finite_points(recording.read_scan(i)));
    if (estimate_mounting(scans.back()).known) return std::nullopt;
  }
  const Eigen::Vector3d z_sensor = recording.T_world_sensor(range.first).linear().row(2);
  std::optional<Eigen::Vector3d> up = common_normal(scans, z_sensor, 1.0);
  if (!up) up = common_normal(scans, z_sensor, 4.0);  // as from a drone
  if (!up) return std::nullopt;                       // as in a lift
  const auto degrees = [](double radians) {
    return std::to_string(std::lround(180.0 / M_PI * radians));
  };
  const bool has_roll = std::hypot(up->y(), up->z()) > 0.05;  // else x is upright
  const double roll = has_roll ? std::atan2(up->y(), up->z()) : 0.0;
  return "the sensor seems to be tilted by " + degrees(std::acos(std::clamp(up->z(), -1.0, 1.0))) +
         " deg: pass --mounting-pitch " + degrees(std::asin(std::clamp(-up->x(), -1.0, 1.0))) +
         " --mounting-roll " + degrees(roll);
}

constexpr std::size_t kBeside = 4;  // scans on each side that are compared with each other

/// "3 scans from 000010 to 000014".
std::string text_of(const std::vector<std::size_t>& scans, std::size_t first,
                    const Recording& recording) {
  const std::string& name = recording.name(first + scans.front());
  if (scans.size() == 1) return "scan " + name;
  return std::to_string(scans.size()) + " scans from " + name + " to " +
         recording.name(first + scans.back());
}

/// Scans that do not fit as both beside, and up to 20 in which much more seems to move than in
/// both.
std::set<std::size_t> suspects(const std::vector<ScanCounts>& counts) {
  constexpr std::size_t kMaxPeaks = 20;
  constexpr double kTimesUsual = 4.0;  // changes from scan to scan
  std::set<std::size_t> scans;
  std::vector<double> changes;
  std::vector<std::pair<double, std::size_t>> peaks;
  for (std::size_t i = 1; i + 1 < counts.size(); ++i) {
    const ScanCounts &before = counts[i - 1], &scan = counts[i], &after = counts[i + 1];
    if (!scan.fits && before.fits && after.fits) scans.insert(i);
    changes.push_back(std::abs(scan.moving_share() - before.moving_share()));
    peaks.emplace_back(scan.moving_share() - std::max(before.moving_share(), after.moving_share()),
                       i);
  }
  const double least = kTimesUsual * median(std::move(changes));
  std::sort(peaks.rbegin(), peaks.rend());
  peaks.resize(std::min(kMaxPeaks, peaks.size()));
  for (const auto& [height, i] : peaks) {
    if (height > least) scans.insert(i);
  }
  return scans;
}

/// The ratio of points of each scan from `first`, at least 1, to `last` that agree with the scan
/// before under the poses; 1 if there is too little to compare.
std::vector<double> agreements(const Recording& recording, std::size_t first, std::size_t last) {
  std::vector<double> shares;
  std::optional<Landmarks> before;
  Mounting mounting;
  for (std::size_t i = first - 1; i <= last; ++i) {
    const PointBuffer points = sampled_points(recording.read_scan(i));
    if (!mounting.known) mounting = estimate_mounting(points);
    Landmarks scan(points, mounting);
    if (before) {
      const bool is_known = std::min(before->size(), scan.size()) >= kMinLandmarks;
      shares.push_back(is_known ? before->compare(scan, motion_between(recording, i - 1, i)).share
                                : 1.0);
    }
    before = std::move(scan);
  }
  return shares;
}

/// Those of the scans from `first` to `last`, neither the first nor the last of the recording, that
/// agree with neither scan beside them half as well as the scans around them usually do.
std::vector<std::size_t> misplaced_in(const Recording& recording, std::size_t first,
                                      std::size_t last) {
  const std::size_t begin = first > kBeside ? first - kBeside : 1;
  const std::size_t end = std::min(recording.size() - 1, last + kBeside);
  const std::vector<double> shares = agreements(recording, begin, end);
  std::vector<std::size_t> misplaced;
  for (std::size_t i = first; i <= last; ++i) {
    const std::size_t at = i - begin;  // with the scan before
    const std::size_t from = at + 1 > kBeside ? at + 1 - kBeside : 0;
    const std::size_t to = std::min(shares.size(), at + 1 + kBeside);
    const double usual = median(std::vector<double>(shares.begin() + std::ptrdiff_t(from),
                                                    shares.begin() + std::ptrdiff_t(to)));
    if (std::max(shares[at], shares[at + 1]) < 0.5 * usual) misplaced.push_back(i);
  }
  return misplaced;
}

/// All misplaced scans of the recording.
std::vector<std::size_t> misplaced_scans(const Recording& recording) {
  constexpr std::size_t kBlock = 64;
  if (recording.size() < 3) return {};
  const std::size_t last = recording.size() - 2;
  const auto blocks = in_two_threads((last + kBlock - 1) / kBlock, [&](std::size_t k) {
    return misplaced_in(recording, k * kBlock + 1, std::min(last, (k + 1) * kBlock));
  });
  std::vector<std::size_t> misplaced;
  for (const auto& block : blocks) misplaced.insert(misplaced.end(), block.begin(), block.end());
  return misplaced;
}

}  // namespace

std::vector<std::string> remarks_on_clouds(const Recording& recording, const ScanRange& range,
                                           bool seeks_ground) {
  std::vector<std::string> remarks;
  for (const auto& remark : {remark_on_stripes(recording), remark_on_copies(recording, range),
                             remark_on_turns(recording, range),
                             seeks_ground ? remark_on_tilt(recording, range) : std::nullopt}) {
    if (remark) remarks.push_back(*remark);
  }
  return remarks;
}

void check_ranges(const Recording& recording, const ScanRange& range, const RemoverConfig& config,
                  bool unit_is_given) {
  constexpr double kMaxReturn = 250.0;  // m, of most points of a LiDAR
  std::vector<float> ranges;            // in the x-y plane
  for (const std::size_t i : range.sample()) {
    const PointBuffer points = sampled_points(recording.read_scan(i));
    for (std::size_t k = 0; k < points.size(); ++k) {
      ranges.push_back(std::hypot(points.x[k], points.y[k]));
    }
  }
  if (ranges.empty()) return;
  const auto count_within = [&](double most) {
    return static_cast<double>(
        std::count_if(ranges.begin(), ranges.end(), [&](float one) { return one <= most; }));
  };
  const auto count = static_cast<double>(ranges.size());
  const double judged = (count_within(config.max_range) - count_within(config.min_range)) / count;
  const bool is_far = !unit_is_given && count_within(kMaxReturn) < 0.1 * count;
  if (judged >= 0.01 && !is_far) return;
  const auto number = [](double value) { return text::fixed(value, 1); };
  throw ConfigError(
      recording.folder().string() + ": " + number(100.0 * judged) +
      " % of the points can be judged, those from " + number(config.min_range) +
      " m (--min-range) to " + number(config.max_range) +
      " m (--max-range) from the sensor; half of the points are beyond " +
      number(median(std::move(ranges))) +
      " m. If coordinates are in millimetres or centimetres: --point-units mm, --point-units cm; "
      "in the frame of the world: --frame world; else --point-units m runs unless nothing can be "
      "judged");
}

std::optional<std::string> remark_on_lone_scans(const Recording& recording, const ScanRange& range,
                                                const RemoverConfig& config) {
  const auto [first, last] = range;
  if (first == last) {
    return "one scan alone is compared with no other, and nothing is removed from it";
  }
  std::size_t breaks = 0;
  for (std::size_t i = first + 1; i <= last; ++i) {
    const Eigen::Vector3d step =
        recording.T_world_sensor(i).translation() - recording.T_world_sensor(i - 1).translation();
    const double pause = recording.time(i) - recording.time(i - 1);
    breaks += config.starts_epoch(pause, step.norm()) ? 1 : 0;
  }
  if (10 * breaks <= last - first) return std::nullopt;
  return std::to_string(breaks) + " of " + std::to_string(last - first + 1) +
         " scans come so long after the one before, or so far from it, that they are not compared, "
         "and nothing is removed from scans that stand alone; are times in seconds and poses in "
         "metres? If so, see --max-gap and --max-speed";
}

std::vector<ScanCounts> count_points(const Recording& recording, const ScanRange& range) {
  std::vector<ScanCounts> counts;
  std::string first;
  for (std::size_t i = range.first; i <= range.last; ++i) {
    try {
      counts.push_back({recording.point_count(i), 0});
    } catch (const IoError& error) {
      if (first.empty()) first = error.what();
    }
  }
  const std::size_t others = range.size() - counts.size() - (first.empty() ? 0 : 1);
  if (others > 0) first += "; " + std::to_string(others) + " more scan files are broken";
  if (!first.empty()) throw IoError(first + "; --accept-missing leaves such files out");
  return counts;
}

std::vector<std::size_t> thin_scans(const std::vector<ScanCounts>& counts) {
  constexpr std::size_t kBefore = 9;  // scans that are not thin
  constexpr double kFew = 0.6;        // ratio
  std::vector<double> before;
  for (std::size_t i = 0; i < std::min(kBefore, counts.size()); ++i) {
    before.push_back(static_cast<double>(counts[i].points));
  }
  // At the beginning, the larger half of the first scans.
  std::sort(before.begin(), before.end());
  before.erase(before.begin(), before.begin() + std::ptrdiff_t(before.size() / 2));
  std::vector<std::size_t> thin;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const auto points = static_cast<double>(counts[i].points);
    std::vector<double> sorted = before;
    std::sort(sorted.begin(), sorted.end());
    const double low = sorted[sorted.size() / 4];
    const double high = sorted[sorted.size() - 1 - sorted.size() / 4];
    if (points * high < kFew * low * low) {
      thin.push_back(i);
      continue;
    }
    if (before.size() == kBefore) before.erase(before.begin());
    before.push_back(points);
  }
  return thin;
}

std::vector<std::string> remarks_on_odd_scans(const Recording& recording, std::size_t first,
                                              const std::vector<ScanCounts>& counts,
                                              bool compares_all) {
  std::vector<std::string> remarks;
  const std::vector<std::size_t> thin = thin_scans(counts);
  if (!thin.empty()) {
    remarks.push_back(text_of(thin, first, recording) +
                      ": far fewer points than the scans before, as if cut off");
  }
  std::vector<std::size_t> misplaced;
  if (compares_all) {
    misplaced = misplaced_scans(recording);
  } else {
    for (const std::size_t i : suspects(counts)) {
      if (!misplaced_in(recording, first + i, first + i).empty()) misplaced.push_back(first + i);
    }
  }
  if (!misplaced.empty()) {
    remarks.push_back(text_of(misplaced, 0, recording) +
                      ": surfaces do not lie where the pose places them among the scans beside; is "
                      "the file, or the pose, that of another scan?");
  }
  return remarks;
}

}  // namespace dynains::run
