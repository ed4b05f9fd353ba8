// The points of a scan that are not judged.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/points.hpp"
#include "dynains/simd/bits.hpp"

namespace dynains::detail {

/// The marked points of a cloud are not judged. Two bits per point.
class UnjudgedPoints {
 public:
  /// Number of points of the cloud.
  std::size_t size() const { return size_; }

  /// Begins a cloud of `size` points without a mark.
  void reset(std::size_t size) {
    size_ = size;
    for (std::vector<std::uint64_t>* const words : {&unjudged_, &returns_}) {
      ensure_capacity(*words, size / kWordBits + 1);
      words->assign(size / kWordBits + 1, 0);
    }
  }

  /// Marks the points `first` + k whose bit k is set in `unjudged`. `returns`: bits of those among
  /// them that are kOutOfRange; the others are kInvalid. No bit reaches beyond the next multiple of
  /// kWordBits.
  void mark(std::size_t first, std::uint64_t unjudged, std::uint64_t returns) {
    unjudged_[first / kWordBits] |= unjudged << first % kWordBits;
    returns_[first / kWordBits] |= returns << first % kWordBits;
  }

  /// Calls `visit(i, label)` for each marked point in order.
  template <class Visit>
  void for_each(Visit&& visit) const {
    for (std::size_t word = 0; word < unjudged_.size(); ++word) {
      for_each_bit(unjudged_[word], [&](std::size_t bit) {
        const bool is_return = (returns_[word] >> bit & 1U) != 0;
        visit(word * kWordBits + bit, is_return ? PointLabel::kOutOfRange : PointLabel::kInvalid);
      });
    }
  }

 private:
  std::size_t size_ = 0;
  std::vector<std::uint64_t> unjudged_, returns_;
};

}  // namespace dynains::detail
