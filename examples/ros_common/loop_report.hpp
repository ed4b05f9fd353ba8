// The report of a node: it counts clouds since the last report, and lists problems. It uses no type
// of ROS.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "dynains/parameters.hpp"
#include "dynains/verdict.hpp"
#include "ros_common/cloud_queue.hpp"

namespace dynains_ros {

/// Counts of a period, and the state at its end.
struct LoopCounts {
  std::size_t arrived = 0;
  std::size_t taken = 0;
  std::array<std::size_t, kDropReasons> dropped = {};  ///< by Drop
  std::string last_reason;                             ///< of the newest cloud that was left out
  double busy = 0.0;                                   ///< s, in the remover and in publishers
  double slowest = 0.0;                                ///< s, of one cloud
  double latency = 0.0;                                ///< s, from stamps to results, sum
  std::size_t lost = 0;                                ///< clouds without a pose by the odometry
  std::string loss;                                    ///< why, of the newest one
  std::size_t misfits = 0;                             ///< scans whose pose does not fit
  std::size_t failures = 0;                            ///< messages that could not be published
  std::size_t residuals = 0;
  double residual = 0.0;  ///< m, sum

  std::size_t left_out() const {
    std::size_t sum = 0;
    for (const std::size_t count : dropped) sum += count;
    return sum;
  }
};

/// Totals since the start.
struct LoopTotals {
  std::uint64_t taken = 0;
  std::uint64_t left_out = 0;
  std::uint64_t resets = 0;  ///< jumps of the time backwards
};

struct LoopState {
  std::size_t waiting = 0;
  std::size_t map_points = 0;
  dynains::Suspicion suspicion = dynains::Suspicion::kNone;
  dynains::TimeDoubt time_doubt = dynains::TimeDoubt::kNone;
};

/// A report. The numbers of the levels are those of diagnostic_msgs/DiagnosticStatus.
struct Diagnosis {
  enum class Level : std::uint8_t { kOk = 0, kWarn = 1, kError = 2 };

  Level level = Level::kOk;
  std::string message;
  std::vector<std::pair<std::string, std::string>> values;
};

inline const char* text_of(Drop reason) {
  constexpr std::array<const char*, kDropReasons> kTexts = {"late", "queue full", "no transform",
                                                            "before a jump of the time", "refused"};
  return kTexts[static_cast<std::size_t>(reason)];
}

inline const char* text_of(dynains::Suspicion suspicion) {
  switch (suspicion) {
    case dynains::Suspicion::kUnits:
      return "nearly no point can be judged: check the unit and the frame of the points";
    case dynains::Suspicion::kPoses:
      return "scans do not fit to each other: check the transforms";
    case dynains::Suspicion::kRays:
      return "beams pass through what is static: check the origin of the sensor and the "
             "times of points";
    default:
      return "";
  }
}

inline const char* text_of(dynains::TimeDoubt doubt) {
  switch (doubt) {
    case dynains::TimeDoubt::kTooSlow:
      return "stamps are too far apart: no scans are compared";
    case dynains::TimeDoubt::kTooFast:
      return "stamps are less than 1 ms apart";
    default:
      return "";
  }
}

namespace detail {

inline std::string decimal(double value, int digits) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

inline std::string drops_text(const LoopCounts& counts) {
  std::string text;
  for (std::size_t i = 0; i < kDropReasons; ++i) {
    if (counts.dropped[i] == 0) continue;
    text += (text.empty() ? "" : ", ") + std::to_string(counts.dropped[i]) + ' ' +
            text_of(static_cast<Drop>(i));
  }
  return text + (counts.last_reason.empty() ? "" : " (" + counts.last_reason + ')');
}

/// The level and the message of a report: all that is wrong.
inline void add_problems(const LoopCounts& counts, const LoopState& state, Diagnosis& diagnosis) {
  using Level = Diagnosis::Level;
  const auto report = [&diagnosis](Level level, const std::string& text) {
    diagnosis.level = std::max(diagnosis.level, level);
    diagnosis.message += (diagnosis.message.empty() ? "" : "; ") + text;
  };
  if (counts.arrived == 0) report(Level::kWarn, "no cloud arrives");
  if (counts.left_out() > 0) {
    if (counts.taken == 0) {
      report(Level::kError, "no cloud is taken: " + drops_text(counts));
    } else {
      report(Level::kWarn, "clouds are left out: " + drops_text(counts));
    }
  }
  if (state.suspicion != dynains::Suspicion::kNone) report(Level::kError, text_of(state.suspicion));
  if (state.time_doubt != dynains::TimeDoubt::kNone) {
    report(Level::kWarn, text_of(state.time_doubt));
  }
  if (counts.lost > 0) {
    report(Level::kError, "track is lost: " + std::to_string(counts.lost) +
                              " clouds pass with their moving points (" + counts.loss + ')');
  }
  if (counts.misfits > 0) {
    report(Level::kWarn, "poses that do not fit to their scans: " + std::to_string(counts.misfits));
  }
  if (counts.failures > 0) {
    report(Level::kWarn,
           "messages that could not be published: " + std::to_string(counts.failures));
  }
  if (diagnosis.message.empty()) {
    diagnosis.message = counts.taken > 0 ? "clouds are cleaned" : "clouds wait for transforms";
  }
}

}  // namespace detail

/// Report of a period of `seconds`.
inline Diagnosis diagnose(const LoopCounts& counts, const LoopTotals& totals,
                          const LoopState& state, double seconds) {
  Diagnosis result;
  detail::add_problems(counts, state, result);
  const auto add = [&result](const std::string& name, std::string value) {
    result.values.emplace_back(name, std::move(value));
  };
  const double period = std::max(seconds, 1e-3);
  const auto rate = [period](std::size_t count) {
    return detail::decimal(static_cast<double>(count) / period, 1);
  };
  const auto mean_thousandths = [](double sum, std::size_t count) {
    return count == 0 ? "none" : detail::decimal(1e3 * sum / static_cast<double>(count), 1);
  };
  add("arriving (Hz)", rate(counts.arrived));
  add("cleaned (Hz)", rate(counts.taken));
  add("time per scan (ms)", mean_thousandths(counts.busy, counts.taken));
  add("slowest scan (ms)", detail::decimal(1e3 * counts.slowest, 1));
  add("load (%)", detail::decimal(100.0 * counts.busy / period, 0));
  for (std::size_t i = 0; i < kDropReasons; ++i) {
    add(std::string("left out: ") + text_of(static_cast<Drop>(i)),
        std::to_string(counts.dropped[i]));
  }
  add("waiting", std::to_string(state.waiting));
  add("mean residual (mm)", mean_thousandths(counts.residual, counts.residuals));
  add("suspicion", dynains::plain_value(state.suspicion));
  add("points of the map", std::to_string(state.map_points));
  add("cleaned since the start", std::to_string(totals.taken));
  add("left out since the start", std::to_string(totals.left_out));
  add("resets since the start", std::to_string(totals.resets));
  add("latency (ms)", mean_thousandths(counts.latency, counts.taken));
  add("lost", std::to_string(counts.lost));
  return result;
}

}  // namespace dynains_ros
