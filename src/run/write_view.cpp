#include "write_view.hpp"

#include <limits>
#include <set>
#include <string>
#include <system_error>
#include <vector>

#include "dynains/errors.hpp"
#include "dynains/evaluation/truth.hpp"
#include "dynains/io/atomic_file.hpp"
#include "run/output/output_folder.hpp"
#include "run_settings.hpp"
#include "verdict_files.hpp"

namespace dynains::run {
namespace {

namespace fs = std::filesystem;
using namespace viewer;

/// Everything but the position.
ViewPoint describe(const JudgedScan& judged, std::size_t k) {
  static const evaluation::TruthClasses truth_of;
  const PackedVerdict& verdict = judged.packed;
  ViewPoint point;
  point.intensity = judged.scan.xyzi[4 * k + 3];
  point.instance = static_cast<std::uint16_t>(instance_of(verdict.labels[k]));
  const std::uint32_t label = class_of(verdict.labels[k]);
  if (label == kRunStatic) point.label = ViewLabel::kStatic;
  if (label == kRunMoving) point.label = ViewLabel::kMoving;
  if (!verdict.beliefs.empty()) point.belief = verdict.beliefs[k];
  if (!verdict.causes.empty() && verdict.causes[k] < kCauseCount) point.cause = verdict.causes[k];
  if (judged.truth.empty()) return point;
  const evaluation::Truth truth = truth_of(judged.truth[k]);
  const bool is_ground = evaluation::is_ground_class(evaluation::semantic_class(judged.truth[k]));
  if (truth == evaluation::Truth::kStatic) {
    point.truth = is_ground ? ViewTruth::kStatic : ViewTruth::kStaticObject;
  }
  if (truth == evaluation::Truth::kDynamic) point.truth = ViewTruth::kMoving;
  return point;
}

}  // namespace

Page make_page(const Recording& recording, const ScanRange& range, double map_voxel,
               std::size_t max_points) {
  if (range.size() > std::numeric_limits<ViewPoint::ScanIndex>::max()) {
    throw ConfigError("a page shows at most 65535 scans, not " + std::to_string(range.size()));
  }
  return {recording.folder().filename().string(),
          recording.T_world_sensor(range.first).translation(), recording.has_labels(), map_voxel,
          max_points};
}

void add_to_page(const Recording& recording, const JudgedScan& judged, Page& page) {
  Pose T_local_sensor = recording.T_world_sensor(judged.index);
  T_local_sensor.translation() -= page.origin();
  if (!judged.packed.beliefs.empty()) page.set_has_beliefs();
  page.begin_scan(recording.name(judged.index), recording.time(judged.index),
                  T_local_sensor.translation().cast<float>());
  for (std::size_t k = 0; k < judged.scan.size(); ++k) {
    ViewPoint point = describe(judged, k);
    point.local = (T_local_sensor * judged.scan.point(k).position).cast<float>();
    page.add(point);
  }
}

void write_page(Page& page, const fs::path& file) {
  AtomicFile output(file);
  page.write(output.stream());
  output.commit();
}

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
  const fs::path marker = folder / kRunOutput.marker;
  if (fs::is_directory(folder) && !fs::exists(marker)) {
    throw IoError(marker.string() + ": not found; expected a folder of `dynains run`");
  }
  ResultFolder out(Folder(folder), kRunOutput);
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

fs::path add_page(const fs::path& folder, const OpenRecording& open, std::size_t max_points) {
  ResultFolder out = open_finished_run(folder);
  OutputFile page(out, kResultNames.page);
  const Recording recording = open(out);
  const std::vector<std::size_t> scans = scans_of_run(out, recording);
  Page content = make_page(recording, {scans.front(), scans.back()},
                           out.field<double>("/configuration/map_voxel"), max_points);
  const VerdictFiles files(out.path(), "labels", true);
  JudgedScan judged;
  for (judged.index = scans.front(); judged.index <= scans.back(); ++judged.index) {
    recording.read_scan(judged.index, judged.scan);
    judged.packed = files.read(recording.name(judged.index), judged.scan.size());
    if (recording.has_labels()) judged.truth = recording.read_labels(judged.index);
    add_to_page(recording, judged, content);
  }
  write_page(content, page.path());
  page.put_in_place([&] { out.mark_with(out.marker(), page.path()); });
  return out.path() / kResultNames.page;
}

}  // namespace dynains::run
