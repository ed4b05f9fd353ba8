// Boxes and velocities of moving objects. Instances keep their ids from scan to scan (Eq. 4, or
// FreeSpaceEvidence::predecessors()). Kalman filters of constant velocity join the parts of an
// object, and bridge scans in which it is not seen. Goes beyond the paper.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "dynains/pipeline/scan_ring.hpp"
#include "dynains/points.hpp"
#include "dynains/verdict.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains::detail {

/// Follows the dynamic points of consecutive verdicts. Those without latency have one object of
/// this class, and the final ones another.
class ObjectTracks {
 public:
  /// `max_length`, `max_height`: m, of an object. `memory`: scans for which a lost track is kept.
  /// `later`: tracks that are scans ahead and outlive this, or null. Objects have their ids, and
  /// begin with the motions and sizes that they know.
  ObjectTracks(double max_length, double max_height, std::size_t memory, ObjectTracks* later)
      : max_length_(max_length), max_height_(max_height), memory_(memory), later_(later) {}

  /// Restores the state after construction; buffers keep their capacity.
  void clear() {
    forget_all();
    last_id_ = 0;
  }

  /// Adds the verdict on the scan after the last one. The result is valid until the next call.
  Span<const MovingObject> observe(const ScanSlot& scan, const EvidenceVerdict& evidence) {
    if (scan.began_epoch) forget_all();
    sensor_ = scan.T_world_level.translation();
    for (Track& track : tracks_) predict(scan.time - time_, track);
    time_ = scan.time;
    follow_points(scan, evidence);
    begin_tracks(scan);
    measure_extents(scan, evidence);
    for (Track& track : tracks_) {
      if (track.points > 0) update(scan, track);
    }
    name_parts(scan);
    join_tracks();
    list_objects();
    forget(scan.scan);
    std::sort(objects_.begin(), objects_.end(),
              [](const MovingObject& a, const MovingObject& b) { return a.id < b.id; });
    return objects_;
  }

 private:
  static constexpr double kMaxUnseen = 1.0;     // s
  static constexpr double kError = 0.2;         // m, standard deviation of a measured centre
  static constexpr double kSettling = 1.0;      // s, until a track has a certain motion
  static constexpr double kAcceleration = 2.0;  // m/s^2, standard deviation
  static constexpr double kSpeed = 15.0;        // m/s, standard deviation before it is measured
  static constexpr double kDeviations = 2.0;    // of usual errors
  static constexpr double kNever = -std::numeric_limits<double>::infinity();
  static constexpr std::size_t kAxes = 9;  // directions that a box may have
  // Distances between points and between parts of an object, m. They grow with the range as those
  // between beams.
  static constexpr float kGap = 0.3F, kGapOfRange = 0.02F;
  static constexpr float kGapOfInstance = 0.2F;  // m, added for points of an instance of the object
  static constexpr float kAtSide = 0.1F;  // m: points nearer to a side of a box count equally

  // Of constant velocity.
  struct Motion {
    double time = kNever;                                // s
    Eigen::Vector2d centre = Eigen::Vector2d::Zero();    // m
    Eigen::Vector2d velocity = Eigen::Vector2d::Zero();  // m/s
  };

  struct Track {
    MovingObject object;
    double begun = 0.0, seen = 0.0;  // s, times of its first and last scan
    Motion early;  // the last one with a direction before it is settled, or the first one
    double pp = 0.0, pv = 0.0, vv = 0.0;  // covariance of position and velocity, per axis
    bool is_directed = false;             // its motion is certain, and so is its yaw
    double yaw = 0.0, yaw_variance = M_PI * M_PI;
    // In the newest scan:
    std::uint32_t points = 0;
    Eigen::Vector2f along = Eigen::Vector2f::Zero();  // direction
    Eigen::Vector2f place = Eigen::Vector2f::Zero();  // predicted centre along and left of it, m
    Eigen::Array2f half = Eigen::Array2f::Zero();     // of its sizes, m
    Eigen::AlignedBox<float, 1> height;               // m
    // Axes that its box may have, and extents along them and to their left, m from the sensor.
    std::array<Eigen::Vector2f, kAxes> axes;
    std::array<Eigen::AlignedBox2f, kAxes> extents;
    std::array<float, kAxes> closeness = {};  // of the points to the sides of the box, 1/m
  };

