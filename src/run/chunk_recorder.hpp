// Takes the verdicts of a remover on a chunk, and gives those that belong to it to its file.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "chunk_file.hpp"
#include "chunk_grid.hpp"
#include "dynains/io/point_records.hpp"
#include "dynains/io/recording.hpp"
#include "dynains/points.hpp"
#include "dynains/static_map_accumulator.hpp"
#include "dynains/verdict.hpp"
#include "overview.hpp"
#include "run_timing.hpp"

namespace dynains::program {

/// Which results of a chunk its run needs.
struct ChunkOutputs {
  bool with_beliefs = false;
  bool with_online = false;
  bool with_map = true;
  StaticMapAccumulator::Config map;
  PointColumns moving;  ///< columns of moving points
};

/// Number of points of each instance in one scan.
class InstancePoints {
 public:
  void count(Span<const PointLabel> labels, Span<const std::uint32_t> instances);
  /// Calls `visit(id, is_dynamic)` for each instance; dynamic are those with more dynamic points
  /// than others.
  template <class Visit>
  void for_each(Visit&& visit) const {
    for (const std::uint32_t id : ids_) visit(id, 2 * dynamic_[id] > all_[id]);
  }

 private:
  std::vector<std::uint32_t> ids_;            // in the order of their first points
  std::vector<std::uint32_t> all_, dynamic_;  // by id; 0 for those that are not in ids_
};

class ChunkRecorder {
 public:
  /// `shared_before`, `shared_behind`: see shared_scan(). `path`: positions of the sensor of the
  /// whole run. The writer outlives this.
  ChunkRecorder(const Chunk& chunk, std::optional<std::size_t> shared_before,
                std::optional<std::size_t> shared_behind, const std::vector<Eigen::Vector3d>& path,
                const ChunkOutputs& outputs, ChunkFileWriter& writer);

  /// The first verdict on scan `i` of the recording, just pushed.
  void take_newest(std::size_t i, TimingRow row, const ScanVerdict& verdict);
  /// The final verdict on own scan `i`. Throws IoError.
  void take_final(std::size_t i, const RecordedScan& scan, const ScanVerdict& verdict);
  /// The instances of the shared scans, in the place of those from take_newest().
  void take_shared(std::vector<std::uint32_t> before, std::vector<std::uint32_t> behind);
  void add_pipeline_time(double ms) { summary_.timing.pipeline += ms; }

  /// Own scans with a final verdict.
  std::size_t finished() const { return finished_; }
  /// Finishes the file. To be called after all own scans. Throws IoError.
  void finish();

 private:
  bool is_own(std::size_t i) const { return i >= chunk_.own.first && i <= chunk_.own.last; }
  void count_instances(std::size_t i, const ScanVerdict& verdict);
  void add_moving_points(const RecordedScan& scan, const ScanVerdict& verdict);
  void add_to_map(const RecordedScan& scan, const ScanVerdict& verdict);

  Chunk chunk_;
  std::optional<std::size_t> shared_before_, shared_behind_;
  ChunkOutputs outputs_;
  ChunkFileWriter& writer_;
  ChunkSummary summary_;
  Overview overview_;
  StaticMapAccumulator map_;
  std::deque<std::vector<PointLabel>> open_online_;
  std::size_t finished_ = 0;
  InstancePoints points_;
  std::set<std::uint32_t> ids_before_;                 // in the shared scan before
  std::set<std::uint32_t> still_before_;               // static in an own scan
  std::map<std::uint32_t, std::size_t> moving_scans_;  // of the last own scans, by id
  ChunkScan record_;
  PointRecords moving_;
  PointBuffer kept_;
};

}  // namespace dynains::program
