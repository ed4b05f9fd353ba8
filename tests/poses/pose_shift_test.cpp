#include "poses/pose_shift.hpp"

#include "support/catch.hpp"

using namespace dynains;

namespace {

/// Gaps in a valley whose bottom is at `bottom`, deeper by `depth` for every scan.
ShiftedGaps valley(int bottom, double depth) {
  ShiftedGaps gaps{};
  for (std::size_t k = 0; k < gaps.size(); ++k) {
    const int away = static_cast<int>(k) - kFarthestShift - bottom;
    gaps[k] = 0.3 + depth * (away < 0 ? -away : away);
  }
  return gaps;
}

std::vector<ShiftedGaps> pairs_of(std::size_t count, int bottom, double depth) {
  return std::vector<ShiftedGaps>(count, valley(bottom, depth));
}

}  // namespace

TEST_CASE(
    "poses are shifted if enough pairs agree better by a margin, and only within a small shift") {
  for (const int shift : {-2, -1, 1, 2}) CHECK(best_shift(pairs_of(12, shift, 0.02)) == shift);
  CHECK(best_shift(pairs_of(12, 0, 0.02)) == 0);
  CHECK(best_shift(pairs_of(12, 2, 0.004)) == 0);
  CHECK(best_shift(pairs_of(kLeastShiftPairs, 1, 0.02)) == 1);
  CHECK(best_shift(pairs_of(kLeastShiftPairs - 1, 1, 0.02)) == 0);
  // A minimum beyond the largest shift has another cause.
  CHECK(best_shift(pairs_of(12, 3, 0.02)) == 0);
  CHECK(best_shift(pairs_of(12, -3, 0.02)) == 0);
  CHECK(best_shift({}) == 0);
}

TEST_CASE("poses are not shifted where pairs contradict each other") {
  std::vector<ShiftedGaps> pairs = pairs_of(12, 1, 0.02);
  for (std::size_t i = 0; i < 4; ++i) pairs.push_back(valley(-1, 0.004));
  CHECK(best_shift(pairs) == 1);
  pairs.push_back(valley(-1, 0.004));
  CHECK(best_shift(pairs) == 0);

  // A single pair does not prove a shift, even with the greatest possible gain.
  pairs = pairs_of(12, 1, 0.0015);
  CHECK(best_shift(pairs) == 0);
  pairs.push_back(valley(1, 0.3));
  CHECK(best_shift(pairs) == 0);
}
