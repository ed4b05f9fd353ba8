// Estimate of the mounting of a sensor (height above the ground, tilt) from one scan.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <random>
#include <vector>

#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/sensor/plane_fit.hpp"
#include "dynains/sensor/sensor_model.hpp"
#include "dynains/simd/pack_geometry.hpp"
#include "dynains/simd/pack_loops.hpp"
#include "dynains/threads/background.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains {

/// Mounting of a sensor: the ground plane around it, in the sensor frame.
struct Mounting {
  double height = 0.0;  ///< m, distance of the sensor from the plane
  Eigen::Vector3d up_sensor = Eigen::Vector3d::UnitZ();  ///< upward normal, unit length
  bool known = false;                                    ///< whether a ground plane was found

  /// Angle between the z axis of the sensor and the upward normal (deg, [0, 180]). Above 90 if the
  /// sensor is mounted upside down.
  double tilt() const { return std::acos(std::clamp(up_sensor.z(), -1.0, 1.0)) * 180.0 / M_PI; }

  /// Rotation by the smallest angle from the sensor frame to a level frame, whose z axis is the
  /// upward normal. For a normal along -z, a rotation by 180 deg about x.
  Eigen::Matrix3d R_level_sensor() const {
    // Closed form: Quaterniond::FromTwoVectors takes seconds to compile.
    const double x = up_sensor.x(), y = up_sensor.y(), z = up_sensor.z();
    const double across = x * x + y * y;
    Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
    if (z < 0.0 && across < 1e-200) {
      R(1, 1) = R(2, 2) = -1.0;
      return R;
    }
    // 1 / (1 + z), without cancellation near z = -1.
    const double k = z < 0.0 ? (1.0 - z) / across : 1.0 / (1.0 + z);
    R << 1.0 - k * x * x, -k * x * y, -x, -k * x * y, 1.0 - k * y * y, -y, x, y, z;
    return R;
  }
};

/// Normal of the ground in the frame of a sensor with a pitch (deg about y, nose down) and a roll
/// (deg about x, left side up): R_level_sensor = R_y(pitch) R_x(roll).
inline Eigen::Vector3d up_of_mounting(double pitch, double roll) {
  const double p = pitch * detail::kRadians, r = roll * detail::kRadians;
  return {-std::sin(p), std::cos(p) * std::sin(r), std::cos(p) * std::cos(r)};
}

namespace detail {

// Plain sums, because the order of Eigen's depends on the instruction set.
inline double dot(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return a.x() * b.x() + a.y() * b.y() + a.z() * b.z();
}
inline Eigen::Vector3d multiplied(const Eigen::Matrix3d& R, const Eigen::Vector3d& a) {
  const auto row = [&](int i) { return dot({R(i, 0), R(i, 1), R(i, 2)}, a); };
  return {row(0), row(1), row(2)};
}

/// Plane `up . p = -height`, m, sensor frame.
struct GroundHypothesis {
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  double height = 0.0;

  double distance(const Eigen::Vector3d& p) const { return dot(up, p) + height; }
};

/// Bounds of MountingEstimator.
struct GroundSearch {
  double min_distance = 0.4;                  ///< m; nearer points may lie on the housing
  double max_distance = 20.0;                 ///< m; farther ground may lie in another plane
  double cell = 0.5;                          ///< m; one point per cell evens out the density
  double min_height = 0.2, max_height = 5.0;  ///< m, of the sensor
  double min_upright = 0.64;                  ///< cosine of a tilt of 50 deg
  double on_ground = 0.12;                    ///< m, largest distance of a ground cell
  double below = 0.4;                         ///< m; cells farther below contradict a plane
  std::size_t min_cells = 60;
  std::size_t scored = 2000;  ///< cells that score a plane
};

/// Finds the ground plane: the plane with most occupied cells on it and fewest below it. RANSAC
/// over one point per cell, then least squares.
class MountingEstimator {
 public:
  /// `points`: one scan, m, sensor frame.
  explicit MountingEstimator(PointsView points) : cells_(thin(points)) {
    for (std::size_t i = 0; i < std::min(kSearch.scored, cells_.size()); ++i) {
      const Eigen::Vector3d& p = cells_[i];
      scored_.push_back(static_cast<float>(p.x()), static_cast<float>(p.y()),
                        static_cast<float>(p.z()));
    }
  }

