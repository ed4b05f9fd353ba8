#include "start_check.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cloud_remarks.hpp"
#include "dynains/errors.hpp"
#include "dynains/median.hpp"
#include "dynains/poses/ray_origin.hpp"
#include "io/points/finite_points.hpp"
#include "io/text.hpp"
#include "pose_advice.hpp"

namespace dynains::run {
namespace {

/// Judges the poses as `dynains check` does, unless a few places confirm them.
void check_poses(const Recording& recording, StartCheck& result) {
  const bool is_usual =
      recording.frame() == PointFrame::kSensor && recording.sensor_origin().isZero(0.0);
  if (is_usual && are_poses_exact(recording) && !other_ray_origin(recording)) return;
  Diagnosis d = diagnose(recording, /*pairs=*/3);
  if (d.verdict == PoseVerdict::kUnknown) d = diagnose(recording);  // the places may be empty
  if (d.verdict == PoseVerdict::kAgree || d.verdict == PoseVerdict::kNoMotion) return;
  const bool may_run = d.sound() || d.verdict == PoseVerdict::kUnknown;
  (may_run ? result.warnings.emplace_back() : result.refusal) = advice(recording, d);
}

}  // namespace

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

StartCheck check_start(const Recording& recording, const ScanRange& range,
                       const RemoverConfig& config, bool accepts_poses) {
  constexpr std::size_t kMinScans = 8;
  StartCheck result;
  const bool are_judged = !accepts_poses && !recording.options().without_poses;
  if (are_judged && range.size() >= kMinScans) check_poses(recording, result);
  if (!result.refusal.empty()) return result;
  const auto warn_if = [&](const std::optional<std::string>& remark) {
    if (remark) result.warnings.push_back(*remark);
  };
  warn_if(remark_on_lone_scans(recording, range, config));
  for (const std::string& text : remarks_on_clouds(recording, range)) warn_if(text);
  if (config.level && config.mounting_pitch == 0.0 && config.mounting_roll == 0.0) {
    warn_if(remark_on_tilt(recording, range));
  }
  return result;
}

}  // namespace dynains::run
