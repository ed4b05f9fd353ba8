#include "scan_reader.hpp"

#include <utility>

#include "dynains/io/kitti.hpp"
#include "dynains/io/point_file.hpp"
#include "failure.hpp"
#include "points/bin_layout.hpp"
#include "points/finite_points.hpp"

namespace dynains {
namespace {

/// .bin: float32 x y z intensity, or other columns; .pcd.bin of nuScenes has a ring behind them.
class BinReader final : public ScanReader {
 public:
  BinReader(const BinLayout& layout, bool has_ring) : layout_(layout), has_ring_(has_ring) {}

  PointColumns columns(const ScanEntry&) const override {
    PointColumns columns;
    columns.intensity = layout_.columns > 3;
    columns.ring = has_ring_;
    return columns;
  }
  std::uint64_t point_count(const ScanEntry& scan) const override {
    return count_bin_points(scan.file, layout_);
  }
  void read(const ScanEntry& scan, const FileTransform* T_target_file,
            RecordedScan& points) const override {
    points.ring.clear();
    points.time.clear();
    points.sensor.clear();
    is_usual(layout_)
        ? read_scan(scan.file, points.xyzi)
        : read_bin_points(scan.file, layout_, points.xyzi, has_ring_ ? &points.ring : nullptr);
    transform_scan(T_target_file, points);
  }
  std::vector<std::uint32_t> read_labels(const ScanEntry& scan) const override {
    fail(scan.file, "has no labels");
  }

 private:
  BinLayout layout_;
  bool has_ring_;
};

/// Files of read_points().
class PointFileReader final : public ScanReader {
 public:
  PointColumns columns(const ScanEntry& scan) const override {
    return read_point_file_header(scan.file).columns;
  }
  std::uint64_t point_count(const ScanEntry& scan) const override {
    return read_point_file_header(scan.file).point_count;
  }
  void read(const ScanEntry& scan, const FileTransform* T_target_file,
            RecordedScan& points) const override {
    PointFile file = read_points(scan.file);
    points.xyzi.resize(4 * file.positions.size());
    for (std::size_t k = 0; k < file.positions.size(); ++k) {
      Eigen::Vector3d p = file.positions[k];
      if (T_target_file != nullptr) p = *T_target_file * p;
      float* xyzi = points.xyzi.data() + 4 * k;
      Eigen::Map<Eigen::Vector3f>(xyzi, 3) = p.cast<float>();
      xyzi[3] = file.intensity.empty() ? 0.0F : file.intensity[k];
    }
    points.ring = std::move(file.ring);
    points.time = std::move(file.time);
    points.sensor = std::move(file.sensor);
  }
  std::vector<std::uint32_t> read_labels(const ScanEntry& scan) const override {
    PointFile points = read_points(scan.file);
    if (points.label.size() != points.positions.size()) {
      fail(scan.file, "expected a column \"label\", as in the first scan");
    }
    return std::move(points.label);
  }
};

}  // namespace

void transform_scan(const FileTransform* T_target_file, RecordedScan& points) {
  if (T_target_file == nullptr) return;
  for_each_position(points, [&](auto p) {
    p = (*T_target_file * p.template cast<double>()).template cast<float>();
  });
}

std::unique_ptr<ScanReader> make_file_reader(ScanFormat format, const BinLayout& layout) {
  constexpr BinLayout kNuScenes{5, false};
  if (format == ScanFormat::kBin) return std::make_unique<BinReader>(layout, false);
  if (format == ScanFormat::kNuScenes) return std::make_unique<BinReader>(kNuScenes, true);
  return std::make_unique<PointFileReader>();
}

}  // namespace dynains