  // The dynamic points of an instance.
  struct Part {
    std::uint32_t named = kNoIndex;  // track of the instance in earlier scans
    std::uint32_t track = kNoIndex;  // of most of its points in this scan, by Boyer and Moore
    std::uint32_t lead = 0;          // of this track, in points
    // Points that continue no track, m from the sensor along the axes of the world.
    Eigen::AlignedBox3f box;
    std::uint32_t points = 0;
    std::uint32_t begun = kNoIndex;  // their track
  };

  // An instance that was part of an object.
  struct Named {
    std::uint32_t instance, object;
    std::uint64_t scan;  // the last one
  };

  // Whether a point shows by itself where an object is. Others were removed with what is near them,
  // or provisionally: they count inside the box of an object alone.
  static bool is_certain(Cause cause) {
    return cause != Cause::kPresumed && cause != Cause::kDynamicOccupancy;
  }

  template <class Visit>
  void for_each_dynamic(const ScanSlot& scan, const EvidenceVerdict& evidence,
                        Visit&& visit) const {
    const Eigen::Matrix3f R_world_level = scan.T_world_level.linear().cast<float>();
    const PointsView points = scan.split.non_ground();
    for (std::size_t i = 0; i < points.size(); ++i) {
      const std::uint32_t group = evidence.group_of[i];
      const Cause cause = evidence.groups[group].cause;
      if (group == 0 || !is_dynamic(cause)) continue;
      const std::uint32_t cluster = evidence.cluster_of[group - 1];
      if (cluster == kNoCluster) continue;
      const Eigen::Vector3f point(points.x[i], points.y[i], points.z[i]);
      visit(cluster, Eigen::Vector3f(R_world_level * point), is_certain(cause));
    }
  }

  // A point along a direction and to its left.
  template <class Point>
  static Eigen::Vector2f along(const Eigen::Vector2f& u, const Point& point) {
    return {u.x() * point.x() + u.y() * point.y(), u.x() * point.y() - u.y() * point.x()};
  }
  static Eigen::Matrix2d axes_of(double yaw) { return Eigen::Rotation2Dd(yaw).toRotationMatrix(); }
  static Eigen::Vector2d size_of(const MovingObject& object) {
    return {object.length, object.width};
  }
  Eigen::Vector2d from_sensor(const MovingObject& object) const {
    return (object.centre - sensor_).head<2>();
  }
  // `range`: m.
  static float max_gap(float range) { return kGap + kGapOfRange * range; }
  bool is_followed(const Track& track) const { return time_ - track.seen <= kMaxUnseen; }

  static void predict(double dt, Track& track) {
    constexpr double kTurnRate = 0.3;  // rad/s, standard deviation
    track.object.centre.head<2>() += dt * track.object.velocity;
    const double noise = kAcceleration * kAcceleration * dt * dt;
    track.pp += dt * (2.0 * track.pv + dt * track.vv) + 0.25 * dt * dt * noise;
    track.pv += dt * track.vv + 0.5 * dt * noise;
    track.vv += noise;
    const double turn = kTurnRate * dt;
    track.yaw_variance += turn * turn;
  }

  // Points continue the nearest track, if its box is near enough.
  void follow_points(const ScanSlot& scan, const EvidenceVerdict& evidence) {
    for (Track& track : tracks_) {
      track.along = axes_of(track.object.yaw).col(0).cast<float>();
      track.place = along(track.along, from_sensor(track.object).cast<float>());
      track.half = 0.5F * size_of(track.object).cast<float>().array();
    }
    parts_.assign(scan.ids.size(), Part());
    for (std::size_t p = 0; p < parts_.size(); ++p) parts_[p].named = find(object_of(scan.ids[p]));
    track_of_.clear();
    for_each_dynamic(scan, evidence, [&](std::uint32_t p, const auto& point, bool certain) {
      const std::uint32_t t = track_around(point, certain, parts_[p].named);
      track_of_.push_back(t);
      if (t != kNoIndex) {
        ++tracks_[t].points;
        if (parts_[p].lead == 0) parts_[p].track = t;
        parts_[p].lead += parts_[p].track == t ? 1U : -1U;
      } else if (certain) {
        parts_[p].box.extend(point);
        ++parts_[p].points;
      }
    });
  }

