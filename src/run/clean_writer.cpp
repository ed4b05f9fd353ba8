#include "clean_writer.hpp"

#include <utility>
#include <vector>

#include "dynains/io/kitti.hpp"
#include "output_folder.hpp"

namespace dynains::program {

CleanWriter::CleanWriter(std::filesystem::path folder, const Recording& recording,
                         bool drop_not_judged)
    : folder_(std::move(folder)),
      recording_(recording),
      drop_not_judged_(drop_not_judged),
      has_others_(recording.size() > 0 && !recording.read_other_values(0).columns.empty()) {
  create_folder(folder_);
}

bool CleanWriter::is_kept(PointLabel label) const {
  if (label == PointLabel::kOutOfRange) return !drop_not_judged_;
  return label != PointLabel::kDynamic && label != PointLabel::kInvalid;
}

std::string CleanWriter::name(const Recording& recording, std::size_t i) {
  switch (recording.format()) {
    case ScanFormat::kBin:
      return recording.name(i) + ".bin";
    case ScanFormat::kPcd:
    case ScanFormat::kLog:
      return recording.name(i) + ".pcd";
    case ScanFormat::kPly:
    case ScanFormat::kLas:
    case ScanFormat::kNpy:
    case ScanFormat::kXyz:
    case ScanFormat::kCsv:
    case ScanFormat::kNuScenes:
      break;
  }
  return recording.name(i) + ".ply";
}

Pose CleanWriter::T_file_sensor(std::size_t i) const {
  if (recording_.frame() == PointFrame::kWorld) return recording_.T_world_sensor(i);
  return Pose(Eigen::Translation3d(recording_.sensor_origin()));
}

void CleanWriter::write_bin(const std::filesystem::path& file, std::size_t i,
                            const RecordedScan& scan, Span<const PointLabel> labels) const {
  const Pose T = T_file_sensor(i);
  const bool is_moved = T.matrix() != Pose::Identity().matrix();
  std::vector<float> xyzi;
  for (std::size_t k = 0; k < labels.size(); ++k) {
    if (!is_kept(labels[k])) continue;
    const float* point = scan.xyzi.data() + 4 * k;
    xyzi.insert(xyzi.end(), point, point + 4);
    if (!is_moved) continue;
    Eigen::Map<Eigen::Vector3f> p(xyzi.data() + xyzi.size() - 4);
    p = (T * p.cast<double>()).cast<float>();
  }
  write_scan(file, xyzi);
}

void CleanWriter::write(std::size_t i, const RecordedScan& scan,
                        Span<const PointLabel> labels) const {
  const std::filesystem::path file = folder_ / name(recording_, i);
  if (recording_.format() == ScanFormat::kBin) {
    write_bin(file, i, scan, labels);
    return;
  }
  const Pose T = T_file_sensor(i);
  PointColumns columns = recording_.columns();
  columns.label = false;
  columns.double_xyz = T.translation().cwiseAbs().maxCoeff() > kFloatCoordinateLimit;
  const bool has_pose = recording_.has_viewpoints() || recording_.format() == ScanFormat::kLog ||
                        recording_.frame() == PointFrame::kWorld;
  Pose viewpoint = Pose::Identity();
  if (has_pose) {
    viewpoint = recording_.T_world_sensor(i);
    viewpoint.translate(-recording_.sensor_origin());
  }
  const OtherValues others = has_others_ ? recording_.read_other_values(i) : OtherValues();
  const std::size_t other_bytes = others.bytes_of_point();
  PointFileWriter writer(file, columns, viewpoint, others.columns);
  for (std::size_t k = 0; k < labels.size(); ++k) {
    if (!is_kept(labels[k])) continue;
    FilePoint point = scan.point(k);
    point.position = T * point.position;
    writer.add(point, {others.bytes.data() + k * other_bytes, other_bytes});
  }
  writer.commit(AtomicFile::Sync::kLater);
}

}  // namespace dynains::program
