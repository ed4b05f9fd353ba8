// Lists of points that are longer than the memory.
#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include "dynains/io/atomic_file.hpp"
#include "tile_point.hpp"

namespace dynains::viewer {

/// Keeps lists of points in one temporary file, which ends with this object. All members throw
/// IoError.
class PointSpill {
 public:
  /// The temporary file is that of an AtomicFile with this target, which is never written.
  explicit PointSpill(const std::filesystem::path& target);

  /// A list; its last points are in memory. Belongs to one spill.
  class List {
   public:
    std::size_t size() const { return size_; }

   private:
    friend class PointSpill;
    std::vector<std::size_t> blocks_;  // numbers of blocks in the file
    std::vector<TilePoint> rest_;
    std::size_t size_ = 0;
  };

  void add(List& list, const TilePoint& point);
  /// All points in the order in which they were added. The list is empty afterwards.
  std::vector<TilePoint> take(List& list);

 private:
  static constexpr std::size_t kBlock = 1024;  // points

  std::filesystem::path target_;
  AtomicFile file_;
  std::size_t blocks_ = 0;                // in the file
  std::vector<std::size_t> free_blocks_;  // used again
};

}  // namespace dynains::viewer
