// DynaInsRemover: turns scans and poses into verdicts and a static map. This header requires the
// library dynains::remover, which contains the compiled default stages. dyna_ins_remover.hpp
// requires no library and supports custom stages.
#pragma once

#include <cstddef>
#include <limits>
#include <memory>
#include <optional>

#include "dynains/belief/belief_updater.hpp"
#include "dynains/clusters/curved_voxel_clusterer.hpp"
#include "dynains/config.hpp"
#include "dynains/descriptors/occupancy_descriptor.hpp"
#include "dynains/errors.hpp"
#include "dynains/ground/ground_segmenter.hpp"
#include "dynains/map/static_map_accumulator.hpp"
#include "dynains/pipeline/interfaces.hpp"
#include "dynains/point_cloud_traits.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/sensor/sensor_model.hpp"
#include "dynains/verdict.hpp"

namespace dynains {

/// Types of the pipeline's stages. To replace a stage, derive from this struct and redefine its
/// alias. pipeline/interfaces.hpp lists the members that a stage needs.
struct DefaultStages {
  using Ground = GroundSegmenter;
  using Clusterer = CurvedVoxelClusterer;
  using Descriptor = OccupancyDescriptor;
  using Belief = BeliefUpdater;
  using Map = StaticMapAccumulator;
};

/// Removes moving instances from a stream of scans, one scan at a time.
///
/// Owns every buffer. After warm-up, a push allocates memory only when the map grows. Objects are
/// independent of each other. `push`, `flush`, `reset` and `reserve_like` throw
/// UsageError while another of these calls runs on the same object. The map and the spans of a
/// verdict must not be read during such a call, except by the sink of `flush`; other threads need a
/// lock that also covers the calls. Objects are movable. A moved-from object can be assigned to or
/// destroyed; other calls throw UsageError.
template <class Stages = DefaultStages>
class BasicDynaInsRemover {
 public:
  using Map = typename Stages::Map;
  /// All parameters: RemoverConfig and the Config of each stage.
  using Config = PipelineConfig<Stages>;

  BasicDynaInsRemover() : BasicDynaInsRemover(Config()) {}
  /// Throws ConfigError.
  explicit BasicDynaInsRemover(const Config& config);

  /// The parameters as given to the constructor.
  const Config& config() const { return pipeline().config(); }
  /// The static map of all final verdicts, m, world frame (Eq. 1).
  const Map& map() const { return pipeline().map(); }

  /// Number of scans between a push and the final verdict on its scan.
  std::size_t latency() const { return pipeline().latency(); }

  /// Model of the sensor, estimated from the first scan with enough points. Not known() before that
  /// scan, or if no parameter needs the estimate.
  const SensorModel& sensor() const { return pipeline().sensor(); }

  /// Warm-up: pushes `example` (m, sensor frame) until verdicts are final, at most `scans` times,
  /// and forgets all scans. The memory stays, so that the first pushes of scans like it cause few
  /// allocations and page faults. Scans of other sizes may follow. Results do not change. Throws
  /// UsageError after the first push, and CloudError for an invalid cloud.
  template <class Cloud>
  void reserve_like(const Cloud& example,
                    std::size_t scans = std::numeric_limits<std::size_t>::max()) {
    const detail::ReentrancyGuard::Guard guard(pipeline().guard());
    pipeline().reserve_like(detail::CloudView(example), scans);
  }

  /// Processes one scan.
  ///
  /// `cloud`: m, sensor frame, z up (RemoverConfig::level handles tilted sensors); any type with
  /// PointCloudTraits, any size. Invalid points get PointLabel::kInvalid or kOutOfRange.
  /// `T_world_sensor`: pose of the frame of the cloud at the time of the scan, in a type that
  /// to_pose() takes (Eigen::Isometry3d, Matrix4d, Isometry3f, ...). Both may be of a body, such
  /// as base_link, if RemoverConfig::sensors has the poses of the sensors in it. Points of several
  /// sensors are pushed together, at the time of the pose. `sensors`: which sensor
  /// measured them, unless PointCloudTraits::sensor() says it; a sensor may be missing. `time`: s,
  /// greater than the time of the previous scan; by default 0 for the first scan, else 0.1 s after
  /// the previous scan, or the next double if 0.1 s is below the resolution.
  ///
  /// Throws PoseError, or the exceptions of PointCloudTraits such as CloudError; the state is then
  /// unchanged. If a stage throws (std::bad_alloc), the scan is discarded and the next scan starts
  /// a new epoch; evidence of the discarded scan on older scans may remain. If the finalization of
  /// an older scan throws, for example in the map, only the final verdict on that scan is lost.
  template <class Cloud, class PoseLike>
  FrameResult push(const Cloud& cloud, const PoseLike& T_world_sensor,
                   std::optional<double> time = std::nullopt,
                   Span<const SensorRange> sensors = {}) {
    const detail::ReentrancyGuard::Guard guard(pipeline().guard());
    return pipeline().push(detail::CloudView(cloud, sensors), to_pose(T_world_sensor), time);
  }

  /// Makes the verdicts on all open scans final, oldest first, and calls `sink(const ScanVerdict&)`
  /// for each. The next push starts a new epoch.
  template <class Sink>
  void flush(Sink&& sink) {
    const detail::ReentrancyGuard::Guard guard(pipeline().guard());
    while (const std::optional<ScanVerdict> verdict = pipeline().finish_oldest()) sink(*verdict);
    pipeline().start_epoch();
  }

  /// The next scan is not compared with the scans before it, as after a correction of the poses.
  void start_epoch() {
    const detail::ReentrancyGuard::Guard guard(pipeline().guard());
    pipeline().start_epoch();
  }

  /// Restores the state after construction and clears the map; buffers keep their capacity.
  void reset() {
    const detail::ReentrancyGuard::Guard guard(pipeline().guard());
    pipeline().reset();
  }

 private:
  detail::RemoverPipeline<Stages>& pipeline() const {
    if (pipeline_ == nullptr) throw UsageError("this remover was moved from");
    return *pipeline_;
  }

  std::unique_ptr<detail::RemoverPipeline<Stages>> pipeline_;
};

using DynaInsRemover = BasicDynaInsRemover<>;

}  // namespace dynains
