// Reference scans: scans with a range image, against which other scans are tested.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
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

/// Number of consecutive scans whose beams see an object of 25 cm at 20 m, at least 1: one of a
/// sensor with dense rows, several of one that is sparse or does not repeat its pattern. `most`:
/// limit.
inline int scans_to_see_things(const SensorModel& sensor, int most) {
  constexpr double kThing = 0.0125 / kRadians;  // deg
  const double scans = sensor.azimuth_step * sensor.elevation_gap / (kThing * kThing);
  return static_cast<int>(std::clamp(std::round(scans), 1.0, static_cast<double>(most)));
}

/// Which scans are references, and for how long. Every `step`-th scan of an epoch is a reference
/// for the scans up to `near` after it, and every `sparse_step`-th one up to `lookback`: images of
/// long ago would take most of the memory.
struct ReferenceSpan {
  static constexpr int kDense = 30;       // scans
  static constexpr int kSparseStep = 10;  // scans

  /// `scans`: of one reference.
  explicit ReferenceSpan(const FreeSpaceConfig& config, int scans = 1)
      : step(std::max(config.reference_step, scans)),
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

/// The range image of one sensor of a scan.
struct ReferenceView {
  std::uint64_t scan = 0;
  Pose T_world_beams = Pose::Identity();
  RangeImage image;
};

/// A reference scan: the range images of its sensors, and of some scans before it, are evidence on
/// other scans.
struct ReferenceScan {
  static constexpr std::uint64_t kNoEpoch = ~std::uint64_t{0};  ///< epoch without a valid image

  std::uint64_t scan = 0;
  std::uint64_t since_begin = 0;  ///< scans since the first scan of the epoch
  std::uint64_t epoch = kNoEpoch;
  Pose T_world_level = Pose::Identity();
  std::vector<ReferenceView> views;  ///< by scan, then by sensor
  std::size_t count = 0;             ///< of the views that have images
};

/// The reference scans that are still needed, see ReferenceSpan. The first scan of each epoch, and
/// every scan that is a multiple of ReferenceSpan::step scans after it, is a reference.
class ReferenceScans {
 public:
  explicit ReferenceScans(const FreeSpaceConfig& config)
      : config_(config), span_(config), references_(span_.count()) {}

  /// Sets the resolution of later images, their frames, and the number of scans of a reference, for
  /// the sensors of a scan. If this number changes, all references are invalid. Allocates all
  /// images.
  void adapt(Span<const SensorModel> sensors) {
    grids_.clear();
    T_level_beams_.clear();
    viewpoint_.setZero();
    for (const SensorModel& sensor : sensors) {
      viewpoint_ += sensor.origin / static_cast<double>(sensors.size());
      grids_.push_back(RangeImageGrid::for_sensor(sensor));
      T_level_beams_.emplace_back(Pose::Identity());
      T_level_beams_.back().linear() = sensor.R_level_headed;
      T_level_beams_.back().translation() = sensor.origin;
    }
    is_level_ = sensors.size() == 1 && sensors[0].is_level();
    int scans = 1;
    for (const SensorModel& sensor : sensors) {
      scans = std::max(scans, scans_to_see_things(sensor, kMaxScans));
    }
    if (scans != scans_) forget();
    scans_ = scans;
    span_ = ReferenceSpan(config_, scans_);
    references_.resize(span_.count() + (scans_ > 1 ? 1 : 0));  // and the open one
    for (ReferenceScan& reference : references_) {
      reference.views.resize(static_cast<std::size_t>(scans_) * sensors.size());
      for (std::size_t i = 0; i < reference.views.size(); ++i) {
        reference.views[i].image.allocate(grids_[i % grids_.size()]);
      }
    }
  }

  const ReferenceSpan& span() const { return span_; }

  /// Whether a scan, `since_begin` scans after the first one of its epoch, is one of a reference.
  bool takes(std::uint64_t since_begin) const {
    return scans_until_reference(since_begin) < static_cast<std::uint64_t>(scans_);
  }

  /// Invalidates all references.
  void forget() {
    open_.reset();
    for (ReferenceScan& reference : references_) reference.epoch = ReferenceScan::kNoEpoch;
  }

  /// Adds the images of a scan that takes() accepts to a reference, in the place of one that is not
  /// needed any more. Each image is in the tilted frame of its sensor, in which each beam is a row.
  /// `scan`, `epoch`: numbers of the scan and of its epoch. `since_begin`: scans since the first
  /// scan of the epoch. `T_world_level`: pose of the frame of `split`. `moving`: by non-ground
  /// point, as in RangeImage::build().
  void add(std::uint64_t scan, std::uint64_t epoch, std::uint64_t since_begin,
           const Pose& T_world_level, const GroundSplit& split, Span<const std::uint8_t> moving) {
    if (since_begin == 0) open_.reset();
    if (!open_) open_ = begin_reference(scan, epoch);
    ReferenceScan& reference = references_[*open_];
    if (grids_.size() > 1) {
      for (std::size_t i = 0; i < grids_.size(); ++i) {
        build_view(i, T_world_level, split, moving, next_view(scan, reference));
      }
    } else {
      build_only_view(T_world_level, split, moving, next_view(scan, reference));
    }
    if (scans_until_reference(since_begin) > 0) return;
    reference.scan = scan;
    reference.epoch = epoch;
    reference.since_begin = since_begin;
    reference.T_world_level = T_world_level;
    newest_ = *open_;
    open_.reset();
  }

