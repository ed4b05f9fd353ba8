// Measures where the time of one frame goes.
#pragma once

#include <chrono>

#include "dynains/stage/stage_times.hpp"

namespace dynains::detail {

/// Measures the stages of one call.
class StageTimer {
 public:
  const StageTimes& times() const { return times_; }

  /// Runs `work` and adds its time to a field of times().
  template <class Work>
  void measure(double StageTimes::*stage, Work&& work) {
    const auto begin = std::chrono::steady_clock::now();
    work();
    const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - begin;
    times_.*stage += time.count();
  }

 private:
  StageTimes times_;
};

}  // namespace dynains::detail