  /// The ground plane on the negative z side of the sensor (`side` 1), or on its positive z side
  /// (-1: mounted upside down). Empty if no plane is valid.
  std::optional<GroundHypothesis> find(double side) const {
    if (cells_.size() < kSearch.min_cells) return std::nullopt;
    const std::optional<GroundHypothesis> coarse = search(side);
    if (!coarse) return std::nullopt;
    GroundHypothesis ground = *coarse;
    for (const double band : {0.3, 0.2, 0.12, 0.12, 0.12}) {
      if (!refine(band, side, ground)) return std::nullopt;
    }
    return is_sound(ground) ? std::optional(ground) : std::nullopt;
  }

 private:
  static constexpr GroundSearch kSearch{};

  // Up to kWordBits points: bits of those between the distances of kSearch, and the cells of all.
  struct Block {
    std::uint64_t near = 0;
    std::array<std::array<std::int32_t, kWordBits + kPackWidth>, 3> cell;

    explicit Block(PointsView points) {
      static constexpr PackConstant kPerMetre(static_cast<float>(1.0 / kSearch.cell)),
          kMin(static_cast<float>(kSearch.min_distance)),
          kMax(static_cast<float>(kSearch.max_distance));
      with_packs([&](auto packs) {
        for_slices<decltype(packs)>(0, points.size(), [&](const auto& at) {
          const auto x = at.load(points.x.data());
          const auto y = at.load(points.y.data());
          const auto z = at.load(points.z.data());
          const auto range = sqrt(x * x + (y * y + z * z));
          near |= std::uint64_t{((range > kMin) & (range < kMax)).bits()} << at.begin;
          floor(x * kPerMetre).store(&cell[0][at.begin]);
          floor(y * kPerMetre).store(&cell[1][at.begin]);
          floor(z * kPerMetre).store(&cell[2][at.begin]);
        });
      });
      if (points.size() < kWordBits) near &= (std::uint64_t{1} << points.size()) - 1;
    }
  };

  // Mean of the points in each occupied cell, in random order, so that any subrange is a random
  // sample.
  static std::vector<Eigen::Vector3d> thin(PointsView points) {
    struct Sum {
      VoxelKey cell;
      double x, y, z;
      double count;
    };
    VoxelHashTable<> number;  // by cell
    std::vector<Sum> sums;
    std::uint32_t at = 0;
    for (std::size_t begin = 0; begin < points.size(); begin += kWordBits) {
      const PointsView some = points.subview(begin, std::min(kWordBits, points.size() - begin));
      const Block block(some);
      for_each_bit(block.near, [&](std::size_t i) {
        const VoxelKey cell = voxel_key(block.cell[0][i], block.cell[1][i], block.cell[2][i]);
        if (at >= sums.size() || sums[at].cell != cell) at = number.insert(cell);
        if (at == sums.size()) sums.push_back({cell, 0.0, 0.0, 0.0, 0.0});
        Sum& sum = sums[at];
        sum.x += static_cast<double>(some.x[i]);
        sum.y += static_cast<double>(some.y[i]);
        sum.z += static_cast<double>(some.z[i]);
        sum.count += 1.0;
      });
    }
    // Makes the result independent of the order of the points.
    std::sort(sums.begin(), sums.end(), [](const Sum& a, const Sum& b) { return a.cell < b.cell; });
    std::vector<Eigen::Vector3d> cells;
    cells.reserve(sums.size());
    for (const Sum& sum : sums) {
      cells.emplace_back(sum.x / sum.count, sum.y / sum.count, sum.z / sum.count);
    }
    std::mt19937_64 random(1);
    for (std::size_t i = cells.size(); i > 1; --i) std::swap(cells[i - 1], cells[random() % i]);
    return cells;
  }

  // RANSAC: the plane with the best score among planes through three random cells.
  std::optional<GroundHypothesis> search(double side) const {
    std::optional<GroundHypothesis> best;
    float best_score = 0.0F;
    std::mt19937_64 random(2);
    for (int trial = 0; trial < 3000; ++trial) {
      const Eigen::Vector3d& a = cells_[random() % cells_.size()];
      const Eigen::Vector3d& b = cells_[random() % cells_.size()];
      const Eigen::Vector3d& c = cells_[random() % cells_.size()];
      const Eigen::Vector3d normal = (b - a).cross(c - a);
      const double area = std::sqrt(dot(normal, normal));
      if (!(area > 4.0)) continue;
      GroundHypothesis ground;
      ground.up = (normal.z() * side > 0.0 ? 1.0 : -1.0) / area * normal;
      ground.height = -dot(ground.up, a);
      if (!is_possible(ground, side)) continue;
      const float found = score(ground, best_score);
      if (found <= best_score) continue;
      best_score = found;
      best = ground;
    }
    return best;
  }

