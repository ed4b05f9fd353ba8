// Reference scans: scans with a range image, against which other scans are tested.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "dynains/evidence/range_image.hpp"
#include "dynains/evidence/visibility.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/sensor/sensor_model.hpp"
#include "dynains/simd/pack_geometry.hpp"
#include "dynains/stage/free_space_config.hpp"
#include "dynains/stage/ground_split.hpp"

namespace dynains {

/// Distances (scans) from a scan to its references, before and after it. References are dense near
/// the scan and sparse far from it. The adjacent scans are excluded, because objects move little in
/// one scan.
inline constexpr std::array<int, 19> kReferenceLags = {2,  4,  6,  8,  10,  13,  16,  20,  25, 30,
                                                       40, 50, 65, 80, 100, 125, 150, 175, 200};

/// The lags (scans) of kReferenceLags up to `most`, each rounded up to a lag with lag % step ==
/// remainder; a result above `most` is rounded down instead. Ascending and unique. `remainder`: in
/// [0, `step`].
inline std::vector<int> reference_lags(int most, int remainder, int step) {
  const auto to_next = [&](int lag) { return ((remainder - lag) % step + step) % step; };
  const int last = most >= 0 ? most + to_next(most) - (to_next(most) > 0 ? step : 0) : 0;
  std::vector<int> lags;
  for (const int reference_lag : kReferenceLags) {
    if (reference_lag >= most + step) break;
    const int lag = std::min(reference_lag + to_next(reference_lag), last);
    if (lag > (lags.empty() ? 0 : lags.back())) lags.push_back(lag);
  }
  return lags;
}

/// A reference scan: its range image is evidence on other scans.
struct ReferenceScan {
  static constexpr std::uint64_t kNoEpoch = ~std::uint64_t{0};  ///< epoch without a valid image

  std::uint64_t scan = 0;
  std::uint64_t epoch = kNoEpoch;
  Eigen::Isometry3d T_world_beams = Eigen::Isometry3d::Identity();
  RangeImage image;
};

/// Position of a scan relative to the latest reference up to it.
struct ReferencePhase {
  std::uint64_t since_image = 0;  ///< scans since that reference, below `reference_step`
  std::uint64_t image = 0;        ///< number of its image
};

/// Ring buffer of the latest reference scans. The first scan of each epoch, and every scan that is
/// a multiple of `reference_step` scans after it, is a reference.
class ReferenceScans {
 public:
  explicit ReferenceScans(const FreeSpaceConfig& config)
      : margin_(static_cast<float>(config.margin)),
        margin_slope_(static_cast<float>(config.margin_slope)),
        lateral_margin_(static_cast<float>(config.lateral_margin)),
        step_(static_cast<std::uint64_t>(config.reference_step)),
        references_(
            static_cast<std::size_t>(std::max(config.lookback_scans, config.lookahead_scans)) /
                step_ +
            1) {}

  /// Sets the resolution of later images, and the tilt of their frame, for a sensor.
  void adapt(const SensorModel& sensor) {
    grid_ = RangeImageGrid::for_sensor(sensor);
    R_beams_level_.reset();
    if (!sensor.is_level()) R_beams_level_ = detail::transposed(sensor.R_level_headed);
  }

  /// Allocates the images for `scans` scans, at most the capacity of the ring buffer.
  void reserve(std::size_t scans) {
    const std::size_t images = grid_.rows > 0 ? std::min(scans / step_ + 1, references_.size()) : 0;
    for (std::size_t i = 1; i <= images; ++i) {
      references_[(images_ + i) % references_.size()].image.reserve(grid_);
    }
  }

  /// Invalidates all references.
  void forget() {
    for (ReferenceScan& reference : references_) reference.epoch = ReferenceScan::kNoEpoch;
  }

  /// Registers the next scan, `since_begin` scans after the first scan of its epoch. If
  /// `since_image` of the result is 0, the scan is a reference and requires make_image().
  ReferencePhase advance(std::uint64_t since_begin) {
    const std::uint64_t phase = since_begin % step_;
    if (phase == 0) {
      ++images_;
      current().epoch = ReferenceScan::kNoEpoch;  // until make_image()
    }
    return {phase, images_};
  }

  /// Makes the image of the newest reference in the tilted frame of the sensor, in which each beam
  /// is a row of the image. `scan`, `epoch`: numbers of the scan and of its epoch. `T_world_level`:
  /// pose of the frame of `split`. `moving`: by non-ground point, as in RangeImage::build().
  void make_image(std::uint64_t scan, std::uint64_t epoch, const Eigen::Isometry3d& T_world_level,
                  const GroundSplit& split, Span<const std::uint8_t> moving) {
    ReferenceScan& reference = current();
    reference.scan = scan;
    reference.T_world_beams = T_world_level;
    PointsView ground = split.ground();
    PointsView rest = split.non_ground();
    if (R_beams_level_) {
      reference.T_world_beams = detail::rotated(T_world_level, *R_beams_level_);
      ground = detail::rotate(ground, *R_beams_level_, rotated_ground_);
      rest = detail::rotate(rest, *R_beams_level_, rotated_rest_);
    }
    reference.image.build(grid_, ground, rest, moving, lateral_margin_, scratch_);
    reference.epoch = epoch;
  }

  /// Whether the newest reference has no image yet.
  bool awaits_image() const { return newest().epoch == ReferenceScan::kNoEpoch; }
  const ReferenceScan& newest() const { return references_[images_ % references_.size()]; }

  /// The reference `lag` scans after scan number `scan` (before it for a negative lag); null if
  /// there is none. `at`: phase of `scan`; at.since_image + lag is a multiple of the step.
  const ReferenceScan* find(std::uint64_t scan, std::uint64_t epoch, const ReferencePhase& at,
                            int lag) const {
    const auto signed_step = static_cast<std::int64_t>(step_);
    const std::int64_t to_image = lag + static_cast<std::int64_t>(at.since_image);
    const std::uint64_t image =
        at.image + static_cast<std::uint64_t>(to_image / signed_step);  // exact
    const ReferenceScan& reference = references_[image % references_.size()];
    const std::uint64_t reference_scan = scan + static_cast<std::uint64_t>(std::int64_t{lag});
    return reference.scan == reference_scan && reference.epoch == epoch ? &reference : nullptr;
  }

  /// Visibility of the first `count` points (m; padded for packs) from a reference. The result is
  /// valid until the next call.
  const detail::Visibility& test(const PointBuffer& points, std::size_t count,
                                 const Eigen::Isometry3d& T_world_points,
                                 const ReferenceScan& reference) {
    const Eigen::Isometry3d T_reference_points =
        detail::composed(detail::inverted(reference.T_world_beams), T_world_points);
    detail::test_visibility(reference.image, T_reference_points, points, count, margin_,
                            margin_slope_, visibility_);
    return visibility_;
  }

 private:
  ReferenceScan& current() { return references_[images_ % references_.size()]; }

  float margin_;
  float margin_slope_;
  float lateral_margin_;
  std::uint64_t step_;                     // scans from one image to the next
  std::vector<ReferenceScan> references_;  // ring buffer, by number of the image
  std::uint64_t images_ = 0;               // number of the newest image
  RangeImageGrid grid_;
  std::optional<Eigen::Matrix3d> R_beams_level_;  // if the sensor is tilted
  PointBuffer rotated_ground_;
  PointBuffer rotated_rest_;
  RangeImage::Scratch scratch_;
  detail::Visibility visibility_;
};

}  // namespace dynains
