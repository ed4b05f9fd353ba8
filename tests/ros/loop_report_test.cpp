#include "ros_common/loop_report.hpp"

#include "support/catch.hpp"

namespace dynains_ros {
namespace {

using Level = Diagnosis::Level;

LoopCounts ten_clouds() {
  LoopCounts counts;
  counts.arrived = counts.taken = 10;
  counts.busy = 0.25;
  counts.slowest = 0.0305;
  return counts;
}

std::string value_of(const Diagnosis& diagnosis, const std::string& name) {
  const auto found = std::find_if(diagnosis.values.begin(), diagnosis.values.end(),
                                  [&](const auto& value) { return value.first == name; });
  return found == diagnosis.values.end() ? "missing" : found->second;
}

TEST_CASE("a report has the rates and times of its period") {
  LoopCounts counts = ten_clouds();
  counts.residuals = 4;
  counts.residual = 0.01;
  const Diagnosis diagnosis = diagnose(counts, {123, 4, 1}, {2, 5000}, 2.0);
  CHECK(diagnosis.level == Level::kOk);
  CHECK(diagnosis.message == "clouds are cleaned");
  CHECK(value_of(diagnosis, "arriving (Hz)") == "5.0");
  CHECK(value_of(diagnosis, "cleaned (Hz)") == "5.0");
  CHECK(value_of(diagnosis, "time per scan (ms)") == "25.0");
  CHECK(value_of(diagnosis, "slowest scan (ms)") == "30.5");
  CHECK(value_of(diagnosis, "load (%)") == "12");
  CHECK(value_of(diagnosis, "waiting") == "2");
  CHECK(value_of(diagnosis, "mean residual (mm)") == "2.5");
  CHECK(value_of(diagnosis, "points of the map") == "5000");
  CHECK(value_of(diagnosis, "cleaned since the start") == "123");
  CHECK(value_of(diagnosis, "left out since the start") == "4");
  CHECK(value_of(diagnosis, "resets since the start") == "1");
}

TEST_CASE("clouds that only wait are not cleaned, and not wrong yet") {
  LoopCounts counts;
  counts.arrived = 1;
  const Diagnosis diagnosis = diagnose(counts, {}, {}, 1.0);
  CHECK(diagnosis.level == Level::kOk);
  CHECK(diagnosis.message == "clouds wait for transforms");
}

TEST_CASE("a report tells what is wrong") {
  const auto check = [](auto&& change, Level level, const std::string& message) {
    LoopCounts counts = ten_clouds();
    LoopState state;
    change(counts, state);
    const Diagnosis diagnosis = diagnose(counts, {}, state, 1.0);
    CHECK(diagnosis.level == level);
    CHECK(diagnosis.message == message);
  };
  check([](auto& counts, auto&) { counts = LoopCounts(); }, Level::kWarn, "no cloud arrives");
  const auto drop = [](LoopCounts& counts, Drop why, std::size_t count) {
    counts.dropped[static_cast<std::size_t>(why)] = count;
  };
  check(
      [&](auto& counts, auto&) {
        drop(counts, Drop::kOverflow, 2);
        drop(counts, Drop::kNoTransform, 3);
        counts.last_reason = "no frame 'odom'";
      },
      Level::kWarn, "clouds are left out: 2 queue full, 3 no transform (no frame 'odom')");
  check(
      [&](auto& counts, auto&) {
        counts.taken = 0;
        drop(counts, Drop::kInvalid, 10);
      },
      Level::kError, "no cloud is taken: 10 refused");
  check(
      [](auto& counts, auto& state) {
        state.suspicion = dynains::Suspicion::kPoses;
        counts.misfits = 1;
      },
      Level::kError,
      "scans do not fit to each other: check the transforms; "
      "poses that do not fit to their scans: 1");
  check([](auto&, auto& state) { state.time_doubt = dynains::TimeDoubt::kTooFast; }, Level::kWarn,
        "stamps are less than 1 ms apart");
  check([](auto& counts, auto&) { counts.failures = 2; }, Level::kWarn,
        "messages that could not be published: 2");
}

}  // namespace
}  // namespace dynains_ros
