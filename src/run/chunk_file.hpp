// The result of one chunk in a file, as long as the run lasts.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "dynains/io/atomic_file.hpp"
#include "dynains/points.hpp"
#include "dynains/static_map_accumulator.hpp"
#include "dynains/verdict.hpp"
#include "instance_numbers.hpp"
#include "label_counts.hpp"
#include "overview.hpp"
#include "run_timing.hpp"
#include "verdict_arrays.hpp"
#include "verdict_runs.hpp"

namespace dynains::program {

/// Identifies a chunk. A file with another key is not used.
struct ChunkKey {
  std::uint64_t request = 0;  ///< fingerprint of the request of the run
  std::uint64_t first = 0;    ///< index of the first own scan
  std::uint64_t scans = 0;    ///< number of own scans
};

/// The final verdict on one scan, with ids of the chunk. Each array has one value per point, or is
/// empty if no output needs it.
struct ChunkScan : VerdictArrays {
  std::vector<PointLabel> online;  ///< labels of the first verdict
  std::vector<char> moving;        ///< bytes of PointRecords whose labels are ids
};

/// Results of a chunk, except the verdicts on its scans and its map.
struct ChunkSummary {
  std::uint64_t points = 0;
  LabelCounts labels;
  ChunkInstances instances;
  std::vector<Overview::Place> overview;
  RunTiming timing;  ///< of the own scans
};

/// Checksum of a sequence of words of 8 bytes. Four sums take turns, so that none waits for itself.
class Checksum {
 public:
  /// `size`: bytes of whole words.
  void add(const char* data, std::size_t size);
  std::uint64_t value() const;

 private:
  std::array<std::uint64_t, 4> sums_{};
  std::size_t next_ = 0;  // sum of the next word
};

/// Writes scan after scan; the file appears whole, at finish(), or not at all. Throws IoError.
class ChunkFileWriter {
 public:
  ChunkFileWriter(const std::filesystem::path& file, const ChunkKey& key);

  /// To be called for each own scan in order.
  void add(const ChunkScan& scan);
  void finish(const ChunkSummary& summary, const StaticMapAccumulator& map);

 private:
  AtomicFile file_;
  VerdictRuns runs_;
  std::uint64_t position_ = 0;
  Checksum checksum_;

  void write(const void* data, std::size_t size);
  template <class T>
  void put(Span<const T> values);
  void put_number(std::uint64_t value);
};

/// Reads a file of ChunkFileWriter. All members throw IoError with path and reason.
class ChunkFileReader {
 public:
  /// Checks version and key.
  ChunkFileReader(std::filesystem::path file, const ChunkKey& key);

  /// Throws unless the checksum is that of the content. Reads the whole file.
  void verify();

  /// @name The next of the own scans
  /// @{
  void next(ChunkScan& scan);
  /// Only the verdict, of which `scan` gets `beliefs` and `online`.
  void next_runs(VerdictRuns& runs, ChunkScan& scan);
  /// Only ChunkScan::moving.
  void next_moving(std::vector<char>& moving);
  /// @}
  /// Ends the scans.
  ChunkSummary read_summary();
  /// Adds the points of the map to `map`. To be called once, after read_summary().
  void add_map(StaticMapAccumulator& map);

 private:
  std::filesystem::path path_;
  std::ifstream file_;
  VerdictRuns runs_;
  std::uint64_t size_ = 0;
  std::uint64_t summary_ = 0;   // position
  std::uint64_t checksum_ = 0;  // as the file says
  std::uint64_t position_ = 0;

  [[noreturn]] void fail(const std::string& reason) const;
  void read(void* data, std::size_t size);
  void seek(std::uint64_t position);
  /// Number of bytes of what comes next.
  std::uint64_t get_size();
  void get_verdict(VerdictRuns& runs, ChunkScan& scan);
  template <class T>
  void get(std::vector<T>& values);
  std::uint64_t get_number();
};

}  // namespace dynains::program