  const ReferenceScan& newest() const { return references_[newest_]; }

  /// The reference that is scan number `scan` of an epoch; null if there is none.
  const ReferenceScan* find(std::uint64_t scan, std::uint64_t epoch) const {
    for (const ReferenceScan& reference : references_) {
      if (reference.scan == scan && reference.epoch == epoch) return &reference;
    }
    return nullptr;
  }

  /// Replaces `out` by the visibility of the first `count` points (m, level frame; padded for
  /// packs) of scan number `scan` from a reference. If it has several scans, this scan and the
  /// adjacent ones are not used. The points of several sensors count as seen from the middle
  /// between these. `reach`: as in add_visibility().
  const Visibility& test(const PointBuffer& points, std::size_t count, std::uint64_t scan,
                         const Pose& T_world_points, const ReferenceScan& reference,
                         Visibility& out, const float* reach = nullptr) const {
    out.clear(count);
    std::size_t tested = 0;
    for (std::size_t i = 0; i < reference.count; ++i) {
      const ReferenceView& view = reference.views[i];
      if (scans_ > 1 && view.scan <= scan + 1 && scan <= view.scan + 1) continue;
      const Pose T_view_points = composed(inverted(view.T_world_beams), T_world_points);
      const Eigen::Vector3d viewpoint = T_view_points * viewpoint_;
      add_visibility(view.image, T_view_points, points, count, static_cast<float>(config_.margin),
                     static_cast<float>(config_.margin_slope), out, viewpoint.cast<float>(), reach);
      ++tested;
    }
    if (tested > 1) out.settle(count);
    return out;
  }

 private:
  static constexpr int kMaxScans = 10;  // of a reference

  float lateral_margin() const { return static_cast<float>(config_.lateral_margin); }

  std::uint64_t scans_until_reference(std::uint64_t since_begin) const {
    const auto step = static_cast<std::uint64_t>(span_.step);
    return (step - since_begin % step) % step;
  }

  // Index of an empty reference.
  std::size_t begin_reference(std::uint64_t scan, std::uint64_t epoch) {
    const auto unneeded =
        std::find_if(references_.begin(), references_.end(), [&](const ReferenceScan& reference) {
          return reference.epoch != epoch ||
                 !span_.needs(reference.since_begin, scan - reference.scan);
        });
    unneeded->epoch = ReferenceScan::kNoEpoch;
    unneeded->count = 0;
    return static_cast<std::size_t>(unneeded - references_.begin());
  }

  static ReferenceView& next_view(std::uint64_t scan, ReferenceScan& reference) {
    ReferenceView& view = reference.views[reference.count++];
    view.scan = scan;
    return view;
  }

  // The image of the only sensor.
  void build_only_view(const Pose& T_world_level, const GroundSplit& split,
                       Span<const std::uint8_t> moving, ReferenceView& view) {
    view.T_world_beams = T_world_level;
    PointsView ground = split.ground();
    PointsView rest = split.non_ground();
    if (!is_level_) {
      const Eigen::Matrix3d R_beams_level = T_level_beams_.front().linear().transpose();
      view.T_world_beams = rotated(T_world_level, R_beams_level);
      ground = rotate(ground, R_beams_level, rotated_ground_);
      rest = rotate(rest, R_beams_level, rotated_rest_);
    }
    view.image.build(grids_.front(), ground, rest, moving, lateral_margin(), scratch_);
  }

  // The image of one of several sensors, of its own points.
  void build_view(std::size_t sensor, const Pose& T_world_level, const GroundSplit& split,
                  Span<const std::uint8_t> moving, ReferenceView& view) {
    own_.points.grow(split.count + kPackWidth);
    own_.count = own_.ground_count = 0;
    own_moving_.clear();
    for (std::size_t i = 0; i < split.count; ++i) {
      if (split.sensor_of(i) != sensor) continue;
      own_.points.set(own_.count++, split.points, i);
      if (i < split.ground_count) {
        ++own_.ground_count;
      } else {
        own_moving_.push_back(moving.empty() ? std::uint8_t{0} : moving[i - split.ground_count]);
      }
    }
    transform_points(own_.all(), PackTransform(inverted(T_level_beams_[sensor])), own_.points, 0);
    view.T_world_beams = composed(T_world_level, T_level_beams_[sensor]);
    view.image.build(grids_[sensor], own_.ground(), own_.non_ground(), own_moving_,
                     lateral_margin(), scratch_);
  }

  FreeSpaceConfig config_;
  ReferenceSpan span_;
  std::vector<ReferenceScan> references_;
  std::size_t newest_ = 0;             // index of the newest reference
  std::optional<std::size_t> open_;    // index of the one that has scans, but not its last one
  int scans_ = 1;                      // of a reference
  std::vector<RangeImageGrid> grids_;  // by sensor
  std::vector<Pose> T_level_beams_;    // by sensor
  Eigen::Vector3d viewpoint_ = Eigen::Vector3d::Zero();  // mean origin of the sensors, level frame
  bool is_level_ = true;                  // the images of the only sensor are in the level frame
  GroundSplit own_;                       // of one of several sensors
  std::vector<std::uint8_t> own_moving_;  // by its point above the ground
  PointBuffer rotated_ground_;
  PointBuffer rotated_rest_;
  RangeImage::Scratch scratch_;
};

}  // namespace dynains::detail