  // Score of a plane: the weighted number of cells on it, minus half the number of cells below it.
  // For a plane that cannot reach `best`, or by the cells so far does so with a probability below
  // 1e-9 (Hoeffding, J. Am. Stat. Assoc. 58(301), 1963), some number that is no larger.
  float score(const GroundHypothesis& ground, float best) const {
    constexpr float kDeviation = 4.83F;  // 1.5 sqrt(ln(1e9) / 2): of scores in [-0.5, 1]
    // Ignores the cells of the last, incomplete pack.
    const std::size_t count = scored_.size() / kPackWidth * kPackWidth;
    float found = 0.0F;
    with_packs([&](auto packs) {
      using Float = typename decltype(packs)::Float;
      const Float x(static_cast<float>(ground.up.x()));
      const Float y(static_cast<float>(ground.up.y()));
      const Float z(static_cast<float>(ground.up.z()));
      const Float height(static_cast<float>(ground.height));
      const Float zero(0.0F), one(1.0F), half(0.5F);
      const Float slope(static_cast<float>(0.5 / kSearch.on_ground));
      const Float below(static_cast<float>(-kSearch.below));
      Float total(0.0F);
      for (std::size_t begin = 0; begin < count; begin += kStepPoints) {
        const std::size_t end = std::min(count, begin + kStepPoints);
        for (std::size_t i = begin; i < end; i += kPackWidth) {
          const Float distance = (x * Float::load(&scored_.x[i]) + y * Float::load(&scored_.y[i])) +
                                 (z * Float::load(&scored_.z[i]) + height);
          // The weight decreases with distance, so that the plane fits the middle of a rough
          // ground.
          total = total + max(one - abs(distance) * slope, zero) - keep(distance < below, half);
        }
        found = sum(total);
        if (found + static_cast<float>(count - end) <= best) return;
        const auto tested = static_cast<float>(end);
        if (found + kDeviation * std::sqrt(tested) <= best / static_cast<float>(count) * tested) {
          return;
        }
      }
    });
    return found;
  }

  static bool is_possible(const GroundHypothesis& ground, double side) {
    return ground.up.z() * side > kSearch.min_upright && ground.height > kSearch.min_height &&
           ground.height < kSearch.max_height;
  }

  // Weighted least squares over the cells within `band` m of the plane. Near cells have a larger
  // weight, since distant ground on a slope may lie off the plane. Returns false if the fit has too
  // few cells or is not possible.
  bool refine(double band, double side, GroundHypothesis& ground) const {
    PlaneMoments m;
    const double near_distance = 4.0 * ground.height + 3.0;
    for (const Eigen::Vector3d& p : cells_) {
      const double distance = ground.distance(p);
      if (!(std::abs(distance) < band)) continue;
      const double off = distance / band;
      const double far = dot(p, p) / (near_distance * near_distance);
      const double w = (1.0 - off * off) * (1.0 - off * off) / (1.0 + far * far);
      m.add(p.x(), p.y(), p.z(), w);
    }
    if (!(m.count >= 10.0)) return false;
    const Plane plane = fit_plane(m);
    ground.up = side * Eigen::Vector3d(plane.normal_x, plane.normal_y, plane.normal_z);
    ground.height = -dot(ground.up, {plane.mean_x, plane.mean_y, plane.mean_z});
    return is_possible(ground, side);
  }

  // Whether enough cells lie on the plane, and fewer below it.
  bool is_sound(const GroundHypothesis& ground) const {
    std::size_t on = 0;
    std::size_t below = 0;
    for (const Eigen::Vector3d& p : cells_) {
      const double distance = ground.distance(p);
      if (std::abs(distance) < kSearch.on_ground) ++on;
      if (distance < -kSearch.below) ++below;
    }
    return on >= kSearch.min_cells && on * 20 >= cells_.size() && below < on;
  }

  std::vector<Eigen::Vector3d> cells_;  // m, sensor frame
  PointBuffer scored_;                  // the first kSearch.scored cells
};

}  // namespace detail

