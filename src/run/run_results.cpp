#include "run_results.hpp"

#include <algorithm>
#include <iomanip>
#include <locale>
#include <map>
#include <utility>

#include "dynains/io/atomic_file.hpp"
#include "interrupt.hpp"
#include "io/folder.hpp"
#include "io/points/point_file_copy.hpp"
#include "recorded_scans.hpp"

namespace dynains::run {
namespace {

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

/// Writes a scan to `folder`: all finite points that are not dynamic, or with `drop_not_judged` all
/// static ones, in their order and frame. Files of .bin, .pcd and .ply are copied without the other
/// points, so that all columns stay as they are. Scans of other formats become .pcd with the
/// columns of the scan, m. Throws IoError.
void write_clean(const Recording& recording, const JudgedScan& judged,
                 const std::filesystem::path& folder, bool drop_not_judged) {
  const std::filesystem::path target =
      folder / (recording.name(judged.index) + clean_extension(recording.format()));
  std::vector<std::uint8_t> keep;
  for (const PointLabel label : judged.verdict.labels) {
    const bool is_kept = label == PointLabel::kOutOfRange ? !drop_not_judged : is_static(label);
    keep.push_back(is_kept ? 1 : 0);
  }
  const ScanFormat format = recording.format();
  if (format == ScanFormat::kBin || format == ScanFormat::kPly || format == ScanFormat::kPcd) {
    AtomicFile file(target);
    dynains::copy_points(recording.file(judged.index), {keep.data(), keep.size()}, file.stream());
    file.commit(AtomicFile::Sync::kLater);
    return;
  }
  const bool is_world = recording.frame() == PointFrame::kWorld;
  const Pose& T_world_sensor = recording.T_world_sensor(judged.index);
  const Pose T_file_sensor =
      is_world ? T_world_sensor : Pose(Eigen::Translation3d(recording.sensor_origin()));
  PointColumns columns = recording.columns();
  columns.label = false;
  columns.double_xyz = T_file_sensor.translation().cwiseAbs().maxCoeff() > kFloatCoordinateLimit;
  const bool has_pose = format == ScanFormat::kLog || is_world;
  PointFileWriter writer(target, columns,
                         has_pose
                             ? T_world_sensor * Eigen::Translation3d(-recording.sensor_origin())
                             : Pose::Identity());
  for (std::size_t k = 0; k < keep.size(); ++k) {
    if (keep[k] == 0) continue;
    FilePoint point = judged.scan.point(k);
    point.position = T_file_sensor * point.position;
    writer.add(point);
  }
  writer.commit(AtomicFile::Sync::kLater);
}

}  // namespace

RunResults::RunResults(const Recording& recording, const ScanRange& range,
                       const RunSettings& settings)
    : recording_(recording),
      range_(range),
      outputs_(settings.outputs),
      store_(outputs_.folder),
      returns_(store_, settings.config.evidence),
      verdicts_(outputs_.folder),
      final_labels_(outputs_.folder, "labels", outputs_.write_beliefs),
      dynamic_points_(outputs_.folder / "dynamic_points.ply", moving_columns(recording, range)),
      overview_(path_of(recording, range)),
      writing_(outputs_.thread()),
      writing_online_(outputs_.thread()) {
  if (settings.passes > 1 && range.size() > returns_.compared()) {
    SecondPassConfig config;
    config.sensors = settings.config.sensors;
    config.static_policy = settings.static_policy;
    config.evidence = settings.config.evidence;
    second_.emplace(store_, config);
  }
  final_labels_.create_folders();
  add([this](const JudgedScan& judged) {
    final_labels_.write(recording_.name(judged.index), judged.packed);
  });
  if (outputs_.write_online) online_labels_.emplace(outputs_.folder, "online").create_folders();
  if (outputs_.write_clean) {
    const std::filesystem::path folder = outputs_.folder / "clean";
    create_folder(folder);
    add([this, folder](const JudgedScan& judged) {
      write_clean(recording_, judged, folder, outputs_.drop_not_judged);
    });
  }
  if (!outputs_.map.empty()) {
    map_ = open_map(outputs_.map, recording, range, outputs_.map_attributes, outputs_.crs);
  }
  if (map_ && second_) {
    revised_map_.emplace(settings.config.map);
    add([this](const JudgedScan& judged) { add_to_revised_map(judged); });
  }
  if (outputs_.map_attributes) {
    map_attributes_.emplace(outputs_.map_voxel,
                            recording.T_world_sensor(range.first).translation());
    add([this](const JudgedScan& judged) { map_attributes_->add(judged); }, true);
  }
  add([this](const JudgedScan& judged) { overview_.add(judged); });
  add([this](const JudgedScan& judged) { write_moving(judged); });
}

void RunResults::add(Sink sink, bool needs_truth) {
  sinks_.push_back(std::move(sink));
  needs_truth_ = needs_truth_ || (needs_truth && recording_.has_labels());
}

void RunResults::write_moving(const JudgedScan& judged) {
  for_each_moving(judged.verdict.labels, [&](std::size_t i) {
    FilePoint point = judged.scan.point(i);
    point.position = judged.verdict.T_world_sensor * point.position;
    point.label = judged.packed.labels[i];
    dynamic_points_.add(point);
  });
}

void RunResults::add_to_revised_map(const JudgedScan& judged) {
  const Span<const PointLabel> labels = judged.verdict.labels;
  keep_.resize(labels.size());
  std::transform(labels.begin(), labels.end(), keep_.begin(),
                 [](PointLabel label) { return std::uint8_t{is_static(label)}; });
  revised_map_->insert(judged.points, keep_, judged.verdict.T_world_sensor);
}

void RunResults::take_newest(const FrameResult& frame) {
  if (!online_labels_) return;
  const ScanVerdict& verdict = frame.newest();
  writing_online_.wait();
  online_.pack_labels(verdict);
  writing_online_.begin([this, i = range_.first + verdict.scan] {
    online_labels_->write(recording_.name(i), online_);
  });
}

void RunResults::take_final(RecordedScan* scan, const ScanVerdict& verdict) {
  for (const MovingObject& object : verdict.objects) {
    TrackRow& row =
        tracks_.emplace_back(TrackRow{range_.first + verdict.scan, verdict.time, object});
    row.object.first_scan += range_.first;
    row.object.last_scan = row.scan;
  }
  finish();
  judged_.index = range_.first + verdict.scan;
  judged_.arrays.take(verdict, outputs_.needs_beliefs());
  judged_.verdict = judged_.arrays.verdict(verdict);
  if (scan != nullptr) std::swap(judged_.scan, *scan);
  writing_.begin([this, reads = scan == nullptr] {
    if (reads) recording_.read_scan(judged_.index, judged_.scan);
    copy_points(judged_.scan, judged_.points);
    if (second_) return keep_for_second_pass();
    returns_.add(judged_.points, judged_.verdict.labels, judged_.verdict.compared);
    hand_out();
  });
  ++finished_;
}

void RunResults::keep_for_second_pass() {
  judged_.packed.pack(judged_.verdict, outputs_.write_beliefs);
  verdicts_.add(judged_.packed.labels);
  verdicts_.add(judged_.packed.causes);
  verdicts_.add(judged_.packed.beliefs);
  second_->add(judged_.points, judged_.verdict, judged_.scan.sensor);
}

void RunResults::revise(const std::function<void(std::size_t done)>& progress) {
  if (!second_) return;
  second_->test([] { return InterruptGuard::signal() == 0; });
  if (finished_ == 0) return;
  progress(0);
  ReadAhead reader(recording_, range_.first, range_.first + finished_ - 1, writing_.policy());
  JudgedScan next;
  for (std::size_t k = 0; k < finished_; ++k) {
    next.index = range_.first + k;
    next.scan = reader.next(std::move(next.scan));
    copy_points(next.scan, next.points);
    verdicts_.read(3 * k, next.packed.labels);
    verdicts_.read(3 * k + 1, next.packed.causes);
    verdicts_.read(3 * k + 2, next.packed.beliefs);
    next.packed.unpack(next.scan, next.arrays);
    second_->revise(next.points, static_cast<std::uint32_t>(k), next.arrays);
    finish();
    std::swap(judged_, next);
    judged_.verdict =
        judged_.arrays.verdict({k, recording_.time(judged_.index),
                                orthonormalized(recording_.T_world_sensor(judged_.index))});
    writing_.begin([this] { hand_out(); });
    progress(k + 1);
  }
  finish();
}

void RunResults::hand_out() {
  judged_.packed.pack(judged_.verdict, outputs_.write_beliefs);
  if (needs_truth_) judged_.truth = recording_.read_labels(judged_.index);
  tally_.add(judged_.verdict);
  for (const Sink& sink : sinks_) sink(judged_);
}

void RunResults::add_map_point(const Eigen::Vector3d& point) {
  map_->add(map_attributes_ ? map_attributes_->at(point) : FilePoint{point});
}

void RunResults::commit() {
  finish();
  writing_online_.wait();
  dynamic_points_.commit();
  if (outputs_.write_tracks) write_tracks(outputs_.folder / kResultNames.tracks, tracks_);
  overview_.picture().write_png(outputs_.folder / kResultNames.picture);
  if (revised_map_) revised_map_->for_each([&](const auto& point) { add_map_point(point); });
  if (map_) map_->commit();
}

nlohmann::ordered_json RunResults::second_pass_report() const {
  return {{"places", second_->place_count()},
          {"removed_points", second_->revised().removed},
          {"restored_points", second_->revised().restored}};
}

std::optional<std::size_t> RunResults::map_points() const {
  if (!map_) return std::nullopt;
  return revised_map_ ? revised_map_->size() : map_->size();
}

}  // namespace dynains::run
