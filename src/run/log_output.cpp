#include "log_output.hpp"

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "dynains/errors.hpp"
#include "dynains/io/atomic_file.hpp"
#include "dynains/io/point_file.hpp"
#include "interrupt.hpp"
#include "io/logs/log_copy.hpp"
#include "io/logs/log_scans.hpp"
#include "io/points/point_sink.hpp"

namespace dynains::run {
namespace {

namespace fs = std::filesystem;

/// Part, block and offset of a message.
using Place = std::tuple<std::uint32_t, std::uint64_t, std::uint64_t>;

Place place_of(const LogMessage& message) { return {message.part, message.block, message.offset}; }

/// Replaces clouds by the labels of a run.
class CloudEditor {
 public:
  CloudEditor(const RunPlan& plan, const PointStore& labels)
      : log_(*plan.sequence.log()), labels_(labels), outputs_(plan.settings.outputs) {
    for (const LogMessage& message : log_.log().messages()) {
      if (log_.has_topic(message.topic)) parts_[place_of(message)];
    }
    unjudged_ = parts_.size();
    for (std::size_t i = plan.range.first; i <= plan.range.last; ++i) {
      const std::size_t scan = plan.sequence.file_index(i);
      std::size_t begin = 0;
      for (const LogCloud& cloud : log_.clouds(scan)) {
        parts_[place_of(cloud.message)] = {i - plan.range.first, begin};
        begin += cloud.points;
        --unjudged_;
      }
    }
  }

  std::size_t unjudged() const { return unjudged_; }

  std::optional<std::string> operator()(const LogMessage& message,
                                        const SerialisedMessage& cloud) const {
    InterruptGuard::check();
    const auto part = parts_.find(place_of(message));
    if (part == parts_.end() || (!outputs_.mark_log && !part->second.scan)) {
      return std::nullopt;
    }
    const std::string& type = log_.log().topics()[message.topic].type;
    const std::vector<std::uint8_t> classes =
        classes_of(part->second, inspect_cloud(type, cloud).points);
    if (outputs_.mark_log) return with_labels(type, cloud, classes);
    const std::vector<std::uint8_t> keep = kept(classes);
    return without_points(type, cloud, keep);
  }

 private:
  /// The points of a cloud in a scan.
  struct Part {
    std::optional<std::size_t> scan;  ///< of the run; empty: without a verdict
    std::size_t begin = 0;
  };

  std::vector<std::uint8_t> classes_of(const Part& part, std::size_t points) const {
    std::vector<std::uint8_t> classes(points, static_cast<std::uint8_t>(kRunNotJudged));
    if (!part.scan) return classes;
    std::vector<PointLabel> labels;
    labels_.read(*part.scan, labels);
    for (std::size_t i = 0; i < points; ++i) {
      classes[i] = static_cast<std::uint8_t>(mos_class(labels.at(part.begin + i)));
    }
    return classes;
  }
  std::vector<std::uint8_t> kept(std::vector<std::uint8_t> classes) const {
    for (std::uint8_t& value : classes) {
      const bool stays =
          value == kRunStatic || (value == kRunNotJudged && !outputs_.drop_not_judged);
      value = stays ? 1 : 0;
    }
    return classes;
  }

  const LogScans& log_;
  const PointStore& labels_;
  const RunOutputs& outputs_;
  std::map<Place, Part> parts_;  ///< of all clouds on the topics
  std::size_t unjudged_ = 0;
};

}  // namespace

void check_log_output(const RunPlan& plan) {
  const fs::path& target = plan.settings.outputs.log;
  const std::string flag = "--write-log " + target.string() + ": ";
  const LogScans* const log = plan.sequence.log();
  if (log == nullptr) {
    throw ConfigError(flag + "the recording is no log; --write-clean writes its scans");
  }
  if (target.extension() != ".mcap") throw ConfigError(flag + "expected a name that ends in .mcap");
  if (!plan.settings.outputs.mark_log) return;
  for (std::uint32_t i = 0; i < log->log().topics().size(); ++i) {
    const std::string& type = log->log().topics()[i].type;
    if (!log->has_topic(i) || can_have_labels(type)) continue;
    throw ConfigError("--mark: clouds of " + type + " have no labels");
  }
  if (plan.sequence.columns().label) throw ConfigError("--mark: the clouds have labels already");
}

void write_log(const RunPlan& plan, const PointStore& labels, const fs::path& file,
               const Warn& warn) {
  const CloudEditor editor(plan, labels);
  const auto log =
      open_log(plan.sequence.log()->log().path(), plan.sequence.options().accept_missing);
  copy_log(*log, file, std::cref(editor));
  if (editor.unjudged() == 0) return;
  warn(plan.settings.outputs.log.string() + ": " + std::to_string(editor.unjudged()) +
       " clouds have no verdict, for lack of a pose, by their stamps or by --start and --end; "
       "they keep all points");
}

void write_clean(const Recording& recording, const JudgedScan& judged, const fs::path& folder,
                 bool drop_not_judged) {
  const fs::path target =
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

}  // namespace dynains::run
