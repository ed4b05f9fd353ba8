// Reference scans: scans with a range image, against which other scans are tested.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "dynains/evidence/free_space_config.hpp"
#include "dynains/evidence/range_image.hpp"
#include "dynains/evidence/visibility.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/sensor/sensor_model.hpp"
#include "dynains/simd/pack_geometry.hpp"

namespace dynains::detail {

/// Distances (scans) from a scan to its references, before and after it. References are dense near
/// the scan and sparse far from it. The adjacent scans are excluded, because objects move little in
/// one scan.
inline constexpr std::array<int, 19> kReferenceLags = {2,  4,  6,  8,  10,  13,  16,  20,  25, 30,
                                                       40, 50, 65, 80, 100, 125, 150, 175, 200};

/// Whether a scan is compared with the reference that is `age` scans away, if references are
/// `spacing` scans apart and at most `most` scans away: the nearest one behind some lag above
/// `above`. The farthest one also serves lags behind it.
inline bool is_compared(int age, int spacing, int most, int above = 0) {
  const auto lag = std::upper_bound(kReferenceLags.begin(), kReferenceLags.end(),
                                    std::max(age - spacing, above));
  const int last = age + spacing > most ? most + spacing - 1 : age;
  return age > above && age <= most && lag != kReferenceLags.end() && *lag <= last;
}

/// Which scans are references, and for how long. Every `step`-th scan of an epoch is a reference
/// for the scans up to `near` after it, and every `sparse_step`-th one up to `lookback`: images of
/// long ago would take most of the memory.
struct ReferenceSpan {
  static constexpr int kDense = 30;       // scans
  static constexpr int kSparseStep = 10;  // scans

  explicit ReferenceSpan(const FreeSpaceConfig& config)
      : step(config.reference_step),
        sparse_step(step * std::max(kSparseStep / step, 1)),
        lookback(config.lookback_scans),
        near(std::max(config.lookahead_scans, std::min(lookback, kDense + step - 1))) {}

  int step;         ///< scans
  int sparse_step;  ///< scans, a multiple of `step`
  int lookback;     ///< scans
  int near;         ///< scans

  /// Largest number of references that are needed at a time.
  std::size_t count() const {
    const int dense = near / step + 1;
    const int sparse = lookback > near ? (lookback - near) / sparse_step + 1 : 0;
    return static_cast<std::size_t>(dense) + static_cast<std::size_t>(sparse);
  }
  /// Whether a scan, `since_begin` scans after the first one of its epoch, is compared with the one
  /// `age` scans before it.
  bool compares(std::uint64_t since_begin, int age) const {
    const int spacing = age <= near ? step : sparse_step;
    if ((since_begin - static_cast<std::uint64_t>(age)) % static_cast<std::uint64_t>(spacing) != 0)
      return false;
    return age <= near ? is_compared(age, spacing, std::min(lookback, near))
                       : is_compared(age, spacing, lookback, near);
  }
  /// Whether a reference is needed by scans `age` (scans) after it.
  bool needs(std::uint64_t since_begin, std::uint64_t age) const {
    const bool is_sparse = since_begin % static_cast<std::uint64_t>(sparse_step) == 0;
    return age <= static_cast<std::uint64_t>(is_sparse ? std::max(lookback, near) : near);
  }
};

/// A reference scan: its range image is evidence on other scans.
struct ReferenceScan {
  static constexpr std::uint64_t kNoEpoch = ~std::uint64_t{0};  ///< epoch without a valid image

  std::uint64_t scan = 0;
  std::uint64_t since_begin = 0;  ///< scans since the first scan of the epoch
  std::uint64_t epoch = kNoEpoch;
  Pose T_world_beams = Pose::Identity();
  RangeImage image;
};

/// The reference scans that are still needed, see ReferenceSpan. The first scan of each epoch, and
/// every scan that is a multiple of `reference_step` scans after it, is a reference.
class ReferenceScans {
 public:
  explicit ReferenceScans(const FreeSpaceConfig& config)
      : margin_(static_cast<float>(config.margin)),
        margin_slope_(static_cast<float>(config.margin_slope)),
        lateral_margin_(static_cast<float>(config.lateral_margin)),
        span_(config),
        references_(span_.count()) {}

