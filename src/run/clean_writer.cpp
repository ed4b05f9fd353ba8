#include "clean_writer.hpp"

#include <vector>

#include "io/points/point_file_copy.hpp"

namespace dynains::run {

std::string clean_name(const Recording& recording, std::size_t i) {
  const ScanFormat format = recording.format();
  return recording.name(i) + (format == ScanFormat::kBin   ? ".bin"
                              : format == ScanFormat::kPly ? ".ply"
                                                           : ".pcd");
}

void write_clean(const Recording& recording, const JudgedScan& judged,
                 const std::filesystem::path& folder, bool drop_not_judged) {
  const std::filesystem::path target = folder / clean_name(recording, judged.index);
  std::vector<std::uint8_t> keep;
  for (const PointLabel label : judged.verdict.labels) {
    const bool is_kept = label == PointLabel::kOutOfRange ? !drop_not_judged : is_static(label);
    keep.push_back(is_kept ? 1 : 0);
  }
  const ScanFormat format = recording.format();
  if (format == ScanFormat::kBin || format == ScanFormat::kPly || format == ScanFormat::kPcd) {
    AtomicFile file(target);
    copy_points(recording.file(judged.index), {keep.data(), keep.size()}, file.stream());
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
