// Second pass over a recording: all of its scans test what the first pass called static.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "dynains/points.hpp"
#include "dynains/recording/byte_store.hpp"
#include "dynains/recording/returns.hpp"
#include "dynains/recording/verdict_arrays.hpp"
#include "dynains/recording/visit.hpp"
#include "dynains/verdict.hpp"

namespace dynains {

/// The first pass judges a scan by the scans around it: DynaInsRemover. The second one judges it by
/// all scans of its visit (see Returns). Poses are those by which the first pass compared the
/// scans. Its verdicts stay in a visit that is so short that it has compared all scans, and in one
/// with scans that it doubts.
///
/// Give all scans with their first verdicts to add(), call test(), and give all scans again to
/// revise(), in the same order. Not for several callers at once. All functions throw what the store
/// throws.
class SecondPass {
 public:
  /// References, and places and ground far from the sensor, wait in `store`, which outlives this.
  /// Throws ConfigError.
  explicit SecondPass(ByteStore& store, const SecondPassConfig& config = {});

  /// Takes the first verdict on a scan, in the order of the scans: FrameResult::finished. `points`:
  /// m, sensor frame, all of the scan. Throws UsageError if the sizes differ, if the scan is not
  /// the next one, or after test().
  void add(PointsView points, const ScanVerdict& verdict);
  /// Tests all places. Ends without a result if `keep_going()` returns false; then revise() changes
  /// nothing.
  void test(const std::function<bool()>& keep_going = [] { return true; });
  /// Revises the first verdict on scan `number`, counted from 0. Returns whether anything changed.
  /// Points that left have Cause::kCameOrWent, those that came back Cause::kStands or
  /// Cause::kGround. Throws UsageError if the arrays have not the size of `points`.
  bool revise(PointsView points, std::uint32_t number, VerdictArrays& verdict);

  /// Places that the sensor came back to after more scans than the first pass compares.
  const std::vector<ReturnToPlace>& returns() const { return returns_.found(); }
  /// Whether test() came to its end.
  bool is_decided() const { return is_decided_; }
  std::size_t place_count() const { return places_; }
  /// By revise().
  const RevisedPoints& revised() const { return revised_; }

 private:
  struct ScanOfVisit {
    std::uint32_t visit, number;  // of the scan in the visit
  };

  SecondPassConfig config_;
  ByteStore& store_;
  Returns returns_;
  std::vector<std::unique_ptr<Visit>> visits_;  // after test(): null if verdicts stay
  std::vector<ScanOfVisit> scans_;
  std::uint32_t latest_ = 0;  // visit of the last call
  std::size_t places_ = 0;
  RevisedPoints revised_;
  bool is_decided_ = false;
};

}  // namespace dynains
