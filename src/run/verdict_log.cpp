#include "verdict_log.hpp"

#include <algorithm>
#include <cmath>

#include "io/log/mcap_writer.hpp"
#include "io/log/message_types.hpp"
#include "io/log/message_writer.hpp"
#include "io/scalar.hpp"
#include "label_writer.hpp"

namespace dynains::program {
namespace {

constexpr const char* kSensorFrame = "lidar";
constexpr const char* kMapFrame = "map";

CloudLayout scan_layout(const PointColumns& columns) {
  CloudLayout layout{{{"x", CloudLayout::kFloat32, 4},
                      {"y", CloudLayout::kFloat32, 4},
                      {"z", CloudLayout::kFloat32, 4},
                      {"intensity", CloudLayout::kFloat32, 4}}};
  if (columns.ring) layout.fields.push_back({"ring", CloudLayout::kUint16, 2});
  if (columns.time) layout.fields.push_back({"time", CloudLayout::kFloat64, 8});
  layout.fields.push_back({"label", CloudLayout::kUint16, 2});
  layout.fields.push_back({"instance", CloudLayout::kUint32, 4});
  layout.fields.push_back({"belief", CloudLayout::kFloat32, 4});
  layout.fields.push_back({"cause", CloudLayout::kUint8, 1});
  return layout;
}

CloudLayout map_layout(bool is_far) {
  const std::uint8_t type = is_far ? CloudLayout::kFloat64 : CloudLayout::kFloat32;
  const std::uint8_t size = is_far ? 8 : 4;
  return {{{"x", type, size}, {"y", type, size}, {"z", type, size}}};
}

}  // namespace

VerdictLog::VerdictLog(const std::filesystem::path& file, const Recording& recording,
                       std::size_t first_scan, bool is_far)
    : recording_(recording),
      writer_(std::make_unique<McapWriter>(file)),
      origin_(std::min(0.0, recording.time(first_scan))),
      is_far_(is_far) {
  transforms_ = writer_->add_channel(transforms_topic("/tf"));
  clouds_ = writer_->add_channel(cloud_topic("/points"));
  maps_ = writer_->add_channel(cloud_topic("/static_map"));
}

VerdictLog::~VerdictLog() = default;

std::uint64_t VerdictLog::nanoseconds(double time) const {
  return static_cast<std::uint64_t>(std::llround(1e9 * (time - origin_)));
}

void VerdictLog::add(const RecordedScan& scan, const ScanVerdict& verdict) {
  const PointColumns& columns = recording_.columns();
  const bool has_ring = scan.ring.size() == scan.size();
  const bool has_time = scan.time.size() == scan.size();
  points_.clear();
  for (std::size_t i = 0; i < scan.size(); ++i) {
    for (std::size_t k = 0; k < 4; ++k) append_number(scan.xyzi[4 * i + k], points_);
    if (columns.ring) append_number(has_ring ? scan.ring[i] : std::uint16_t{0}, points_);
    if (columns.time) append_number(has_time ? scan.time[i] : 0.0, points_);
    append_number(static_cast<std::uint16_t>(mos_label(verdict.labels[i], kNoInstance)), points_);
    append_number(verdict.instances[i], points_);
    append_number(verdict.beliefs[i], points_);
    append_number(verdict.causes[i], points_);
  }
  last_time_ = nanoseconds(verdict.time);
  writer_->write(transforms_, last_time_,
                 transform_message(last_time_, kMapFrame, kSensorFrame, verdict.T_world_sensor));
  writer_->write(clouds_, last_time_,
                 cloud_message(last_time_, kSensorFrame, scan_layout(columns), points_));
  points_.clear();
}

void VerdictLog::add_map_point(const Eigen::Vector3d& point) {
  constexpr std::size_t kMostPoints = 4000000;
  for (const double value : point) {
    is_far_ ? append_number(value, points_) : append_number(static_cast<float>(value), points_);
  }
  if (++map_points_ == kMostPoints) write_map();
}

void VerdictLog::write_map() {
  writer_->write(maps_, last_time_,
                 cloud_message(last_time_, kMapFrame, map_layout(is_far_), points_));
  points_.clear();
  map_points_ = 0;
}

void VerdictLog::commit() {
  if (map_points_ > 0) write_map();
  writer_->commit();
}

}  // namespace dynains::program
