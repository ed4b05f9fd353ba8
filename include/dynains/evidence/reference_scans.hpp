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

/// The range image of one sensor, of one scan or of several ones from nearly the same place.
struct ReferenceView {
  std::uint64_t first = 0, last = 0;      ///< its scans
  Pose T_world_beams = Pose::Identity();  ///< of the scan in the middle
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
    int scans = 1;
    sensors_.assign(sensors.begin(), sensors.end());
    T_level_beams_.clear();
    viewpoint_.setZero();
    for (const SensorModel& sensor : sensors) {
      scans = std::max(scans, scans_to_see_things(sensor, kMaxScans));
      viewpoint_ += sensor.origin / static_cast<double>(sensors.size());
      T_level_beams_.emplace_back(Pose::Identity());
      T_level_beams_.back().linear() = sensor.R_level_headed;
      T_level_beams_.back().translation() = sensor.origin;
    }
    if (scans != scans_) forget();
    scans_ = scans;
    span_ = ReferenceSpan(config_, scans_);
    references_.resize(span_.count() + (scans_ > 1 ? 1 : 0));  // and the open one
    for (ReferenceScan& reference : references_) {
      reference.views.resize(static_cast<std::size_t>(scans_) * sensors.size());
      for (std::size_t i = 0; i < reference.views.size(); ++i) {
        const bool is_first = i < sensors.size();  // the one of several scans, if there is only one
        reference.views[i].image.allocate(
            RangeImageGrid::for_sensor(sensors[i % sensors.size()], is_first ? scans_ : 1));
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

  /// Adds a scan that takes() accepts to a reference, in the place of one that is not needed any
  /// more. Each image is in the tilted frame of its sensor, in which each beam is a row. `scan`,
  /// `epoch`: numbers of the scan and of its epoch. `since_begin`: scans since the first scan of
  /// the epoch. `T_world_level`: pose of the frame of `split`. `moving`: by non-ground point, as in
  /// RangeImage::build().
  void add(std::uint64_t scan, std::uint64_t epoch, std::uint64_t since_begin,
           const Pose& T_world_level, const GroundSplit& split, Span<const std::uint8_t> moving) {
    if (since_begin == 0) open_.reset();
    if (!open_) open_ = begin_reference(scan, epoch);
    ReferenceScan& reference = references_[*open_];
    const bool is_last = scans_until_reference(since_begin) == 0;
    if (part_count_ > 0 && !shares_image(T_world_level)) build_views(reference);
    keep(scan, T_world_level, split, moving);
    if (!is_last) return;
    build_views(reference);
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
      if (scans_ > 1 && view.first <= scan + 1 && scan <= view.last + 1) continue;
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
  // m: within it, scans share an image. Farther apart, their beams differ in direction.
  static constexpr double kSamePlace = 0.25;

  // The points of one sensor of one scan, level frame.
  struct Part {
    std::uint64_t scan = 0;
    Pose T_world_level = Pose::Identity();
    RangeImage::Scan points;  // of the split of the scan, or of `own`
    GroundSplit own;
    std::vector<std::uint8_t> moving;  // by own point above the ground
  };

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
    part_count_ = 0;
    return static_cast<std::size_t>(unneeded - references_.begin());
  }

  // Whether a scan shares its image with those that are kept. Images of several sensors overlap
  // without that.
  bool shares_image(const Pose& T_world_level) const {
    return sensors_.size() == 1 &&
           distance(parts_.front().T_world_level, T_world_level) <= kSamePlace;
  }

  // Keeps the points of a scan until its images are built, by sensor. The only ones are not copied.
  void keep(std::uint64_t scan, const Pose& T_world_level, const GroundSplit& split,
            Span<const std::uint8_t> moving) {
    for (std::size_t sensor = 0; sensor < sensors_.size(); ++sensor) {
      if (part_count_ == parts_.size()) parts_.emplace_back();
      Part& part = parts_[part_count_++];
      part.scan = scan;
      part.T_world_level = T_world_level;
      part.points = {split.ground(), split.non_ground(), moving, {}};
      if (scans_ == 1 && sensors_.size() == 1) return;
      part.own.points.grow(split.count + kPackWidth);
      part.own.count = part.own.ground_count = 0;
      part.moving.clear();
      for (std::size_t i = 0; i < split.count; ++i) {
        if (split.sensor_of(i) != sensor) continue;
        part.own.points.set(part.own.count++, split.points, i);
        if (i < split.ground_count) {
          ++part.own.ground_count;
        } else {
          part.moving.push_back(moving.empty() ? std::uint8_t{0} : moving[i - split.ground_count]);
        }
      }
      part.points = {part.own.ground(), part.own.non_ground(), part.moving, {}};
    }
  }

  // Adds the images of the points that were kept.
  void build_views(ReferenceScan& reference) {
    for (std::size_t sensor = 0; sensor < sensors_.size(); ++sensor) {
      build_view(sensor, reference.views[reference.count++]);
    }
    part_count_ = 0;
  }

  void build_view(std::size_t sensor, ReferenceView& view) {
    const std::size_t sensors = sensors_.size();
    const std::size_t scans = part_count_ / sensors;
    const std::size_t middle = scans / 2 * sensors + sensor;
    const Pose& T_world_level = parts_[middle].T_world_level;
    const Pose T_beams_level = inverted(T_level_beams_[sensor]);
    scans_of_view_.clear();
    for (std::size_t i = sensor; i < part_count_; i += sensors) {
      const Part& part = parts_[i];
      const Pose T_level_part = composed(inverted(T_world_level), part.T_world_level);
      // Without rounding for the middle scan: a single level scan needs no transform.
      const Pose T = i == middle ? T_beams_level : composed(T_beams_level, T_level_part);
      scans_of_view_.push_back(part.points);
      if (!T.matrix().isIdentity(0.0)) scans_of_view_.back().to_image = PackTransform(T);
    }
    view.first = parts_.front().scan;
    view.last = parts_[part_count_ - 1].scan;
    view.T_world_beams = composed(T_world_level, T_level_beams_[sensor]);
    view.image.build(RangeImageGrid::for_sensor(sensors_[sensor], static_cast<int>(scans)),
                     scans_of_view_, static_cast<float>(config_.lateral_margin), scratch_);
  }

  FreeSpaceConfig config_;
  ReferenceSpan span_;
  std::vector<ReferenceScan> references_;
  std::size_t newest_ = 0;           // index of the newest reference
  std::optional<std::size_t> open_;  // index of the one that has scans, but not its last one
  int scans_ = 1;                    // of a reference
  std::vector<SensorModel> sensors_;
  std::vector<Pose> T_level_beams_;                      // by sensor
  Eigen::Vector3d viewpoint_ = Eigen::Vector3d::Zero();  // mean origin of the sensors, level frame
  std::vector<Part> parts_;     // of the open reference: by scan, then by sensor
  std::size_t part_count_ = 0;  // of those in use
  std::vector<RangeImage::Scan> scans_of_view_;
  RangeImage::Scratch scratch_;
};

}  // namespace dynains::detail
