#include "write_view.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "dynains/errors.hpp"
#include "dynains/evaluation/truth.hpp"
#include "dynains/io/atomic_file.hpp"
#include "label_writer.hpp"
#include "run/output/json_file.hpp"
#include "run_report.hpp"
#include "run_results.hpp"
#include "viewer/page.hpp"
#include "viewer/thinning.hpp"

namespace dynains::run {
namespace {

namespace fs = std::filesystem;
using namespace viewer;

constexpr double kMinCell = 0.05;  // m

/// Reads scan by scan. The page gets at most `max_points` points: the first static point of each
/// voxel, up to two thirds, and moving points.
class Collector {
 public:
  /// `folder`: of the results of a run over the scans in `range`. `map_voxel`: m.
  Collector(const Recording& recording, const ScanRange& range, const fs::path& folder,
            double map_voxel, std::size_t max_points)
      : recording_(recording),
        range_(range),
        files_(folder / "labels", folder / "causes", folder / "beliefs"),
        max_points_(max_points),
        // A third is left for the moving points.
        static_(max_points - max_points / 3, std::max(map_voxel, kMinCell),
                std::numeric_limits<ViewPoint::ScanIndex>::max() + 1),
        moving_(max_points, kMinCell, 1) {
    if (range.size() > std::numeric_limits<ViewPoint::ScanIndex>::max()) {
      throw ConfigError("a page shows at most 65535 scans, not " + std::to_string(range.size()));
    }
    data_.origin = recording.T_world_sensor(range.first).translation();
    data_.title = recording.folder().filename().string();
    data_.has_truth = recording.has_labels();
  }

  ViewData collect() {
    for (std::size_t i = range_.first; i <= range_.last; ++i) {
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
    recording_.read_scan(i, scan_);
    files_.read(name, scan_, verdict_);
    if (data_.has_truth) labels_ = recording_.read_labels(i);
    data_.has_beliefs = data_.has_beliefs || !verdict_.beliefs.empty();
    data_.scans.push_back(
        {name, recording_.time(i),
         (recording_.T_world_sensor(i).translation() - data_.origin).cast<float>()});
  }

  /// Everything but the position.
  ViewPoint describe(std::size_t k) const {
    ViewPoint point;
    point.intensity = scan_.xyzi[4 * k + 3];
    point.scan = static_cast<std::uint16_t>(data_.scans.size() - 1);
    point.instance = static_cast<std::uint16_t>(verdict_.instances[k]);
    const PointLabel label = verdict_.labels[k];
    if (is_static(label)) point.label = ViewLabel::kStatic;
    if (label == PointLabel::kDynamic) point.label = ViewLabel::kMoving;
    if (!verdict_.beliefs.empty()) {
      point.belief = static_cast<std::uint8_t>(std::lround(255.0F * verdict_.beliefs[k]));
    }
    const auto cause = static_cast<std::uint8_t>(verdict_.causes[k]);
    if (cause < kCauseCount) point.cause = cause;
    if (!labels_.empty()) {
      const evaluation::Truth truth = truth_(labels_[k]);
      const bool is_ground = evaluation::is_ground_class(evaluation::semantic_class(labels_[k]));
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
    for (std::size_t k = 0; k < scan_.size(); ++k) {
      ViewPoint point = describe(k);
      count(point);
      if (point.label == ViewLabel::kNotJudged) continue;
      point.local = (T_local_sensor * scan_.point(k).position).cast<float>();
      (point.label == ViewLabel::kMoving ? moving_ : static_).add(point);
    }
  }

  const Recording& recording_;
  ScanRange range_;
  LabelFiles files_;
  std::size_t max_points_;
  ThinnedPoints static_, moving_;
  const evaluation::TruthClasses truth_;
  ViewData data_;
  RecordedScan scan_;                  // the newest one
  VerdictArrays verdict_;              // of scan_
  std::vector<std::uint32_t> labels_;  // of scan_ in the recording; empty: none
};

}  // namespace

void check_run_is_finished(const fs::path& folder) {
  const fs::path file = folder / "report.json";
  std::error_code error;
  if (!fs::exists(file, error)) return;
  const auto report = read_json_file(file);
  if (json_field<std::string>(file, report, "/program") != "dynains") return;
  if (required_json_field<bool>(file, report, "/complete")) return;
  throw IoError(file.string() +
                ": /complete: expected true, found false: the run was interrupted or is still at "
                "work. Repeat it; eval judges what is there by --unfinished");
}

ResultFolder open_finished_run(const fs::path& folder) {
  ResultFolder out(Folder(folder), run_output_kind());
  if (!out.has_results()) {
    throw IoError(out.marker_path().string() + ": not found; expected a folder of `dynains run`");
  }
  check_run_is_finished(folder);
  return out;
}

std::vector<std::size_t> scans_of_run(const ResultFolder& out, const Recording& recording) {
  std::vector<std::size_t> scans;
  std::set<std::string> missing = out.listing().scans;
  if (missing.empty()) {
    throw IoError(out.marker_path().string() + ": /outputs/scans: expected the scans of the run");
  }
  for (std::size_t i = 0; i < recording.size(); ++i) {
    if (missing.erase(listed_name(recording.name(i))) > 0) scans.push_back(i);
  }
  if (missing.empty()) return scans;
  throw IoError(recording.folder().string() + ": has no pose or no scan for " +
                std::to_string(missing.size()) + " of " +
                std::to_string(out.listing().scans.size()) + " scans of the run, " +
                *missing.begin() +
                " first; expected the recording of the run, and a pose for each of its scans");
}

void write_page(const fs::path& page, const fs::path& folder, const Recording& recording,
                const ScanRange& range, double map_voxel, std::size_t max_points) {
  const ViewData data = Collector(recording, range, folder, map_voxel, max_points).collect();
  AtomicFile file(page);
  viewer::write_page(file.stream(), data);
  file.commit();
}

fs::path add_page(const fs::path& folder, const OpenRecording& open, std::size_t max_points) {
  ResultFolder out = open_finished_run(folder);
  OutputFile page(out, kViewPage);
  const Recording recording = open(out);
  const std::vector<std::size_t> scans = scans_of_run(out, recording);
  write_page(page.path(), out.path(), recording, {scans.front(), scans.back()},
             out.field<double>("/configuration/map_voxel"), max_points);
  page.put_in_place([&] { out.mark_with(out.marker(), page.path()); });
  return out.path() / kViewPage;
}

}  // namespace dynains::run