  std::uint32_t track_around(const Eigen::Vector3f& point, bool certain,
                             std::uint32_t named) const {
    std::uint32_t around = kNoIndex;
    float least = max_gap(point.head<2>().norm());
    for (std::uint32_t t = 0; t < tracks_.size(); ++t) {
      const Track& track = tracks_[t];
      if (!is_followed(track)) continue;
      const Eigen::Array2f offset = (along(track.along, point) - track.place).array();
      float gap = (offset.abs() - track.half).max(0.0F).matrix().norm();
      if (gap > 0.0F && !certain) continue;
      if (t == named) gap -= kGapOfInstance + static_cast<float>(std::sqrt(track.pp));
      if (gap >= least) continue;
      around = t;
      least = gap;
    }
    return around;
  }

  // The other points of a part begin a track.
  void begin_tracks(const ScanSlot& scan) {
    constexpr std::uint32_t kMinPoints = 5;
    for (std::size_t p = 0; p < parts_.size(); ++p) {
      Part& part = parts_[p];
      if (part.points < kMinPoints) continue;
      MovingObject object;
      object.centre = sensor_ + part.box.center().cast<double>();
      object.length = static_cast<double>(part.box.sizes().x());
      object.width = static_cast<double>(part.box.sizes().y());
      const std::uint32_t id = later_ == nullptr ? 0 : later_->object_of(scan.ids[p]);
      part.begun = track_that_holds(object, id);
      if (part.begun == tracks_.size()) begin_track(scan, object, id);
      tracks_[part.begun].points += part.points;
      if (part.track == kNoIndex) part.track = part.begun;
    }
  }

  // The track of a part that later scans know to be of this object: the one that it has, if both
  // fit into the size that is known by then, or else a new one.
  std::uint32_t track_that_holds(const MovingObject& part, std::uint32_t id) const {
    const auto begun = static_cast<std::uint32_t>(tracks_.size());
    const std::uint32_t t = find(id);
    if (t == kNoIndex || !is_followed(tracks_[t])) return begun;
    const auto box = common_box(tracks_[t].object, part, max_length_);
    const Track* const known = known_later(id);
    const bool is_size_known = known != nullptr && known->is_directed;
    if (is_size_known && box && (box->sizes() - size_of(known->object)).maxCoeff() > kGap) {
      return begun;
    }
    return box ? t : begun;
  }

  // The box of two objects along the axes of the first one, from its centre, m. None if the gap
  // between them, or their box, is too large.
  std::optional<Eigen::AlignedBox2d> common_box(const MovingObject& first,
                                                const MovingObject& second, double reach) const {
    const Eigen::Matrix2d R = axes_of(first.yaw).transpose();
    const Eigen::Vector2d half = 0.5 * size_of(first);
    const Eigen::Vector2d other = 0.5 * (R * axes_of(second.yaw)).cwiseAbs() * size_of(second);
    const Eigen::Vector2d offset = R * (second.centre - first.centre).head<2>();
    const double gap = (offset.cwiseAbs() - half - other).cwiseMax(0.0).norm();
    Eigen::AlignedBox2d box(-half, half);
    box.extend(Eigen::AlignedBox2d(offset - other, offset + other));
    if (gap > reach || !is_size_of_object(box.sizes())) return std::nullopt;
    return box;
  }

  // Nothing that moves is wider than it may be high.
  bool is_size_of_object(const Eigen::Vector2d& size) const {
    return size.norm() <= max_length_ && size.minCoeff() <= max_height_;
  }

  void begin_track(const ScanSlot& scan, const MovingObject& object, std::uint32_t id) {
    Track track;
    track.axes.fill(Eigen::Vector2f::Zero());
    const Track* const known = find(id) != kNoIndex ? nullptr : known_later(id);
    track.object = object;
    std::uint32_t& last_id = later_ != nullptr ? later_->last_id_ : last_id_;
    track.object.id = known != nullptr ? id : ++last_id;
    track.object.first_scan = scan.scan;
    track.begun = scan.time;
    track.pp = kError * kError;
    track.vv = kSpeed * kSpeed;
    if (known != nullptr && known->is_directed && later_->time_ > time_) {
      lead_back(*known, track);
    }
    tracks_.push_back(track);
  }

