#include "run_view.hpp"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "dynains/errors.hpp"
#include "dynains/io/kitti.hpp"
#include "dynains/io/point_bytes.hpp"
#include "thinning.hpp"

namespace dynains::viewer {
namespace {

namespace fs = std::filesystem;

constexpr double kSmallestCell = 0.05;  // m
// Classes in label files of a run.
constexpr std::uint32_t kStatic = 9;
constexpr std::uint32_t kMoving = 251;

/// All files of one scan.
struct Scan {
  RecordedScan points;
  std::vector<std::uint32_t> labels;
  std::vector<std::uint8_t> causes;   // empty: none
  std::vector<std::uint8_t> beliefs;  // empty: none
  std::vector<std::uint32_t> truth;   // empty: none
};

class Collector {
 public:
  Collector(const Recording& recording, const RunFiles& files, std::size_t max_points)
      : recording_(recording),
        files_(files),
        max_points_(max_points),
        // A third is left for the moving points.
        static_(max_points - max_points / 3, std::max(files.map_voxel, kSmallestCell),
                ThinnedPoints::Time::kAllScans),
        moving_(max_points, kSmallestCell, ThinnedPoints::Time::kSeparateScans) {
    if (files.last - files.first >= ViewPoint::kMostScans) {
      throw ConfigError("a page shows at most 65535 scans, not " +
                        std::to_string(files.last - files.first + 1));
    }
    data_.origin = recording.T_world_sensor(files.first).translation();
    data_.title = recording.folder().filename().string();
    data_.has_truth = recording.has_labels();
  }

  ViewData collect() {
    for (std::size_t i = files_.first; i <= files_.last; ++i) {
      read_scan(i);
      add_scan(i);
    }
    data_.map = static_.take(max_points_ - max_points_ / 3);
    data_.moving = moving_.take(max_points_ - data_.map.size());
    return std::move(data_);
  }

 private:
  void read_scan(std::size_t i) {
    const std::string& name = recording_.name(i);
    recording_.read_scan(i, scan_.points);
    const std::size_t count = scan_.points.size();
    scan_.labels = read_labels(files_.folder / "labels" / (name + ".label"), count);
    scan_.causes = read_point_bytes(files_.folder / "causes" / (name + ".cause"), count);
    scan_.beliefs = read_point_bytes(files_.folder / "beliefs" / (name + ".belief"), count);
    scan_.truth.clear();
    if (data_.has_truth) scan_.truth = recording_.read_labels(i);
    data_.has_beliefs = data_.has_beliefs || !scan_.beliefs.empty();
    data_.scans.push_back(
        {name, recording_.time(i),
         (recording_.T_world_sensor(i).translation() - data_.origin).cast<float>()});
  }

  /// Everything but the position.
  ViewPoint describe(std::size_t k) const {
    ViewPoint point;
    point.intensity = scan_.points.xyzi[4 * k + 3];
    point.scan = static_cast<std::uint16_t>(data_.scans.size() - 1);
    point.instance = static_cast<std::uint16_t>(scan_.labels[k] >> 16U);
    const std::uint32_t label = scan_.labels[k] & 0xFFFFU;
    if (label == kStatic) point.label = ViewLabel::kStatic;
    if (label == kMoving) point.label = ViewLabel::kMoving;
    if (!scan_.beliefs.empty()) point.belief = scan_.beliefs[k];
    if (!scan_.causes.empty() && scan_.causes[k] < kCauseCount) point.cause = scan_.causes[k];
    if (!scan_.truth.empty()) {
      const evaluation::Truth truth = truth_(scan_.truth[k]);
      const bool is_ground =
          evaluation::is_ground_class(evaluation::semantic_class(scan_.truth[k]));
      if (truth == evaluation::Truth::kStatic) {
        point.truth = is_ground ? ViewTruth::kStatic : ViewTruth::kStaticObject;
      }
      if (truth == evaluation::Truth::kDynamic) point.truth = ViewTruth::kMoving;
    }
    return point;
  }

  void count(const ViewPoint& point) {
    ViewCounts& counts = data_.counts;
    ++counts.points;
    ++counts.by_cause[point.cause];
    const bool is_moving = point.label == ViewLabel::kMoving;
    counts.moving += is_moving ? 1U : 0U;
    const bool stands =
        point.truth == ViewTruth::kStatic || point.truth == ViewTruth::kStaticObject;
    counts.lost += is_moving && stands ? 1U : 0U;
    counts.missed +=
        point.label == ViewLabel::kStatic && point.truth == ViewTruth::kMoving ? 1U : 0U;
  }

  void add_scan(std::size_t i) {
    Pose T_local_sensor = recording_.T_world_sensor(i);
    T_local_sensor.translation() -= data_.origin;
    for (std::size_t k = 0; k < scan_.labels.size(); ++k) {
      ViewPoint point = describe(k);
      count(point);
      if (point.label == ViewLabel::kNotJudged) continue;
      point.local = (T_local_sensor * scan_.points.point(k).position).cast<float>();
      (point.label == ViewLabel::kMoving ? moving_ : static_).add(point);
    }
  }

  const Recording& recording_;
  const RunFiles& files_;
  std::size_t max_points_;
  ThinnedPoints static_, moving_;
  const evaluation::TruthClasses truth_;
  ViewData data_;
  Scan scan_;
};

}  // namespace

ViewData view_of_run(const Recording& recording, const RunFiles& files, std::size_t max_points) {
  return Collector(recording, files, max_points).collect();
}

}  // namespace dynains::viewer