/// Estimates the height and the tilt of a sensor from one scan (m, sensor frame): a plane fit to
/// the ground within 20 m. On a slope, the result is the normal of the slope.
///
/// Valid for sensors 0.2 to 5 m above the ground with a tilt up to 45 deg, upright or upside down,
/// at any heading. The result is not `known` if the scan has too few ground points. Ignores points
/// that are not finite. Allocates memory and takes milliseconds, so call it for a few scans of a
/// sensor, not for each. The median over several scans has a smaller error.
inline Mounting estimate_mounting(PointsView points) {
  const detail::MountingEstimator estimator(points);
  for (const double side : {1.0, -1.0}) {
    if (const auto ground = estimator.find(side)) return {ground->height, ground->up, true};
  }
  return {};
}

/// Azimuth (rad, sensor frame) of the main axis of a scan: the horizontal axis of the largest
/// second moment about the sensor, towards the side of the mean. It rotates with the points, so
/// results in a frame along this axis do not depend on the yaw of the sensor. 0 for an empty scan.
/// `points` (m) must be finite.
inline double estimate_heading(PointsView points) {
  double x = 0.0, y = 0.0;           // sums
  double along = 0.0, across = 0.0;  // second moments, as a vector at twice the angle
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double px = static_cast<double>(points.x[i]);
    const double py = static_cast<double>(points.y[i]);
    x += px;
    y += py;
    along += px * px - py * py;
    across += 2.0 * px * py;
  }
  const double heading = 0.5 * std::atan2(across, along);
  const bool ahead = std::cos(heading) * x + std::sin(heading) * y >= 0.0;
  return ahead ? heading : heading + M_PI;
}

/// Rotation about z from the sensor frame to a frame with its x axis at azimuth `heading` (rad).
inline Eigen::Matrix3d R_headed(double heading) {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  R(0, 0) = R(1, 1) = std::cos(heading);
  R(0, 1) = std::sin(heading);
  R(1, 0) = -R(0, 1);
  return R;
}

namespace detail {

/// The sensors of a scan: their models, and the rotation of their common cloud to the level frame.
class LevelFrame {
 public:
  /// `level`: whether scans are rotated to the level frame. `pitch`, `roll`: tilt of the mounting,
  /// deg, as in up_of_mounting(); if both are 0, estimate() estimates the tilt. `T_cloud_sensor`:
  /// by sensor, at least one.
  LevelFrame(bool level, double pitch, double roll, Span<const Pose> T_cloud_sensor)
      : is_enabled_(level),
        is_tilt_given_(pitch != 0.0 || roll != 0.0),
        up_given_(up_of_mounting(pitch, roll)),
        T_cloud_sensor_(T_cloud_sensor.begin(), T_cloud_sensor.end()),
        is_one_(T_cloud_sensor.size() == 1 && T_cloud_sensor[0].linear().isIdentity(0.0)) {
    for (const Pose& T : T_cloud_sensor_) origin_ += T.translation();
    origin_ /= static_cast<double>(T_cloud_sensor_.size());
    forget();
  }

  /// Origin of the level frame in the frame of the cloud, m: the mean of the sensors.
  const Eigen::Vector3d& origin() const { return origin_; }
  /// Position of each sensor, m, relative to origin(), along the axes of the cloud. Empty for one
  /// sensor.
  std::vector<Eigen::Vector3f> positions() const {
    std::vector<Eigen::Vector3f> positions;
    if (T_cloud_sensor_.size() == 1) return positions;
    for (const Pose& T : T_cloud_sensor_) {
      positions.emplace_back((T.translation() - origin_).cast<float>());
    }
    return positions;
  }

  /// Model of all sensors together, by all of their points. Not known() until estimate() was called
  /// with enough points.
  const SensorModel& sensor() const { return sensor_; }
  /// Model of each sensor.
  Span<const SensorModel> sensors() const { return sensors_; }

  /// Whether the caller rotates scans by sensor().R_level_sensor().
  bool rotates_scans() const { return sensor_.known() && is_enabled_; }

  /// Whether estimate() would find a sensor that it has not seen. `counts`: points by sensor, or
  /// empty for one sensor.
  bool is_new(Span<const std::size_t> counts) const {
    if (!sensor_.known()) return true;
    for (std::size_t i = 0; i < counts.size(); ++i) {
      if (!is_seen_[i] && counts[i] >= kMinOfSensor) return true;
    }
    return false;
  }

