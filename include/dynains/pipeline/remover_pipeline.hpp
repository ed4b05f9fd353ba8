// The interface by which the facade calls the pipeline.
#pragma once

#include <atomic>
#include <cstddef>
#include <optional>

#include "dynains/config.hpp"
#include "dynains/errors.hpp"
#include "dynains/point_cloud_traits.hpp"
#include "dynains/pose.hpp"
#include "dynains/sensor/sensor_model.hpp"
#include "dynains/verdict.hpp"

namespace dynains::detail {

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
