// DynaInsRemover: scans and poses in, verdicts and a static map out. Units that include this header
// link dynains::remover, which holds the default stages compiled; dyna_ins_remover.hpp needs no
// library and takes other stages.
#pragma once

#include <Eigen/Geometry>
#include <atomic>
#include <cstddef>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "dynains/belief_updater.hpp"
#include "dynains/config.hpp"
#include "dynains/curved_voxel_clusterer.hpp"
#include "dynains/errors.hpp"
#include "dynains/occupancy_descriptor.hpp"
#include "dynains/point_cloud_traits.hpp"
#include "dynains/points.hpp"
#include "dynains/sensor/sensor_model.hpp"
#include "dynains/static_map_accumulator.hpp"
#include "dynains/verdict.hpp"

namespace dynains::detail {

/// Admits one call at a time. A second one, from another thread or from within the first, throws
/// before it changes anything. The next call sees the writes of the last one, also from another
/// thread.
class ReentrancyGuard {
 public:
  ReentrancyGuard() = default;
  ~ReentrancyGuard() = default;
  // Objects are moved between calls only.
  ReentrancyGuard(ReentrancyGuard&&) noexcept {}
  ReentrancyGuard& operator=(ReentrancyGuard&&) noexcept { return *this; }

  /// One call, from construction to destruction. Throws UsageError during another one.
  class Guard {
   public:
    explicit Guard(ReentrancyGuard& owner) : owner_(owner) {
      if (owner_.at_work_.exchange(true, std::memory_order_acquire)) {
        throw UsageError(
            "DynaInsRemover: push, flush, reset and reserve must not be called while one of them "
            "is at work; take one object for each thread, or a lock");
      }
    }
    ~Guard() { owner_.at_work_.store(false, std::memory_order_release); }
    Guard(const Guard&) = delete;
    Guard& operator=(const Guard&) = delete;

   private:
    ReentrancyGuard& owner_;
  };

 private:
  std::atomic<bool> at_work_{false};
};

}  // namespace dynains::detail

namespace dynains {

namespace detail {
template <class Stages>
class Pipeline;
}  // namespace detail

/// The stages of the pipeline. To swap one, derive from this and re-alias its name.
struct DefaultStages {
  using Ground = GroundSegmenter;
  using Clusterer = CurvedVoxelClusterer;
  using Descriptor = OccupancyDescriptor;
  using Belief = BeliefUpdater;
  using Evidence = FreeSpaceEvidence;
  using Map = StaticMapAccumulator;
};

/// Removes moving instances from a stream of scans, one scan at a time.
///
/// Owns every buffer; once warm, a frame allocates nothing except when the map grows. Objects are
/// independent of each other. One object serves one thread at a time: `push`, `flush`, `reset`,
/// `reserve` and `reserve_like` throw UsageError while another of these calls runs. The map and the
/// spans of a verdict are read between two calls: by the thread that makes them, or by others under
/// a lock that also covers the calls. Can be moved; an object that was moved from can be assigned
/// to or destroyed, all else throws UsageError.
template <class Stages = DefaultStages>
class BasicDynaInsRemover {
 public:
  using Map = typename Stages::Map;
  /// All parameters, see RemoverConfig and the Config of each stage.
  using Config = PipelineConfig<Stages>;

  BasicDynaInsRemover();
  /// Throws ConfigError.
  explicit BasicDynaInsRemover(const Config& config);
  BasicDynaInsRemover(BasicDynaInsRemover&&) noexcept;
  BasicDynaInsRemover& operator=(BasicDynaInsRemover&&) noexcept;
  ~BasicDynaInsRemover();

  const Config& config() const;
  const Map& map() const;

  /// Scans between a push and the final verdict on it.
  std::size_t latency() const;

  /// What the first scan told about the sensor. Not known() before the first scan, or if every
  /// parameter that depends on the sensor was given.
  const SensorModel& sensor() const;

  /// Allocates and touches the memory for scans like `example`, so that the first scans need not
  /// wait for the system to provide it: 27 to 38 bytes per point for each scan whose verdict is
  /// open, and the memory of the stages, which process the example some times and forget it.
  /// `scans`: how many will come, if that is known. Scans of other sizes may follow; results do not
  /// change. Throws UsageError after the first push.
  template <class Cloud>
  void reserve_like(const Cloud& example,
                    std::size_t scans = std::numeric_limits<std::size_t>::max()) {
    reserve_view(detail::CloudView(example), scans);
  }

  /// Reserves memory for scans of `points` points, by a synthetic scan of a 64-beam sensor.
  void reserve(std::size_t points);

  /// Processes one scan.
  ///
  /// `cloud`: m, sensor frame, z up (tilts are found, see RemoverConfig::level); any type that
  /// PointCloudTraits describe, of any size. Bad points get a label of their own.
  /// `T_world_sensor`: pose of the sensor at that scan. `time`: s, greater than that of the scan
  /// before.
  ///
  /// Throws PoseError, or what reading the cloud throws, and then leaves the state as it was. If a
  /// stage throws (std::bad_alloc), the scan does not count and the next one starts a new epoch, as
  /// behind a gap; evidence that the scan gave on older scans may remain. If a scan that becomes
  /// final throws, for example in the map, the final verdict on that scan alone is lost.
  template <class Cloud>
  FrameResult push(const Cloud& cloud, const Eigen::Isometry3d& T_world_sensor, double time) {
    return push_view(detail::CloudView(cloud), T_world_sensor, time);
  }

  /// Pushes a scan 0.1 s after the scan before (one step of a double if that is more); the first at
  /// 0 s.
  template <class Cloud>
  FrameResult push(const Cloud& cloud, const Eigen::Isometry3d& T_world_sensor) {
    return push_view(detail::CloudView(cloud), T_world_sensor, std::nullopt);
  }

  /// Makes the verdicts on all open scans final, oldest first, and calls `sink` with the
  /// ScanVerdict of each. The next push starts a new epoch.
  template <class Sink>
  void flush(Sink&& sink) {
    const detail::ReentrancyGuard::Guard guard(reentrancy_guard_);
    while (const std::optional<ScanVerdict> verdict = finish_oldest()) sink(*verdict);
    start_epoch();
  }

  /// Back to the state after construction, with an empty map; buffers keep their capacity. A
  /// TiledStaticMap removes its files, also those of earlier runs. To start again and keep the map,
  /// construct a new remover.
  void reset();

 private:
  using Pipeline = detail::Pipeline<Stages>;

  Pipeline& pipeline() const;
  FrameResult push_view(const detail::CloudView& cloud, const Eigen::Isometry3d& T_world_sensor,
                        std::optional<double> time);
  void reserve_view(const detail::CloudView& example, std::size_t scans);
  std::optional<ScanVerdict> finish_oldest();
  void start_epoch();

  std::unique_ptr<Pipeline> pipeline_;
  detail::ReentrancyGuard reentrancy_guard_;
};

using DynaInsRemover = BasicDynaInsRemover<>;

}  // namespace dynains
