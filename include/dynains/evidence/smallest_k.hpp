// The least of what is met, row by row, without a branch.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

namespace dynains::detail {

/// Rows of numbers, in the order of the ranks that they were added with: each keeps as many as it
/// may, of those with the least. Numbers of one rank are in their own order.
class SmallestK {
 public:
  /// `most`: of each row, 1 or more.
  explicit SmallestK(std::size_t most) : most_(most), pairs_per_row_((most + 1) / 2) {}

  /// Leaves all rows empty.
  void clear() { pairs_.assign(pairs_.size(), kEmpty); }

  /// Makes sure that there are so many rows; new ones are empty.
  void make_rows(std::size_t count) {
    const std::size_t pairs = count * pairs_per_row_;
    if (pairs_.size() < pairs) pairs_.resize(pairs + pairs / 8, kEmpty);
  }

  /// Adds a number to a row, whose last one goes if it was full. Each place takes the lesser of
  /// what stands there and the greater of the new one and what stood before it: no branch, which
  /// would be taken for every third point of a scan, and never foreseen.
  void add(std::size_t row, std::uint32_t rank, std::uint32_t number) {
    const double key = key_of(rank, number);
    const Pair keys = {key, key};
    Pair* const pairs = &pairs_[row * pairs_per_row_];
    for (std::size_t p = pairs_per_row_ - 1;; --p) {
      const Pair here = pairs[p];
      const Pair before = p > 0 ? pairs[p - 1] : Pair{0.0, 0.0};
      const Pair predecessors = {before[1], here[0]};
      const Pair moved = predecessors > keys ? predecessors : keys;
      pairs[p] = here < moved ? here : moved;
      if (p == 0) return;
    }
  }

  /// How many numbers a row has at most.
  std::size_t most() const { return most_; }

  /// How many numbers the row has.
  std::size_t count(std::size_t row) const {
    std::size_t count = 0;
    for (std::size_t k = 0; k < most_; ++k) count += key(row, k) < kNone ? 1 : 0;
    return count;
  }

  /// The k-th number of a row; 0 if there are not so many.
  std::uint32_t number(std::size_t row, std::size_t k) const {
    const double wanted = key(row, k);
    std::uint64_t bits;
    std::memcpy(&bits, &wanted, sizeof(bits));
    return static_cast<std::uint32_t>(bits);
  }

 private:
  using Pair = double __attribute__((vector_size(16)));
  static constexpr double kNone = 2.0;  // above all keys, and zeros where a number would be
  static constexpr Pair kEmpty = {kNone, kNone};

  // Doubles, since baseline x86-64 finds the lesser of no other numbers of 64 bits. The rank, but
  // for its last three bits, is in their upper half, which makes a normal number between 0 and 2.
  static double key_of(std::uint32_t rank, std::uint32_t number) {
    const std::uint64_t bits = std::uint64_t{0x20000000U + (rank >> 3)} << 32 | number;
    double key;
    std::memcpy(&key, &bits, sizeof(key));
    return key;
  }

  double key(std::size_t row, std::size_t k) const {
    return pairs_[row * pairs_per_row_ + k / 2][k % 2];
  }

  std::size_t most_;
  std::size_t pairs_per_row_;
  std::vector<Pair> pairs_;
};

}  // namespace dynains::detail
