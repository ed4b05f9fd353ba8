// The loop of `dynains run`, over any remover.
#pragma once

#include <chrono>
#include <cstddef>
#include <deque>
#include <utility>

#include "dynains/io/recording.hpp"
#include "dynains/verdict.hpp"
#include "read_ahead.hpp"
#include "recorded_scans.hpp"
#include "run_results.hpp"
#include "run_timing.hpp"

namespace dynains::run {

/// Pushes scan i. Throws PoseError that names the scan.
template <class Remover>
FrameResult push_scan(Remover& remover, const Recording& recording, std::size_t i,
                      const RecordedScan& scan) {
  return naming_scan(recording, i, [&] {
    return remover.push(points_of(scan), recording.T_world_sensor(i), recording.time(i));
  });
}

inline double ms_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin)
      .count();
}

/// Pushes the scans of `range` and passes every verdict, and at the end the map, to `results`.
/// Scans wait in memory for their final verdict, unless they are many and a second reading is a
/// plain copy of their file (.bin).
/// Calls `keep_going(done)` after each scan; if it returns false, the sequence ends there.
template <class Remover, class KeepGoing>
RunTiming run_sequence(Remover& remover, const Recording& recording, const ScanRange& range,
                       RunResults& results, KeepGoing&& keep_going) {
  using Clock = std::chrono::steady_clock;
  RunTiming timing;
  ReadAhead reader(recording, range.first, range.last, results.thread());
  const bool are_kept = remover.latency() <= 8 || recording.format() != ScanFormat::kBin;
  std::deque<RecordedScan> kept;  // oldest first; the last one is the pushed scan
  RecordedScan spare;
  const auto take_oldest = [&] {
    spare = std::move(kept.front());
    kept.pop_front();
  };
  const auto take_final = [&](const ScanVerdict& verdict) {
    if (are_kept) take_oldest();
    results.take_final(are_kept ? &spare : nullptr, verdict);
  };
  for (std::size_t i = range.first; i <= range.last; ++i) {
    if (!are_kept && !kept.empty()) take_oldest();
    const RecordedScan& scan = kept.emplace_back(reader.next(std::exchange(spare, {})));
    const Clock::time_point begin = Clock::now();
    const FrameResult frame = push_scan(remover, recording, i, scan);
    timing.rows.push_back({recording.name(i), scan.size(), frame.times, ms_since(begin),
                           frame.began_epoch, frame.plausibility, recording.time(i)});
    if (const auto& residual = frame.pose_residual)
      timing.rows.back().pose_residual.emplace(residual->translation, residual->rotation);
    for (const std::uint8_t sensor : scan.sensor) ++timing.sensor_points[sensor];
    results.take_newest(frame);
    if (frame.finished) take_final(*frame.finished);
    if (!keep_going(timing.rows.size())) break;
  }

  double writing = 0.0;
  const Clock::time_point begin = Clock::now();
  remover.flush([&](const ScanVerdict& verdict) {
    const Clock::time_point begin_writing = Clock::now();
    take_final(verdict);
    writing += ms_since(begin_writing);
  });
  timing.flush = ms_since(begin) - writing;
  results.finish();
  timing.pipeline = timing.flush;
  for (const TimingRow& row : timing.rows) timing.pipeline += row.total;
  if (results.map_points()) {
    remover.map().for_each([&](const Eigen::Vector3d& point) { results.add_map_point(point); });
  }
  return timing;
}

}  // namespace dynains::run
