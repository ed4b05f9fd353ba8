// Rows of numbers that keep those of the smallest ranks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

namespace dynains::detail {

/// Rows of numbers. Each row keeps the numbers of the smallest ranks, sorted by rank, and by number
/// for equal ranks. The last three bits of a rank are ignored.
class SmallestK {
 public:
  /// `most`: maximum size of a row, at least 1.
  explicit SmallestK(std::size_t most) : most_(most), pairs_per_row_((most + 1) / 2) {}

  /// Empties all rows.
  void clear() { pairs_.assign(pairs_.size(), kEmpty); }

  /// Makes at least `count` rows; new rows are empty.
  void make_rows(std::size_t count) {
    const std::size_t pairs = count * pairs_per_row_;
    if (pairs_.size() < pairs) pairs_.resize(pairs + pairs / 8, kEmpty);
  }

  /// Adds a number to a row; removes the last number of a full row. Each key of the row becomes
  /// min(key, max(new key, preceding key)). This insertion has no branch, because a branch would
  /// depend on every third point of a scan and would not be predictable.
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

  /// Maximum size of a row.
  std::size_t most() const { return most_; }

  /// Size of a row.
  std::size_t count(std::size_t row) const {
    std::size_t count = 0;
    for (std::size_t k = 0; k < most_; ++k) count += key(row, k) < kNone ? 1 : 0;
    return count;
  }

  /// The k-th number of a row, k below most(); 0 if the row has fewer numbers.
  std::uint32_t number(std::size_t row, std::size_t k) const {
    const double wanted = key(row, k);
    std::uint64_t bits;
    std::memcpy(&bits, &wanted, sizeof(bits));
    return static_cast<std::uint32_t>(bits);
  }

 private:
  using Pair = double __attribute__((vector_size(16)));
  static constexpr double kNone = 2.0;  // above all keys; its lower 32 bits are zero
  static constexpr Pair kEmpty = {kNone, kNone};

  // A key is a double, since baseline x86-64 has no other minimum of 64-bit numbers. Its upper half
  // contains the rank without the last three bits, its lower half the number. The exponent bits
  // make it a normal number between 0 and 2.
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
