// Second pass over a recording: verdicts by the scans of the whole recording.
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

/// The first pass (DynaInsRemover) judges a scan by the scans around it, the second pass by all
/// scans of its visit (see Returns), under the poses by which the first pass compared them
/// (ScanVerdict::compared). Verdicts of the first pass are kept in a visit so short that the first
/// pass has compared all of its scans, and in a visit with suspicious scans (see Plausibility).
///
/// Give all scans with their first verdicts to add(), call test(), and give all scans again to
/// revise(), in the same order. One thread at a time. All functions throw IoError if the
/// store fails.
class SecondPass {
 public:
  /// `store` holds references, and places and ground far from the sensor; it must outlive this
  /// object. Throws ConfigError.
  explicit SecondPass(ByteStore& store, const SecondPassConfig& config = {});

  /// Takes the first verdict on a scan, in the order of the scans: FrameResult::finished. `points`:
  /// m, sensor frame, all of the scan. Throws UsageError if the sizes differ, if the scan is not
  /// the next one, or after test(). `sensor_of`: by point; empty: the first sensor.
  void add(PointsView points, const ScanVerdict& verdict, Span<const std::uint8_t> sensor_of = {});
  /// Tests all places. Ends without a result if `keep_going()` returns false; then revise() changes
  /// nothing.
  void test(const std::function<bool()>& keep_going = [] { return true; });
  /// Revises the first verdict on scan `number`, counted from 0. Returns whether anything changed.
  /// Removed points get Cause::kCameOrWent, restored ones Cause::kStands or Cause::kGround.
  /// `points`: m, sensor frame, all of the scan. Throws UsageError if the arrays differ in size
  /// from `points`.
  bool revise(PointsView points, std::uint32_t number, VerdictArrays& verdict);

  /// Returns of the sensor to a place after more scans than the first pass compares.
  const std::vector<ReturnToPlace>& returns() const { return returns_.found(); }
  /// Whether test() was completed.
  bool is_decided() const { return is_decided_; }
  /// Number of tested places (cubes of 0.4 m); 0 before test().
  std::size_t place_count() const { return places_; }
  /// Numbers of points that revise() has removed and restored so far.
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
