// What references saw: range images of some of the last scans.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "dynains/evidence/range_image.hpp"
#include "dynains/evidence/visibility.hpp"
#include "dynains/points.hpp"
#include "dynains/sensor/rotation.hpp"
#include "dynains/sensor/sensor_model.hpp"
#include "dynains/stage/free_space_config.hpp"
#include "dynains/stage/ground_split.hpp"

namespace dynains {

/// The image of one reference.
struct ReferenceScan {
  static constexpr std::uint64_t kNoEpoch = ~std::uint64_t{0};

  std::uint64_t scan = 0;
  std::uint64_t epoch = kNoEpoch;
  Eigen::Isometry3d T_world_beams = Eigen::Isometry3d::Identity();
  RangeImage image;
};

/// Where a scan stands among the references of its time.
struct ReferencePhase {
  std::uint64_t phase = 0;  ///< scans since the newest image ...
  std::uint64_t image = 0;  ///< ... and its number
};

/// Owns the images of as many references as are ever asked for. Of each epoch, the first scan and
/// every `reference_step`-th after it is a reference.
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

  /// Chooses the resolution of images, which are those of the sensor as it is tilted.
  void adapt(const SensorModel& sensor) {
    grid_ = RangeImageGrid::for_sensor(sensor);
    R_beams_level_.reset();
    if (!sensor.is_level()) R_beams_level_ = sensor.R_level_headed.transpose();
  }

  /// Gets the memory of the images of that many scans, or of as many as are ever kept.
  void reserve(std::size_t scans) {
    const std::size_t images = grid_.rows > 0 ? std::min(scans / step_ + 1, references_.size()) : 0;
    for (std::size_t i = 1; i <= images; ++i) {
      references_[(images_ + i) % references_.size()].image.reserve(grid_);
    }
  }

  void forget() {
    for (ReferenceScan& view : references_) view.epoch = ReferenceScan::kNoEpoch;
  }

  /// Counts the next scan, `since_begin` scans behind the first of its epoch. It is a reference,
  /// whose image is to be made, if its phase is 0.
  ReferencePhase advance(std::uint64_t since_begin) {
    const std::uint64_t phase = since_begin % step_;
    if (phase == 0) {
      ++images_;
      view().epoch = ReferenceScan::kNoEpoch;  // until its image is whole
    }
    return {phase, images_};
  }

  /// Makes the image of a reference. Beams are rows of it only in the frame of the sensor, tilted
  /// as it is; `T_world_level`: pose of the frame of `split`; `moving`: as RangeImage::build has
  /// it, by point above the ground.
  void make_image(std::uint64_t scan, std::uint64_t epoch, const Eigen::Isometry3d& T_world_level,
                  const GroundSplit& split, Span<const std::uint8_t> moving) {
    ReferenceScan& view = this->view();
    view.scan = scan;
    view.T_world_beams = T_world_level;
    PointsView ground = split.ground();
    PointsView rest = split.non_ground();
    if (R_beams_level_) {
      view.T_world_beams.rotate(R_beams_level_->transpose());
      const Eigen::Matrix3f R = R_beams_level_->cast<float>();
      ground = detail::turn(ground, R, turned_ground_);
      rest = detail::turn(rest, R, turned_rest_);
    }
    view.image.build(grid_, ground, rest, moving, lateral_margin_, scratch_);
    view.epoch = epoch;
  }

  /// Whether the newest reference has no image yet.
  bool awaits_image() const { return newest().epoch == ReferenceScan::kNoEpoch; }
  const ReferenceScan& newest() const { return references_[images_ % references_.size()]; }

  /// The image that was made `lag` scans after a scan, or before it; null if there is none.
  /// `at`: the phase of that scan; phase and lag make a multiple of the step.
  const ReferenceScan* find(std::uint64_t scan, std::uint64_t epoch, const ReferencePhase& at,
                            int lag) const {
    const auto signed_step = static_cast<std::int64_t>(step_);
    const std::int64_t to_image = lag + static_cast<std::int64_t>(at.phase);
    const std::uint64_t image =
        at.image + static_cast<std::uint64_t>(to_image / signed_step);  // exact
    const ReferenceScan& view = references_[image % references_.size()];
    const std::uint64_t wanted = scan + static_cast<std::uint64_t>(std::int64_t{lag});
    return view.scan == wanted && view.epoch == epoch ? &view : nullptr;
  }

  /// What a reference saw of the first `count` points (m; padded for wide loads). Holds until the
  /// next call.
  const detail::Visibility& look(const PointBuffer& points, std::size_t count,
                                 const Eigen::Isometry3d& T_world_points,
                                 const ReferenceScan& reference) {
    const Eigen::Isometry3d T_reference_points = reference.T_world_beams.inverse() * T_world_points;
    detail::test_visibility(reference.image, T_reference_points.cast<float>(), points, count,
                            margin_, margin_slope_, visibility_);
    return visibility_;
  }

 private:
  ReferenceScan& view() { return references_[images_ % references_.size()]; }

  float margin_;
  float margin_slope_;
  float lateral_margin_;
  std::uint64_t step_;  // scans from one image to the next
  std::vector<ReferenceScan> references_;
  std::uint64_t images_ = 0;  // number of the newest
  RangeImageGrid grid_;
  std::optional<Eigen::Matrix3d> R_beams_level_;  // of a sensor that is tilted
  PointBuffer turned_ground_;
  PointBuffer turned_rest_;
  RangeImage::Scratch scratch_;
  detail::Visibility visibility_;
};

}  // namespace dynains
