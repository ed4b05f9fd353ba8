// Division of a recording into chunks, which can be processed apart from each other.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "scan_range.hpp"

namespace dynains::program {

/// A run of scans that is processed apart from the others.
struct Chunk {
  ScanRange own;      ///< scans whose verdicts belong to the chunk
  std::size_t first;  ///< index of the first scan of the warm-up; own.first without a warm-up
  std::size_t last;   ///< index of the last scan, inclusive, that a verdict on the own scans uses
};

/// How a recording is divided.
struct ChunkSettings {
  std::size_t scans = 0;     ///< own scans of a chunk; 0: the recording is one stream
  std::size_t lookback = 0;  ///< scans of the warm-up
};

/// Default of ChunkSettings::scans for a recording of that many scans: 0 for a short one. Does not
/// depend on the machine. `lookback`, `lookahead`: as in chunk_grid().
std::size_t default_chunk(std::size_t scans, std::size_t lookback, std::size_t lookahead);

/// The chunks of a range in order; their own scans cover it. `lookahead`: scans behind a scan
/// that its final verdict uses. `settings.scans` is not 0.
std::vector<Chunk> chunk_grid(const ScanRange& range, const ChunkSettings& settings,
                              std::size_t lookahead);

/// Index of a scan that both `before` and its successor `after` process, by which their instances
/// are linked: the one before the border, or else the one behind it.
std::optional<std::size_t> shared_scan(const Chunk& before, const Chunk& after);

}  // namespace dynains::program
