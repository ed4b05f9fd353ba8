#include "run_results.hpp"

#include <algorithm>
#include <functional>
#include <iomanip>
#include <locale>
#include <map>
#include <numeric>
#include <utility>

#include "dynains/io/atomic_file.hpp"
#include "dynains/pose.hpp"
#include "dynains/recording/second_pass.hpp"
#include "point_labels.hpp"
#include "read_ahead.hpp"
#include "recorded_scans.hpp"
#include "run/output/output_folder.hpp"

namespace dynains::run {
namespace {

/// Points lie around the poses; near the limit doubles cost little and lose nothing.
bool is_far(const Recording& recording, const ScanRange& range) {
  // No sensor reaches farther than 500 m.
  for (std::size_t i = range.first; i <= range.last; ++i) {
    const Eigen::Vector3d position = recording.T_world_sensor(i).translation();
    if (position.cwiseAbs().maxCoeff() > kFloatCoordinateLimit - 500.0) return true;
  }
  return false;
}

PointColumns map_columns(bool far, const Recording& recording, bool with_attributes) {
  PointColumns columns;
  columns.double_xyz = far;
  if (!with_attributes) return columns;
  columns.intensity = recording.columns().intensity;
  columns.time = recording.columns().time;
  columns.label = recording.has_labels();
  return columns;
}

float max_intensity(const RecordedScan& scan) {
  float most = 0.0F;
  for (std::size_t i = 0; i < scan.size(); ++i) most = std::max(most, scan.xyzi[4 * i + 3]);
  return most;
}

LasOptions las_options(const Recording& recording, const ScanRange& range, const std::string& crs) {
  LasOptions options = las_options_near(recording.T_world_sensor(range.first).translation());
  options.wkt = crs;
  return options;
}

/// Columns of the file of moving points.
PointColumns moving_columns(const Recording& recording, const ScanRange& range) {
  PointColumns columns = recording.columns();
  columns.double_xyz = is_far(recording, range);
  columns.intensity = true;
  columns.label = true;
  return columns;
}

constexpr const char* kTracksFile = "tracks.csv";

/// Writes a row for each object of each scan, by scan and id.
void write_tracks(const std::filesystem::path& path, std::vector<TrackRow>& rows) {
  std::map<std::uint32_t, std::uint64_t> last_scans;
  for (const TrackRow& row : rows) last_scans[row.object.id] = row.object.last_scan;
  AtomicFile file(path);
  std::ostream& out = file.stream();
  out.imbue(std::locale::classic());
  out << std::setprecision(15) << "scan,time";
  const MovingObject none;
  MovingObject::visit(none, [&](const char* name, auto) { out << ',' << name; });
  out << '\n';
  for (TrackRow& row : rows) {
    row.object.last_scan = last_scans[row.object.id];
    out << row.scan << ',' << row.time;
    MovingObject::visit(row.object, [&](const char*, auto number) { out << ',' << number; });
    out << '\n';
  }
  file.commit();
}

/// Positions of the sensor, m, world frame.
std::vector<Eigen::Vector3d> path_of(const Recording& recording, const ScanRange& range) {
  std::vector<Eigen::Vector3d> path;
  for (std::size_t i = range.first; i <= range.last; ++i) {
    path.emplace_back(recording.T_world_sensor(i).translation());
  }
  return path;
}

}  // namespace

bool RunOutputs::has_outside_map() const {
  return !map.empty() && map.parent_path() != whole_path(folder);
}

std::string RunOutputs::map_name() const {
  return (has_outside_map() ? map : map.filename()).string();
}

OutputListing RunOutputs::listing(const Recording& recording, const ScanRange& range) const {
  OutputListing listing;
  listing.files = {"timing.csv", "dynamic_points.ply", kOverviewPicture};
  if (!map.empty() && !has_outside_map()) listing.files.insert(listed_name(map_name()));
  if (write_tracks) listing.files.insert(kTracksFile);
  if (write_poses) listing.files.insert(kEstimatedPoses);
  if (write_page) listing.files.insert(kViewPage);
  listing.folders = {{"labels", ".label"}, {"causes", ".cause"}};
  if (write_beliefs) listing.folders["beliefs"] = ".belief";
  if (write_online) listing.folders["online"] = ".label";
  if (write_clean) {
    listing.folders["clean"] =
        std::filesystem::path(CleanWriter::name(recording, range.first)).extension().string();
  }
  for (std::size_t i = range.first; i <= range.last; ++i)
    listing.scans.insert(listed_name(recording.name(i)));
  return listing;
}

std::unique_ptr<MapFile> open_map(const std::filesystem::path& file, const Recording& recording,
                                  const ScanRange& range, const RunOutputs& outputs) {
  MapFileOptions options;
  options.columns = map_columns(is_far(recording, range), recording, outputs.map_attributes);
  if (is_las(file)) {
    options.las = las_options(recording, range, outputs.crs);
    options.intensity_scale = las_intensity_scale(max_intensity(recording.read_scan(range.first)));
  }
  return MapFile::open(file, options);
}

RunResults::RunResults(const Recording& recording, const ScanRange& range,
                       const RunOutputs& outputs)
    : recording_(recording),
      range_(range),
      final_labels_(outputs.folder / "labels", outputs.folder / "causes",
                    outputs.write_beliefs ? outputs.folder / "beliefs" : std::filesystem::path()),
      dynamic_points_(outputs.folder / "dynamic_points.ply", moving_columns(recording, range)),
      overview_(path_of(recording, range)),
      overview_file_(outputs.folder / kOverviewPicture),
      needs_beliefs_(outputs.needs_beliefs()),
      writing_(outputs.thread()),
      writing_online_(outputs.thread()) {
  final_labels_.create_folders();
  if (outputs.write_online) online_labels_.emplace(outputs.folder / "online").create_folders();
  if (outputs.write_clean)
    clean_scans_.emplace(outputs.folder / "clean", recording, outputs.drop_not_judged);
  if (outputs.write_tracks) tracks_file_ = outputs.folder / kTracksFile;
  if (!outputs.map.empty()) map_ = open_map(outputs.map, recording, range, outputs);
  if (outputs.map_attributes) {
    map_attributes_.emplace(outputs.map_voxel, recording.T_world_sensor(range.first).translation());
  }
}

void RunResults::take_newest(const FrameResult& frame) {
  if (!online_labels_) return;
  const ScanVerdict& verdict = frame.newest();
  writing_online_.wait();
  online_labels_->take(verdict);
  writing_online_.begin(
      [this, i = range_.first + verdict.scan] { online_labels_->write(recording_.name(i)); });
}

void RunResults::take_final(RecordedScan* scan, const ScanVerdict& verdict) {
  for (const MovingObject& object : verdict.objects) {
    TrackRow& row =
        tracks_.emplace_back(TrackRow{range_.first + verdict.scan, verdict.time, object});
    row.object.first_scan += range_.first;
    row.object.last_scan = row.scan;
  }
  finish();
  judged_.arrays.take(verdict, needs_beliefs_);
  judged_.verdict = judged_.arrays.verdict(verdict);
  if (scan != nullptr) std::swap(judged_.scan, *scan);
  writing_.begin([this, reads = scan == nullptr] {
    if (reads) recording_.read_scan(range_.first + judged_.verdict.scan, judged_.scan);
    write_final(judged_.scan, judged_.verdict);
  });
  ++finished_;
}

void RunResults::finish() { writing_.wait(); }

void RunResults::write_final(const RecordedScan& scan, const ScanVerdict& verdict) {
  final_labels_.take(verdict);
  final_labels_.write(recording_.name(range_.first + verdict.scan));
  copy_points(scan, judged_.points);
  if (second_pass_ != nullptr) {
    second_pass_->add(judged_.points, verdict, scan.sensor);
  } else {
    if (returns_ != nullptr) returns_->add(judged_.points, verdict.labels, verdict.compared);
    complete_scan(scan, verdict);
  }
}

void RunResults::revise(const StaticMapAccumulator::Config& map,
                        const std::function<void(std::size_t done)>& progress) {
  if (finished_ == 0) return;
  if (map_) revised_map_.emplace(map);
  progress(0);
  ReadAhead reader(recording_, range_.first, range_.first + finished_ - 1, thread());
  JudgedScan judged;
  for (std::size_t i = 0; i < finished_; ++i) {
    const std::size_t index = range_.first + i;
    judged.scan = reader.next(std::move(judged.scan));
    copy_points(judged.scan, judged.points);
    final_labels_.read(recording_.name(index), judged.scan, judged.arrays);
    const bool is_revised =
        second_pass_->revise(judged.points, static_cast<std::uint32_t>(i), judged.arrays);
    finish();
    std::swap(judged_, judged);
    judged_.verdict = judged_.arrays.verdict(
        {i, recording_.time(index), orthonormalized(recording_.T_world_sensor(index))});
    writing_.begin([this, is_revised] { write_revised(is_revised); });
    progress(i + 1);
  }
  finish();
  if (revised_map_) revised_map_->for_each([&](const auto& point) { add_map_point(point); });
}

void RunResults::write_revised(bool is_revised) {
  const ScanVerdict& verdict = judged_.verdict;
  if (is_revised) {
    final_labels_.take(verdict);
    final_labels_.write(recording_.name(range_.first + verdict.scan));
  }
  complete_scan(judged_.scan, verdict);
  if (!revised_map_) return;
  keep_.resize(judged_.points.size());
  std::transform(verdict.labels.begin(), verdict.labels.end(), keep_.begin(), [](PointLabel label) {
    return static_cast<std::uint8_t>(is_static(label) ? 1 : 0);
  });
  revised_map_->insert(judged_.points, keep_, verdict.T_world_sensor);
}

bool RunResults::is_complete() const {
  return finished_ == range_.size() && (second_pass_ == nullptr || second_pass_->is_decided());
}

void RunResults::complete_scan(const RecordedScan& scan, const ScanVerdict& verdict) {
  points_ += verdict.labels.size();
  const std::uint64_t moving_before = labels_[PointLabel::kDynamic];
  labels_.add(verdict.labels);
  counts_.push_back({verdict.labels.size(), labels_[PointLabel::kDynamic] - moving_before});
  unclustered_ += std::inner_product(
      verdict.labels.begin(), verdict.labels.end(), verdict.causes.begin(), std::uint32_t{0},
      std::plus<>(), [](PointLabel label, Cause cause) {
        return label == PointLabel::kStatic && cause == Cause::kNotJudged ? 1U : 0U;
      });
  below_movers_ += static_cast<std::uint64_t>(
      std::count(verdict.causes.begin(), verdict.causes.end(), Cause::kUnderInstance));
  add_scan(scan, verdict);
  overview_.add(scan, verdict);
  for_each_moving(verdict.labels, [&](std::size_t i) {
    FilePoint point = scan.point(i);
    point.position = verdict.T_world_sensor * point.position;
    point.label = mos_label(verdict.labels[i], verdict.instances[i]);
    dynamic_points_.add(point);
  });
}

void RunResults::add_scan(const RecordedScan& scan, const ScanVerdict& verdict) {
  const std::size_t index = range_.first + verdict.scan;
  if (clean_scans_) clean_scans_->write(index, scan, verdict.labels);
  const bool has_labels = (map_attributes_ || session_ != nullptr) && recording_.has_labels();
  const auto labels = has_labels ? recording_.read_labels(index) : std::vector<std::uint32_t>();
  if (map_attributes_) map_attributes_->add(scan, verdict, labels);
  if (session_ == nullptr) return;
  session_->add(judged_.points, verdict.labels, labels, verdict.T_world_sensor,
                static_cast<std::uint32_t>(index));
}

void RunResults::add_map_point(const Eigen::Vector3d& point) {
  map_->add(point, map_attributes_ ? map_attributes_->at(point) : MapAttributes());
}

void RunResults::commit() {
  finish();
  writing_online_.wait();
  dynamic_points_.commit();
  if (!tracks_file_.empty()) write_tracks(tracks_file_, tracks_);
  overview_.picture().write_png(overview_file_);
  if (map_) map_->commit();
}

std::optional<std::size_t> RunResults::map_points() const {
  if (!map_) return std::nullopt;
  return map_->size();
}

}  // namespace dynains::run
