// The loop over the scans of a chunk, over any remover.
#pragma once

#include <chrono>
#include <cstddef>
#include <utility>

#include "chunk_grid.hpp"
#include "chunk_recorder.hpp"
#include "run_sequence.hpp"

namespace dynains::program {

/// Pushes the scans of a chunk of `range` and passes every verdict to `recorder`, which has all own
/// scans then. The remover begins as a new one, with the model of the sensor from the first scan of
/// the range, so that chunks differ in nothing but their scans. Calls `keep_going()` after each
/// scan; if it returns false, the chunk ends there, unfinished. Returns whether it is finished.
/// One thread does it all: others work on other chunks.
template <class Remover, class KeepGoing>
bool run_chunk(Remover& remover, const Recording& recording, const ScanRange& range,
               const Chunk& chunk, ChunkRecorder& recorder, KeepGoing&& keep_going) {
  using Clock = std::chrono::steady_clock;
  remover.reset();
  const std::size_t extra = chunk.first > range.first ? 1 : 0;
  const auto push = [&](std::size_t i, const RecordedScan& scan) {
    const Clock::time_point begin = Clock::now();
    const FrameResult frame = push_scan(remover, recording, i, scan);
    const double ms = ms_since(begin);
    recorder.add_pipeline_time(ms);
    return std::make_pair(frame, ms);
  };
  OpenScans scans(recording, {chunk.first, chunk.last}, chunk.own, remover.latency(),
                  std::launch::deferred);
  RecordedScan judged;
  const auto finish = [&](const ScanVerdict& verdict) {
    if (verdict.scan < extra) return;
    const std::size_t i = chunk.first + verdict.scan - extra;
    if (i >= chunk.own.first && i <= chunk.own.last) {
      const RecordedScan* const kept = scans.next_judged();
      if (kept == nullptr) recording.read_scan(i, judged);
      recorder.take_final(i, kept == nullptr ? judged : *kept, verdict);
    }
  };
  if (extra > 0) push(range.first, recording.read_scan(range.first));

  for (std::size_t i = chunk.first; i <= chunk.last; ++i) {
    const RecordedScan& scan = scans.next();
    const auto [frame, ms] = push(i, scan);
    TimingRow row = timing_row(recording.name(i), scan.size(), ms, frame);
    recorder.take_newest(i, std::move(row), frame.newest);
    if (frame.finished) finish(*frame.finished);
    if (!keep_going()) return false;
  }
  if (recorder.finished() < chunk.own.size()) {
    const Clock::time_point begin = Clock::now();
    double writing = 0.0;
    remover.flush([&](const ScanVerdict& verdict) {
      const Clock::time_point begin_writing = Clock::now();
      finish(verdict);
      writing += ms_since(begin_writing);
    });
    recorder.add_pipeline_time(ms_since(begin) - writing);
  }
  return true;
}

}  // namespace dynains::program