  // Begins a track with the size of later scans. This scan may show a part alone: the box that
  // holds it is nearest to where the motion leads back to.
  void lead_back(const Track& known, Track& track) const {
    const Eigen::Vector2d later = known.object.centre.head<2>();
    const Motion latest{later_->time_, later, known.object.velocity};
    const Motion& motion = known.early.time > time_ ? known.early : latest;
    const double ahead = motion.time - time_, duration = latest.time - time_;
    MovingObject& object = track.object;
    const Eigen::Matrix2d axes = axes_of(known.object.yaw);
    const Eigen::Vector2d part = axes.transpose().cwiseAbs() * size_of(object);
    const Eigen::Vector2d slack = 0.5 * (size_of(known.object) - part).cwiseMax(0.0);
    const Eigen::Vector2d place = motion.centre - ahead * motion.velocity;
    const Eigen::Vector2d offset = axes.transpose() * (place - object.centre.head<2>());
    object.length = known.object.length;
    object.width = known.object.width;
    object.centre.head<2>() += axes * offset.cwiseMax(-slack).cwiseMin(slack);
    object.velocity = (later - object.centre.head<2>()) / duration;
    track.pp += std::pow(0.5 * kAcceleration * ahead * ahead, 2);
    track.vv = 2.0 * kError * kError / (duration * duration);
    turn(track);
  }

  // The place of an instance in named_, or the place behind it.
  std::size_t place_of(std::uint32_t instance) const {
    std::size_t i = 0;
    while (i < named_.size() && named_[i].instance != instance) ++i;
    return i;
  }
  // The object of an instance, or 0.
  std::uint32_t object_of(std::uint32_t instance) const {
    const std::size_t i = place_of(instance);
    return i < named_.size() ? named_[i].object : 0;
  }
  // The index of the track of an object, or kNoIndex.
  std::uint32_t find(std::uint32_t id) const {
    std::uint32_t t = 0;
    while (t < tracks_.size() && tracks_[t].object.id != id) ++t;
    return t < tracks_.size() ? t : kNoIndex;
  }
  const Track* known_later(std::uint32_t id) const {
    const std::uint32_t t = later_ == nullptr ? kNoIndex : later_->find(id);
    return t == kNoIndex ? nullptr : &later_->tracks_[t];
  }

  // Yaws that a box may have, as far as that of the track is uncertain.
  static double yaw_of(const Track& track, std::size_t k) {
    constexpr double kWidth = 4.0;  // standard deviations
    const double range = std::min(0.5 * M_PI, kWidth * std::sqrt(track.yaw_variance));
    return track.yaw + range / kAxes * (static_cast<double>(k) - 0.5 * (kAxes - 1));
  }

  template <class Visit>
  void for_each_followed(const ScanSlot& scan, const EvidenceVerdict& evidence, Visit&& visit) {
    std::size_t i = 0;
    for_each_dynamic(scan, evidence, [&](std::uint32_t p, const auto& point, bool certain) {
      std::uint32_t t = track_of_[i++];
      if (t == kNoIndex && certain) t = parts_[p].begun;
      if (t != kNoIndex) visit(tracks_[t], point);
    });
  }

  void measure_extents(const ScanSlot& scan, const EvidenceVerdict& evidence) {
    for (Track& track : tracks_) {
      track.height.setEmpty();
      track.closeness.fill(0.0F);
      for (std::size_t k = 0; k < kAxes && track.points > 0; ++k) {
        track.axes[k] = axes_of(yaw_of(track, k)).col(0).cast<float>();
        track.extents[k].setEmpty();
      }
    }
    for_each_followed(scan, evidence, [](Track& track, const Eigen::Vector3f& point) {
      track.height.extend(Eigen::Matrix<float, 1, 1>(point.z()));
      for (std::size_t k = 0; k < kAxes; ++k) {
        track.extents[k].extend(along(track.axes[k], point));
      }
    });
    for_each_followed(scan, evidence, [](Track& track, const Eigen::Vector3f& point) {
      for (std::size_t k = 0; k < kAxes; ++k) {
        const Eigen::Vector2f place = along(track.axes[k], point);
        const Eigen::AlignedBox2f& box = track.extents[k];
        const float inside = (place - box.min()).cwiseMin(box.max() - place).minCoeff();
        track.closeness[k] += 1.0F / std::max(inside, kAtSide);
      }
    });
  }

  // The yaw with the points nearest to the sides of the box (Zhang et al., "Efficient L-shape
  // fitting", IV 2017): few beams hit a vehicle elsewhere. Its first side is the longest unless the
  // motion is known.
  static Eigen::AlignedBox2f choose_yaw(Track& track) {
    const auto closest = std::max_element(track.closeness.begin(), track.closeness.end());
    const auto k = static_cast<std::size_t>(closest - track.closeness.begin());
    const Eigen::AlignedBox2f& best = track.extents[k];
    track.object.yaw = yaw_of(track, k);
    if (track.is_directed || best.sizes().x() >= best.sizes().y()) return best;
    track.object.yaw += 0.5 * M_PI;
    return {Eigen::Vector2f(best.min().y(), -best.max().x()),
            Eigen::Vector2f(best.max().y(), -best.min().x())};
  }