  /// Estimates the models of the sensors from a scan: m, relative to origin(), in the axes of the
  /// cloud, or in those of the level frame if rotates_scans(), which then stays. `sensor_of`: by
  /// point; empty for one sensor. Nothing changes if the scan has too few points. `headed`: memory
  /// for the scan. `other`: a thread that helps; null for none.
  void estimate(PointsView scan, Span<const std::uint8_t> sensor_of, PointBuffer& headed,
                Background* other = nullptr) {
    Eigen::Matrix3d R_scan_cloud = Eigen::Matrix3d::Identity();
    if (rotates_scans()) {
      R_scan_cloud = sensor_.R_level_sensor();
    } else if (!sensor_.known()) {
      sensor_ = estimate_all(scan, headed, other);
      if (!sensor_.known()) return;
    }
    if (is_one_) {
      sensors_[0] = sensor_;
      return;
    }
    for (std::size_t i = 0; i < sensors_.size(); ++i) {
      if (!is_seen_[i]) estimate_one(i, scan, sensor_of, R_scan_cloud, headed);
    }
  }

  void forget() {
    sensor_ = {};
    sensors_.assign(T_cloud_sensor_.size(), SensorModel());
    is_seen_.assign(T_cloud_sensor_.size(), false);
  }

 private:
  SensorModel estimate_all(PointsView scan, PointBuffer& headed, Background* other) const {
    Eigen::Matrix3d R_headed_sensor = Eigen::Matrix3d::Identity();
    if (is_enabled_) R_headed_sensor = R_headed(estimate_heading(scan));
    const PointsView points = rotate(scan, R_headed_sensor, headed);
    SensorModel sensor;
    Mounting mounting;
    run_both(
        other, [&] { sensor = estimate_sensor_model(points); },
        [&] { mounting = estimate_mounting(points); });
    if (!sensor.known()) return sensor;
    if (mounting.known) sensor.height = mounting.height;
    if (is_enabled_) {
      sensor.R_headed_sensor = R_headed_sensor;
      sensor.R_level_headed = R_level_headed(mounting, R_headed_sensor);
    }
    return sensor;
  }

  // The model of sensor i: its sampling by its own points in its own frame, or that of all points
  // if these are few.
  void estimate_one(std::size_t i, PointsView scan, Span<const std::uint8_t> sensor_of,
                    const Eigen::Matrix3d& R_scan_cloud, PointBuffer& own) {
    const Pose& T = T_cloud_sensor_[i];
    const Eigen::Vector3d position = T.translation() - origin_;
    Pose T_scan_sensor = Pose::Identity();
    T_scan_sensor.linear() = composed(R_scan_cloud, T.linear());
    T_scan_sensor.translation() = multiplied(R_scan_cloud, position);
    std::size_t count = 0;
    own.grow(scan.size() + kPackWidth);
    for (std::size_t k = 0; k < scan.size(); ++k) {
      own.set(count, scan, k);
      count += (sensor_of.empty() ? 0U : sensor_of[k]) == i ? 1 : 0;
    }
    const PointsView points = PointsView(own).subview(0, count);
    transform_points(points, PackTransform(inverted(T_scan_sensor)), own, 0);
    is_seen_[i] = count >= kMinOfSensor;
    SensorModel model = estimate_sensor_model(points);
    if (!model.known()) model = sensor_;
    const Eigen::Matrix3d R_level_cloud = sensor_.R_level_sensor();
    model.height = sensor_.height;
    model.R_headed_sensor.setIdentity();
    model.R_level_headed = composed(R_level_cloud, T.linear());
    model.origin = multiplied(R_level_cloud, position);
    sensors_[i] = model;
  }

  // `mounting`: estimate in the headed frame.
  Eigen::Matrix3d R_level_headed(Mounting mounting, const Eigen::Matrix3d& R_headed_sensor) const {
    if (is_tilt_given_) {
      mounting.up_sensor = multiplied(R_headed_sensor, up_given_);
      return mounting.R_level_sensor();
    }
    // Estimates for level sensors are up to 2.6 deg.
    return mounting.known && mounting.tilt() > 4.0 ? mounting.R_level_sensor()
                                                   : Eigen::Matrix3d::Identity();
  }

  bool is_enabled_;
  bool is_tilt_given_;
  Eigen::Vector3d up_given_;  // normal of the ground, frame of the cloud
  std::vector<Pose> T_cloud_sensor_;
  bool is_one_;  // the axes of the only sensor are those of the cloud
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
  SensorModel sensor_;
  std::vector<SensorModel> sensors_;
  std::vector<bool> is_seen_;  // by sensor: it had enough points
};

}  // namespace detail
}  // namespace dynains
