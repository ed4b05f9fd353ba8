#include "chunk_grid.hpp"

#include <algorithm>

namespace dynains::program {

std::size_t default_chunk(std::size_t scans, std::size_t lookback, std::size_t lookahead) {
  constexpr std::size_t kTypical = 500;  // scans
  const std::size_t chunks = scans / kTypical;
  if (chunks < 2) return 0;
  // The first chunk has no warm-up, the last one nothing behind: of two chunks, the first one is
  // larger, so that both take equally long.
  const std::size_t extra = lookback > lookahead ? lookback - lookahead : 0;
  return (scans + extra + chunks - 1) / chunks;
}

std::vector<Chunk> chunk_grid(const ScanRange& range, const ChunkSettings& settings,
                              std::size_t lookahead) {
  std::vector<Chunk> chunks;
  std::size_t first = range.first;
  while (true) {
    // Differences instead of sums, which very large settings would overflow.
    const std::size_t own = std::min(settings.scans, range.last - first + 1);
    const std::size_t last = first + own - 1;
    const std::size_t before = std::min(settings.lookback, first - range.first);
    const std::size_t behind = std::min(lookahead, range.last - last);
    chunks.push_back({{first, last}, first - before, last + behind});
    if (last == range.last) return chunks;
    first = last + 1;
  }
}

std::optional<std::size_t> shared_scan(const Chunk& before, const Chunk& after) {
  if (after.first < after.own.first) return after.own.first - 1;
  if (before.last > before.own.last) return after.own.first;
  return std::nullopt;
}

}  // namespace dynains::program