  void update(const ScanSlot& scan, Track& track) {
    MovingObject& object = track.object;
    const Eigen::AlignedBox2f extent = choose_yaw(track);
    if (!is_size_of_object(extent.sizes().cast<double>())) {
      // It holds points of others: its instances begin tracks anew.
      track.seen = kNever;
      return;
    }
    const Eigen::Vector2d size = size_of(object);
    const Eigen::Vector2d centre = measure_centre(scan.scan, extent, track);
    if (object.first_scan == scan.scan) {
      object.centre.head<2>() = centre;
      track.pp = kError * kError;
    } else {
      // Without a direction, what a box grows at one side is as well a motion.
      const double growth = track.is_directed ? 0.0 : 0.5 * (size_of(object) - size).norm();
      correct(centre, kError * kError + 0.5 * growth * growth, track);
    }
    object.centre.z() = sensor_.z() + static_cast<double>(track.height.center().x());
    object.height = static_cast<double>(track.height.sizes().x());
    object.points = std::exchange(track.points, 0);
    object.last_scan = scan.scan;
    track.seen = scan.time;
    turn(track);
    const bool is_early = track.early.time == kNever || scan.time - track.begun <= kSettling;
    if (track.is_directed && is_early) {
      track.early = {scan.time, object.centre.head<2>(), object.velocity};
    }
  }

  // The measured centre, by the side towards the sensor and the size: a far side may be hidden.
  // The size is nearly the largest one that was seen, until the object is directed the last one:
  // before, the box may have other axes.
  Eigen::Vector2d measure_centre(std::uint64_t scan, const Eigen::AlignedBox2f& extent,
                                 Track& track) const {
    constexpr double kGrowth = 0.5, kShrinkage = 0.2;  // of the difference, in each scan
    MovingObject& object = track.object;
    const Eigen::Matrix2d axes = axes_of(object.yaw);
    const Eigen::Vector2d expected = axes.transpose() * from_sensor(object);
    const Eigen::Array2d view = expected.normalized().array().square();
    Eigen::Vector2d centre = sensor_.head<2>();
    for (int k = 0; k < 2; ++k) {
      double& size = k == 0 ? object.length : object.width;
      const double low = static_cast<double>(extent.min()[k]);
      const double high = static_cast<double>(extent.max()[k]);
      const double middle = 0.5 * (low + high), difference = high - low - size;
      // Along the view, the far end cannot be seen.
      const double gain = difference > 0.0 ? kGrowth : kShrinkage * view[1 - k];
      const double growth = (track.is_directed ? gain : 1.0) * difference;
      size += growth;
      const double hidden = 0.5 * (growth - difference), slack = std::abs(hidden);
      const double nearest = std::clamp(expected[k], middle - slack, middle + slack);
      if (std::abs(expected[k]) <= 0.5 * size) {  // both ends are equally far away
        centre += nearest * axes.col(k);
        continue;
      }
      const double away = expected[k] > 0.0 ? 1.0 : -1.0, hidden_far = middle + away * hidden;
      // A track that later scans know has an expected place from the beginning.
      const bool begins = track.is_directed && object.first_scan == scan;
      const double trust = begins ? slack * slack / (slack * slack + track.pp) : 0.0;
      centre += (hidden_far + trust * (nearest - hidden_far)) * axes.col(k);
      object.centre.head<2>() += 0.5 * away * growth * axes.col(k);
    }
    return centre;
  }

  // Extends an object that is at least as wide as a car to the length of a car, away from the
  // sensor. Only the hidden part is added: the squared cosine of the angle between length and view.
  MovingObject with_hidden_length(MovingObject object) const {
    constexpr double kCarWidth = 1.3, kCarLength = 4.5;  // m: the narrowest, and a usual one
    if (object.width < kCarWidth || object.length >= kCarLength) return object;
    const Eigen::Vector2d axis = axes_of(object.yaw).col(0);
    const double cosine = axis.dot(from_sensor(object).normalized());
    const double hidden = (kCarLength - object.length) * cosine * cosine;
    object.centre.head<2>() += 0.5 * std::copysign(hidden, cosine) * axis;
    object.length += hidden;
    return object;
  }