  /// Sets the resolution of later images, and the tilt of their frame, for a sensor. Allocates all
  /// images.
  void adapt(const SensorModel& sensor) {
    grid_ = RangeImageGrid::for_sensor(sensor);
    for (ReferenceScan& reference : references_) reference.image.allocate(grid_);
    R_beams_level_.reset();
    if (!sensor.is_level()) R_beams_level_ = transposed(sensor.R_level_headed);
  }

  const ReferenceSpan& span() const { return span_; }

  /// Invalidates all references.
  void forget() {
    for (ReferenceScan& reference : references_) reference.epoch = ReferenceScan::kNoEpoch;
  }

  /// Adds a reference in the place of one that is not needed any more. Its image is in the tilted
  /// frame of the sensor, in which each beam is a row. `scan`, `epoch`: numbers of the scan and of
  /// its epoch. `since_begin`: scans since the first scan of the epoch, a multiple of
  /// `reference_step`. `T_world_level`: pose of the frame of `split`. `moving`: by non-ground
  /// point, as in RangeImage::build().
  void add(std::uint64_t scan, std::uint64_t epoch, std::uint64_t since_begin,
           const Pose& T_world_level, const GroundSplit& split, Span<const std::uint8_t> moving) {
    const auto unneeded =
        std::find_if(references_.begin(), references_.end(), [&](const ReferenceScan& reference) {
          return reference.epoch != epoch ||
                 !span_.needs(reference.since_begin, scan - reference.scan);
        });
    newest_ = static_cast<std::size_t>(unneeded - references_.begin());
    ReferenceScan& reference = *unneeded;
    reference.scan = scan;
    reference.epoch = epoch;
    reference.since_begin = since_begin;
    reference.T_world_beams = T_world_level;
    PointsView ground = split.ground();
    PointsView rest = split.non_ground();
    if (R_beams_level_) {
      reference.T_world_beams = rotated(T_world_level, *R_beams_level_);
      ground = rotate(ground, *R_beams_level_, rotated_ground_);
      rest = rotate(rest, *R_beams_level_, rotated_rest_);
    }
    reference.image.build(grid_, ground, rest, moving, lateral_margin_, scratch_);
  }

  const ReferenceScan& newest() const { return references_[newest_]; }

  /// The reference that is scan number `scan` of an epoch; null if there is none.
  const ReferenceScan* find(std::uint64_t scan, std::uint64_t epoch) const {
    for (const ReferenceScan& reference : references_) {
      if (reference.scan == scan && reference.epoch == epoch) return &reference;
    }
    return nullptr;
  }

  /// Visibility of the first `count` points (m; padded for packs) from a reference. Returns `out`.
  const Visibility& test(const PointBuffer& points, std::size_t count, const Pose& T_world_points,
                         const ReferenceScan& reference, Visibility& out) const {
    const Pose T_reference_points = composed(inverted(reference.T_world_beams), T_world_points);
    test_visibility(reference.image, T_reference_points, points, count, margin_, margin_slope_,
                    out);
    return out;
  }

 private:
  float margin_;
  float margin_slope_;
  float lateral_margin_;
  ReferenceSpan span_;
  std::vector<ReferenceScan> references_;
  std::size_t newest_ = 0;  // index of the newest reference
  RangeImageGrid grid_;
  std::optional<Eigen::Matrix3d> R_beams_level_;  // if the sensor is tilted
  PointBuffer rotated_ground_;
  PointBuffer rotated_rest_;
  RangeImage::Scratch scratch_;
};

}  // namespace dynains::detail
