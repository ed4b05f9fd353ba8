// A log of ROS 2 with all scans, their verdicts and the map.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "dynains/io/recording.hpp"
#include "dynains/verdict.hpp"

namespace dynains {

class McapWriter;

namespace program {

/// Writes MCAP. The file appears whole, at `commit()`, or not at all. All members throw IoError.
///
/// /tf (tf2_msgs/TFMessage): the pose of frame "lidar" in "map" at the time of each scan.
/// /points (sensor_msgs/PointCloud2, frame "lidar"): all points of each scan, with the columns of
/// the recording, label (251 moving, 9 static, 0 not judged), instance, belief and cause.
/// /static_map (sensor_msgs/PointCloud2, frame "map"): the map at the end, in messages of at most
/// 4 million points.
class VerdictLog {
 public:
  /// `is_far`: coordinates of the map need doubles. The recording outlives this.
  VerdictLog(const std::filesystem::path& file, const Recording& recording, std::size_t first_scan,
             bool is_far);
  ~VerdictLog();

  /// Adds a scan with its final verdict.
  void add(const RecordedScan& scan, const ScanVerdict& verdict);
  void add_map_point(const Eigen::Vector3d& point);
  void commit();

 private:
  std::uint64_t nanoseconds(double time) const;
  void write_map();

  const Recording& recording_;
  std::unique_ptr<McapWriter> writer_;
  std::uint16_t transforms_ = 0, clouds_ = 0, maps_ = 0;  ///< channels
  double origin_;                                         ///< s; log times are not negative
  std::uint64_t last_time_ = 0;                           ///< ns
  bool is_far_;
  std::string points_;  ///< of the scan or part of the map at work
  std::size_t map_points_ = 0;
};

}  // namespace program

}  // namespace dynains
