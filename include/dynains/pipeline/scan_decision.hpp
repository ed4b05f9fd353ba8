// The interface of what calls points dynamic.
#pragma once

#include <cstddef>

#include "dynains/pipeline/scan_ring.hpp"
#include "dynains/pipeline/scan_slot.hpp"
#include "dynains/pipeline/scan_window.hpp"
#include "dynains/pipeline/stage_timer.hpp"
#include "dynains/pipeline/verdict_writer.hpp"
#include "dynains/sensor/sensor_model.hpp"

namespace dynains::detail {

/// Collects evidence about scans and decides which of their points are dynamic. For each scan:
/// observe(), then judge_newest(), then, latency() scans later, judge_final().
template <class Map>
class ScanDecision {
 public:
  virtual ~ScanDecision() = default;

  /// Scans whose points are clustered together.
  virtual std::size_t window_length() const = 0;
  /// Scans between observe() and judge_final().
  virtual std::size_t latency() const = 0;

  virtual bool needs_sensor() const = 0;
  virtual void adapt(const SensorModel& sensor) = 0;
  /// Gets memory for so many scans. Called after some scans were observed that are forgotten then.
  virtual void reserve(std::size_t scans) = 0;

  /// Takes the newest scan in, and gives each of its clusters an instance id.
  virtual void observe(ScanRing& scans, const ScanWindow& window, StageTimer& timer) = 0;
  /// Verdict on the newest scan from what is known without later scans. The writer has begun it.
  virtual void judge_newest(ScanSlot& newest, VerdictWriter& writer, StageTimer& timer) = 0;
  /// Verdict that later scans do not change any more.
  virtual void judge_final(ScanSlot& scan, VerdictWriter& writer, StageTimer& timer) = 0;

  /// Takes points out of the map whose place the newest scan sees free.
  virtual void revise(Map& /*map*/, const ScanSlot& /*newest*/) {}
  /// Back to the state after construction, but for capacity.
  virtual void clear() = 0;
};

}  // namespace dynains::detail