  // `noise`: m^2, variance of the centre, per axis.
  static void correct(const Eigen::Vector2d& centre, double noise, Track& track) {
    const double variance = track.pp + noise;
    const double gain = track.pp / variance, speed_gain = track.pv / variance;
    const Eigen::Vector2d error = centre - track.object.centre.head<2>();
    track.object.centre.head<2>() += gain * error;
    track.object.velocity += speed_gain * error;
    track.vv -= speed_gain * track.pv;
    track.pv *= 1.0 - gain;
    track.pp *= 1.0 - gain;
  }

  // The yaw follows the motion while that is certain.
  static void turn(Track& track) {
    const Eigen::Vector2d& velocity = track.object.velocity;
    const double variance = track.vv / velocity.squaredNorm();  // of the direction
    if (!(variance * kDeviations * kDeviations <= 1.0)) return;
    const double direction = std::atan2(velocity.y(), velocity.x());
    if (!std::exchange(track.is_directed, true)) {
      track.yaw = direction;
      track.yaw_variance = variance;
    }
    const double gain = track.yaw_variance / (track.yaw_variance + variance);
    track.yaw += gain * std::remainder(direction - track.yaw, 2.0 * M_PI);
    track.yaw_variance *= 1.0 - gain;
  }

  void name_parts(const ScanSlot& scan) {
    for (std::size_t p = 0; p < parts_.size(); ++p) {
      if (parts_[p].track == kNoIndex) continue;
      const std::size_t i = place_of(scan.ids[p]);
      if (i == named_.size()) named_.emplace_back();
      named_[i] = {scan.ids[p], tracks_[parts_[p].track].object.id, scan.scan};
    }
  }

  // Tracks beside each other that move alike are parts of one object. The older one stays.
  void join_tracks() {
    constexpr double kUnlikely = 4.0;  // squared deviation of a difference between velocities
    for (std::size_t a = 0; a < tracks_.size(); ++a) {
      for (std::size_t b = tracks_.size(); --b > a;) {
        MovingObject& to = tracks_[a].object;
        const MovingObject& from = tracks_[b].object;
        const bool move_alike = (to.velocity - from.velocity).squaredNorm() <=
                                kUnlikely * (tracks_[a].vv + tracks_[b].vv);
        if (!is_directed_now(tracks_[a]) || !is_directed_now(tracks_[b]) || !move_alike) continue;
        const float range = static_cast<float>(from_sensor(to).norm());
        const auto box = common_box(to, from, max_gap(range));
        if (!box) continue;
        to.centre.head<2>() += axes_of(to.yaw) * box->center();
        to.length = box->sizes().x();
        to.width = box->sizes().y();
        to.points += from.points;
        for (Named& named : named_) {
          if (named.object == from.id) named.object = to.id;
        }
        tracks_.erase(tracks_.begin() + static_cast<std::ptrdiff_t>(b));
      }
    }
  }
  bool is_directed_now(const Track& track) const {
    return track.is_directed && track.seen >= time_;
  }

  void list_objects() {
    objects_.clear();
    for (const Track& track : tracks_) {
      if (!is_directed_now(track)) continue;
      objects_.push_back(with_hidden_length(track.object));
      const Track* const known = known_later(track.object.id);
      if (known != nullptr) objects_.back().last_scan = known->object.last_scan;
    }
  }

  void forget_all() {
    tracks_.clear();
    named_.clear();
  }

  void forget(std::uint64_t scan) {
    const auto is_lost = [&](const Track& track) {
      return track.seen == kNever ||
             (!is_followed(track) && scan > track.object.last_scan + memory_);
    };
    tracks_.erase(std::remove_if(tracks_.begin(), tracks_.end(), is_lost), tracks_.end());
    const auto is_old = [&](const Named& named) { return scan > named.scan + memory_; };
    named_.erase(std::remove_if(named_.begin(), named_.end(), is_old), named_.end());
  }

  double max_length_, max_height_;
  std::size_t memory_;
  ObjectTracks* later_;
  double time_ = 0.0;                                 // s, of the newest scan
  Eigen::Vector3d sensor_ = Eigen::Vector3d::Zero();  // its position, m, world frame
  std::uint32_t last_id_ = 0;
  std::vector<Track> tracks_;
  std::vector<Named> named_;
  std::vector<Part> parts_;              // by cluster of the newest scan
  std::vector<std::uint32_t> track_of_;  // by dynamic point, the track that it continues
  std::vector<MovingObject> objects_;
};

}  // namespace dynains::detail
