// The interface by which the facade calls the pipeline, and those of the stages that a user may
// replace, with a readable error for each:
//
//   Ground      void segment(PointsView scan, Span<const uint32_t> input, GroundSplit& split)
//   Clusterer   Span<const uint32_t> cluster(PolarView points); size_t cluster_count() const
//   Descriptor  void describe(const ClusterView&); void describe_rest();
//               Span<const float> heights(size_t k) const, cluster_heights(size_t k) const;
//               bool proposes_dynamic() const
//   Belief      void reset(); void update(Span<const float> heights, Span<const float> cluster);
//               double posterior() const; bool is_dynamic() const
//   Map         void insert(PointsView points, Span<const uint8_t> keep, const Pose&
//   T_world_points);
//               void clear()
//
// Lengths are in m, angles in rad. Points are in the level frame of the newest scan, except for
// Map: in that of their own scan, with `keep` 1 for static points. `scan`: all valid points, and
// `input` their index in the pushed cloud; `split`: ground points first, with their `input`.
// cluster(): for each point a number below cluster_count(), or kNoCluster. heights(k): of scan k of
// the window by cell, cluster_heights(k): their maximum over scans 0 to k. What a stage is given is
// valid during the call alone, what it gives until its next call that is not const.
//
// Each stage has a Config, with visit() and validate(), and a constructor that takes it. It may
// have `bool needs_sensor() const` and `void adapt(const SensorModel&)`, called before the first
// scan that the sensor is known for.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <type_traits>
#include <utility>

#include "dynains/clusters/cluster_set.hpp"
#include "dynains/config.hpp"
#include "dynains/errors.hpp"
#include "dynains/point_cloud_traits.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/sensor/sensor_model.hpp"
#include "dynains/verdict.hpp"

namespace dynains::detail {

// Members of stages, for Offers.
template <class Stage>
using GroundMembers = decltype(std::declval<Stage&>().segment(
    PointsView(), Span<const std::uint32_t>(), std::declval<GroundSplit&>()));
template <class Stage>
using ClustererMembers =
    decltype(Span<const std::uint32_t>(std::declval<Stage&>().cluster(PolarView())),
             std::size_t(std::declval<Stage&>().cluster_count()));
template <class Stage>
using DescriptorMembers =
    decltype(std::declval<Stage&>().describe(std::declval<const ClusterView&>()),
             std::declval<Stage&>().describe_rest(),
             Span<const float>(std::declval<Stage&>().heights(std::size_t{})),
             Span<const float>(std::declval<Stage&>().cluster_heights(std::size_t{})),
             bool(std::declval<Stage&>().proposes_dynamic()));
template <class Stage>
using BeliefMembers =
    decltype(std::declval<Stage&>().reset(),
             std::declval<Stage&>().update(Span<const float>(), Span<const float>()),
             double(std::declval<Stage&>().posterior()), bool(std::declval<Stage&>().is_dynamic()));
template <class Stage>
using MapMembers = decltype(std::declval<Stage&>().insert(PointsView(), Span<const std::uint8_t>(),
                                                          std::declval<const Pose&>()),
                            std::declval<Stage&>().clear());
template <class Stage>
using NeedsSensor = decltype(std::declval<const Stage&>().needs_sensor());
template <class Stage>
using Adapt = decltype(std::declval<Stage&>().adapt(SensorModel()));

/// Fails to compile, with a sentence, unless all stages have their members.
template <class Stages>
constexpr bool check_stages() {
  static_assert(Offers<GroundMembers, typename Stages::Ground>::value,
                "Stages::Ground needs void segment(PointsView, Span<const std::uint32_t>, "
                "GroundSplit&)");
  static_assert(Offers<ClustererMembers, typename Stages::Clusterer>::value,
                "Stages::Clusterer needs Span<const std::uint32_t> cluster(PolarView) and "
                "std::size_t cluster_count() const");
  static_assert(Offers<DescriptorMembers, typename Stages::Descriptor>::value,
                "Stages::Descriptor needs void describe(const ClusterView&), void describe_rest(), "
                "Span<const float> heights(std::size_t) const, the same for cluster_heights, and "
                "bool proposes_dynamic() const");
  static_assert(Offers<BeliefMembers, typename Stages::Belief>::value,
                "Stages::Belief needs void reset(), void update(Span<const float>, Span<const "
                "float>), double posterior() const and bool is_dynamic() const");
  static_assert(Offers<MapMembers, typename Stages::Map>::value,
                "Stages::Map needs void insert(PointsView, Span<const std::uint8_t>, const Pose&) "
                "and void clear()");
  return true;
}

/// Whether a stage wants adapt(sensor).
template <class Stage>
bool needs_sensor(const Stage& stage) {
  if constexpr (Offers<NeedsSensor, Stage>::value) {
    return stage.needs_sensor();
  } else {
    return false;
  }
}
template <class Stage>
void adapt_stage(Stage& stage, const SensorModel& sensor) {
  if constexpr (Offers<Adapt, Stage>::value) stage.adapt(sensor);
}

/// Admits one call at a time. A concurrent or nested call throws before it changes any state. The
/// end of a call synchronizes with the begin of the next one (release and acquire).
class ReentrancyGuard {
 public:
  /// Scope of one call. Throws UsageError during another call.
  class Guard {
   public:
    explicit Guard(ReentrancyGuard& owner) : owner_(owner) {
      if (owner_.is_busy_.exchange(true, std::memory_order_acquire)) {
        throw UsageError(
            "DynaInsRemover: no call may begin while another one is at work; take one object for "
            "each thread, or a lock");
      }
    }
    ~Guard() { owner_.is_busy_.store(false, std::memory_order_release); }
    Guard(const Guard&) = delete;
    Guard& operator=(const Guard&) = delete;

   private:
    ReentrancyGuard& owner_;
  };

 private:
  std::atomic<bool> is_busy_{false};
};

/// Implementation of BasicDynaInsRemover, with the same calls and errors. An interface, so that
/// files that use a compiled remover include no stages.
template <class Stages>
class RemoverPipeline {
 public:
  virtual ~RemoverPipeline() = default;
  /// For the scope of a call by the user.
  ReentrancyGuard& guard() { return guard_; }
  virtual const PipelineConfig<Stages>& config() const = 0;
  virtual const typename Stages::Map& map() const = 0;
  virtual std::size_t latency() const = 0;
  virtual const SensorModel& sensor() const = 0;
  virtual FrameResult push(const CloudView& cloud, const Pose& T_world_sensor,
                           std::optional<double> time) = 0;
  /// Makes the verdict on the oldest open scan final. Empty if no scan is open.
  virtual std::optional<ScanVerdict> finish_oldest() = 0;
  virtual void start_epoch() = 0;
  virtual void reserve_like(const CloudView& example, std::size_t scans) = 0;
  virtual void reset() = 0;

 private:
  ReentrancyGuard guard_;
};

}  // namespace dynains::detail
