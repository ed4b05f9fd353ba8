// Recorded scans as removers take them, one after another.
#pragma once

#include <cstddef>
#include <future>
#include <utility>

#include "dynains/compiled_remover.hpp"
#include "dynains/config.hpp"
#include "dynains/errors.hpp"
#include "dynains/io/recording.hpp"
#include "dynains/point_cloud_traits.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/threads/background.hpp"

namespace dynains::run {

inline RawPoints<float> points_of(const RecordedScan& scan) {
  return {scan.xyzi.data(), scan.size(), 4, scan.sensor.empty() ? nullptr : scan.sensor.data()};
}

/// Sets the sensors of a recording of several.
inline void take_sensors(const Recording& recording, RemoverConfig& config) {
  if (!recording.sensors().empty()) config.sensors = recording.sensors();
}

/// Copies the coordinates of a scan.
inline void copy_points(const RecordedScan& scan, PointBuffer& points) {
  const std::size_t size = scan.size();
  points.resize(size);
  const RawPoints<float> cloud = points_of(scan);
  detail::CloudView(cloud).copy(0, size, points.x.data(), points.y.data(), points.z.data());
}

/// Returns `work()`. A PoseError from it gets the name of scan i.
template <class Work>
decltype(auto) naming_scan(const Recording& recording, std::size_t i, Work&& work) {
  try {
    return std::forward<Work>(work)();
  } catch (const PoseError& error) {
    throw PoseError("scan " + recording.name(i) + ": " + error.what());
  }
}

/// Pushes scan i. Throws PoseError that names it.
inline FrameResult push_scan(DynaInsRemover& remover, const Recording& recording, std::size_t i,
                             const RecordedScan& scan) {
  return naming_scan(recording, i, [&] {
    return remover.push(points_of(scan), recording.T_world_sensor(i), recording.time(i));
  });
}

/// Throws PoseError that names scan i unless its pose is valid.
inline void check_pose(const Recording& recording, std::size_t i) {
  naming_scan(recording, i, [&] { validate_pose("T_world_sensor", recording.T_world_sensor(i)); });
}

/// Reads the next scan while the pipeline works on this one, if there is a thread for it.
class ReadAhead {
 public:
  /// Scans `first` to `last`, both inclusive, of a recording that outlives this. `thread`: async to
  /// read in another thread, deferred to read in next().
  ReadAhead(const Recording& recording, std::size_t first, std::size_t last, std::launch thread)
      : recording_(recording), next_(first), last_(last), reading_(thread) {
    launch();
  }

  /// To be called once for each scan. The next one; throws IoError if it could not be read.
  /// `recycled` gives its memory to the scan after it.
  RecordedScan next(RecordedScan recycled) {
    reading_.wait();
    std::swap(scan_, recycled);
    launch();
    return recycled;
  }

 private:
  void launch() {
    if (next_ <= last_) reading_.begin([this, i = next_++] { recording_.read_scan(i, scan_); });
  }

  const Recording& recording_;
  std::size_t next_;
  std::size_t last_;
  RecordedScan scan_;  // belongs to the reading thread until reading_.wait()
  Background reading_;
};

}  // namespace dynains::run
