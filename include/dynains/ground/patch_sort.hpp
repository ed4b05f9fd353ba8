// Sorts the points of a scan by patch.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/points.hpp"
#include "dynains/simd/pack_loops.hpp"
#include "dynains/simd/point_record.hpp"

namespace dynains::detail {

/// Stable counting sort: points of a patch keep the order of the scan.
///
/// Consecutive points often share a patch, so that an increment of its counter would have to wait
/// for the one before. The scan is therefore cut into strands with their own counters, and a few
/// points of each strand are sorted in turn.
template <std::size_t kPatches>
class PatchSort {
 public:
  /// `patch_of`: patch of each point, less than kPatches. `input`: index of each point in the input
  /// of the remover.
  void sort(PointsView points, const std::uint32_t* input, const std::int32_t* patch_of) {
    const std::size_t count = points.size();
    grow(sorted_, count + kMaxPackWidth);
    strand_length_ = count / (kStrands * kStep) * kStep;
    count_points(patch_of, count);
    add_up_counts();
    with_packs([&](auto) { move(points, input, patch_of); });
  }

  /// The points of all patches, with kMaxPackWidth more records behind them.
  PointRecord* records() { return sorted_.data(); }
  std::size_t begin(std::size_t patch) const { return begin_[patch]; }
  std::size_t end(std::size_t patch) const { return begin_[patch + 1]; }

 private:
  static constexpr std::size_t kStrands = 4;
  static constexpr std::size_t kHalves = 2 * kStrands;
  static constexpr std::size_t kStep = 4;   // points of a strand that are sorted in turn
  static constexpr std::size_t kAhead = 8;  // records from a write to the prefetched cache line
  static_assert(kStep % 2 == 0, "the length of a strand must be even");

  void count_points(const std::int32_t* patch_of, std::size_t count) {
    for (auto& counts : count_) counts.fill(0);
    const auto add = [&](std::size_t half, std::size_t i) {
      ++count_[half][static_cast<std::size_t>(patch_of[i])];
    };
    const std::size_t length = strand_length_ / 2;
    for (std::size_t i = 0; i < length; ++i) {
      for (std::size_t h = 0; h < kHalves; ++h) add(h, i + h * length);
    }
    for (std::size_t i = kHalves * length; i < count; ++i) add(kHalves - 1, i);
  }

  // Finds where each patch begins, and each strand within the patch.
  void add_up_counts() {
    PointRecord* to = sorted_.data();
    for (std::size_t p = 0; p < kPatches; ++p) {
      begin_[p] = static_cast<std::size_t>(to - sorted_.data());
      for (std::size_t s = 0; s < kStrands; ++s) {
        next_[s][p] = to;
        to += count_[2 * s][p] + count_[2 * s + 1][p];
      }
    }
    begin_[kPatches] = static_cast<std::size_t>(to - sorted_.data());
  }

  void move(PointsView points, const std::uint32_t* input, const std::int32_t* patch_of) {
    const std::size_t length = strand_length_;
    for (std::size_t i = 0; i < length; i += kStep) {
      for (std::size_t s = 0; s < kStrands; ++s) {
        const std::size_t first = i + s * length;
        const FourRegisters<4> records = load_records(points, input, first);
        for (std::size_t k = 0; k < kStep; ++k) {
          PointRecord*& to = next_[s][static_cast<std::size_t>(patch_of[first + k])];
          PointRecord* const here = to;
          store(records[k], here);
          to = here + 1;
          __builtin_prefetch(here + kAhead, 1);
        }
      }
    }
    for (std::size_t i = kStrands * length; i < points.size(); ++i) {
      PointRecord*& to = next_[kStrands - 1][static_cast<std::size_t>(patch_of[i])];
      *to++ = {points.x[i], points.y[i], points.z[i], input[i]};
    }
  }

  std::size_t strand_length_ = 0;
  std::array<std::array<std::uint32_t, kPatches>, kHalves> count_{};
  std::array<std::array<PointRecord*, kPatches>, kStrands> next_{};
  std::array<std::size_t, kPatches + 1> begin_{};
  std::vector<PointRecord> sorted_;
};

}  // namespace dynains::detail
