#include "kept_points.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "dynains/errors.hpp"
#include "dynains/io/kitti.hpp"
#include "dynains/points.hpp"
#include "dynains/simd/pack_loops.hpp"
#include "io/sequential_file.hpp"
#include "run/labelled_sequence.hpp"

namespace dynains::program {
namespace {

/// Consecutive points of a scan, few enough for the fastest cache.
struct Block {
  static constexpr std::size_t kCapacity = 4096;

  std::array<float, kCapacity> x, y, z;        // m, sensor frame; 0 for points that are not static
  std::array<std::uint8_t, kCapacity> keep{};  // 1 for static points

  PointsView points(std::size_t count) const {
    return {{x.data(), count}, {y.data(), count}, {z.data(), count}};
  }
};

struct Faults {
  bool has_foreign_class = false;
  bool has_infinite_point = false;
};

/// Fills `block` with `count` points. No branch depends on a point.
Faults fill(const float* xyzi, const std::uint32_t* labels, std::size_t count, Block& block) {
  std::uint32_t foreign = 0;
  std::uint32_t infinite = 0;
  detail::with_largest_packs([&](auto) {
    // Local copies: a store of a byte could change what the loop reads, which prevents vectors.
    const std::size_t size = count;
    const std::uint32_t* const classes = labels;
    std::uint8_t* const keep = block.keep.data();
    std::uint32_t any_foreign = 0;
    std::uint32_t any_infinite = 0;
    for (std::size_t i = 0; i < size; ++i) {
      const std::uint32_t id = classes[i] & 0xffffU;
      const auto kept = static_cast<std::uint32_t>(id == kRunStatic);
      const std::uint32_t known = kept | static_cast<std::uint32_t>(id == kRunMoving) |
                                  static_cast<std::uint32_t>(id == kRunNotJudged);
      any_foreign |= known ^ 1U;
      keep[i] = static_cast<std::uint8_t>(kept);
    }
    for (std::size_t i = 0; i < count; ++i) {
      const float x = xyzi[4 * i];
      const float y = xyzi[4 * i + 1];
      const float z = xyzi[4 * i + 2];
      const bool is_kept = block.keep[i] != 0;
      block.x[i] = is_kept ? x : 0.0F;
      block.y[i] = is_kept ? y : 0.0F;
      block.z[i] = is_kept ? z : 0.0F;
    }
    constexpr float kMost = std::numeric_limits<float>::max();
    for (std::size_t i = 0; i < count; ++i) {
      any_infinite |= static_cast<std::uint32_t>(!(std::abs(block.x[i]) <= kMost)) |
                      static_cast<std::uint32_t>(!(std::abs(block.y[i]) <= kMost)) |
                      static_cast<std::uint32_t>(!(std::abs(block.z[i]) <= kMost));
    }
    foreign = any_foreign;
    infinite = any_infinite;
  });
  return {foreign != 0, infinite != 0};
}

/// The points of a scan, from the first to the last one. Points that a file holds as they are used
/// are read block by block, so that they stay in the cache.
class ScanPoints {
 public:
  /// `scan`: memory for points that need a conversion.
  ScanPoints(const Recording& recording, std::size_t i, RecordedScan& scan) {
    if (recording.is_verbatim()) {
      size_ = count_scan_points(recording.file(i));
      file_.emplace(recording.file(i), kValues * size_ * sizeof(float));
      block_.resize(kValues * Block::kCapacity);
      return;
    }
    recording.read_scan(i, scan);
    size_ = scan.size();
    rest_ = scan.xyzi.data();
  }

  std::size_t size() const { return size_; }

  /// x y z intensity of the next `count` points, at most Block::kCapacity; valid until the next
  /// call.
  const float* next(std::size_t count) {
    if (file_) {
      file_->read(block_.data(), kValues * count);
      return block_.data();
    }
    const float* const points = rest_;
    rest_ += kValues * count;
    return points;
  }

 private:
  static constexpr std::size_t kValues = 4;  // of a point

  std::size_t size_ = 0;
  std::optional<SequentialFile> file_;
  std::vector<float> block_;
  const float* rest_ = nullptr;
};

}  // namespace

void KeptPoints::insert_into(StaticMapAccumulator& map, std::size_t i, const Pose& T_world_sensor) {
  ScanPoints points(recording_, i, scan_);
  const std::filesystem::path file = labels_ / (recording_.name(i) + ".label");
  check_labels(file, points.size());
  SequentialFile labels(file, points.size() * sizeof(std::uint32_t));
  label_block_.resize(Block::kCapacity);

  Block block;
  for (std::size_t begin = 0; begin < points.size(); begin += Block::kCapacity) {
    const std::size_t count = std::min(Block::kCapacity, points.size() - begin);
    labels.read(label_block_.data(), count);
    const Faults faults = fill(points.next(count), label_block_.data(), count, block);
    if (faults.has_foreign_class) {
      for (std::size_t k = 0; k < count; ++k) run_class(label_block_[k], begin + k, file);
    }
    if (faults.has_infinite_point) {
      throw IoError(file.string() +
                    ": has static points whose coordinates are not finite; expected labels of a "
                    "run over these scans");
    }
    map.insert(block.points(count), {block.keep.data(), count}, T_world_sensor);
  }
}

}  // namespace dynains::program
