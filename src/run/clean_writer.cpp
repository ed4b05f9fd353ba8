#include "clean_writer.hpp"

#include <utility>
#include <vector>

#include "io/points/point_file_copy.hpp"
#include "run/output/output_folder.hpp"

namespace dynains::run {

CleanWriter::CleanWriter(std::filesystem::path folder, const Recording& recording,
                         bool drop_not_judged)
    : folder_(std::move(folder)), recording_(recording), drop_not_judged_(drop_not_judged) {
  create_folder(folder_);
}

bool CleanWriter::is_kept(PointLabel label) const {
  if (label == PointLabel::kOutOfRange) return !drop_not_judged_;
  return label != PointLabel::kDynamic && label != PointLabel::kInvalid;
}

std::string CleanWriter::name(const Recording& recording, std::size_t i) {
  const ScanFormat format = recording.format();
  return recording.name(i) + (format == ScanFormat::kBin   ? ".bin"
                              : format == ScanFormat::kPly ? ".ply"
                                                           : ".pcd");
}

void CleanWriter::write(const JudgedScan& judged) const {
  const Span<const PointLabel> labels = judged.verdict.labels;
  const std::filesystem::path target = folder_ / name(recording_, judged.index);
  const ScanFormat format = recording_.format();
  if (format == ScanFormat::kBin || format == ScanFormat::kPly || format == ScanFormat::kPcd) {
    std::vector<std::uint8_t> keep;
    for (const PointLabel label : labels) keep.push_back(is_kept(label) ? 1 : 0);
    AtomicFile file(target);
    copy_points(recording_.file(judged.index), {keep.data(), keep.size()}, file.stream());
    file.commit(AtomicFile::Sync::kLater);
    return;
  }
  const bool is_world = recording_.frame() == PointFrame::kWorld;
  const Pose& T_world_sensor = recording_.T_world_sensor(judged.index);
  const Pose T_file_sensor =
      is_world ? T_world_sensor : Pose(Eigen::Translation3d(recording_.sensor_origin()));
  PointColumns columns = recording_.columns();
  columns.label = false;
  columns.double_xyz = T_file_sensor.translation().cwiseAbs().maxCoeff() > kFloatCoordinateLimit;
  const bool has_pose = format == ScanFormat::kLog || is_world;
  PointFileWriter writer(target, columns,
                         has_pose
                             ? T_world_sensor * Eigen::Translation3d(-recording_.sensor_origin())
                             : Pose::Identity());
  for (std::size_t k = 0; k < labels.size(); ++k) {
    if (!is_kept(labels[k])) continue;
    FilePoint point = judged.scan.point(k);
    point.position = T_file_sensor * point.position;
    writer.add(point);
  }
  writer.commit(AtomicFile::Sync::kLater);
}

}  // namespace dynains::run
