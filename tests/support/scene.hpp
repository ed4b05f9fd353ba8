// A small world of boxes on a plane, scanned by rays: scenes with known truth.
#pragma once

#include "support/random.hpp"
#include "support/standard.hpp"

namespace dynains::test {

inline constexpr int kGroundObject = -1;
inline constexpr double kSensorHeight = 1.723;  // m, the default of GroundSegmenter::Config

/// Unit vector of a direction, rad.
inline Eigen::Vector3d ray_of(double elevation, double azimuth) {
  return {std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
          std::sin(elevation)};
}

/// Rotation by a pitch and a roll, deg.
inline Eigen::Matrix3d slant(double pitch, double roll) {
  constexpr double kRadians = M_PI / 180.0;
  return (Eigen::AngleAxisd(pitch * kRadians, Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(roll * kRadians, Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

/// Distance (m) along `ray` from `place` to the wall of a room with the corners `low` and `high`.
inline double range_to_wall(const Eigen::Vector3d& place, const Eigen::Vector3d& ray,
                            const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  double range = 1e9;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const double wall = ray[axis] > 0.0 ? high[axis] : low[axis];
    if (ray[axis] != 0.0) range = std::min(range, (wall - place[axis]) / ray[axis]);
  }
  return range;
}

/// Distance (m) along a ray to the box between two corners, infinite if it misses.
inline double distance_to(const Eigen::Vector3d& low, const Eigen::Vector3d& high,
                          const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  double enter = 0.0;
  double leave = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i) {
    const double a = (low[i] - origin[i]) / direction[i];
    const double b = (high[i] - origin[i]) / direction[i];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return enter < leave ? enter : std::numeric_limits<double>::infinity();
}

/// Axis-aligned box: its place at time 0 and its velocity (m, m/s).
struct Box {
  Eigen::Vector3d low, high;
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
};

/// A van of 4.2 x 1.8 x 2.2 m whose centre is at (x, y).
inline Box van(double x, double y, const Eigen::Vector3d& velocity = Eigen::Vector3d::Zero()) {
  return {{x - 2.1, y - 0.9, 0.05}, {x + 2.1, y + 0.9, 2.2}, velocity};
}

struct Scan {
  Eigen::Isometry3d T_world_sensor = Eigen::Isometry3d::Identity();
  double time = 0.0;
  std::vector<Eigen::Vector3f> points;  // sensor frame, m
  std::vector<int> object;              // index of the box hit, or kGroundObject
};

/// Boxes on the plane z = 0.
struct Scene {
  std::vector<Box> boxes;

  /// `beam_count` beams from -24.8 to +12 degrees, every 0.25 degrees of azimuth, 1 cm of range
  /// noise.
  Scan scan(const Eigen::Isometry3d& T_world_sensor, double time, int beam_count = 80) const {
    constexpr int kAzimuths = 1440;
    constexpr double kRadians = M_PI / 180.0;
    Scan result{T_world_sensor, time, {}, {}};
    Random random(1000 + static_cast<std::uint64_t>(time * 1000.0));
    const Eigen::Vector3d origin = T_world_sensor.translation();
    Eigen::Matrix2Xd beams(2, beam_count);  // cosine and sine of each elevation
    for (int b = 0; b < beam_count; ++b) {
      const double elevation = (-24.8 + 36.8 * b / (beam_count - 1)) * kRadians;
      beams.col(b) << std::cos(elevation), std::sin(elevation);
    }
    for (int a = 0; a < kAzimuths; ++a) {
      const double azimuth = (a + 0.25) * 0.25 * kRadians;
      const Eigen::Vector2d ahead(std::cos(azimuth), std::sin(azimuth));
      for (int b = 0; b < beam_count; ++b) {
        const Eigen::Vector3d ray(beams(0, b) * ahead.x(), beams(0, b) * ahead.y(), beams(1, b));
        const Eigen::Vector3d direction = T_world_sensor.linear() * ray;
        int object = kGroundObject;
        double range = direction.z() < 0.0 ? -origin.z() / direction.z() : kNever;
        for (std::size_t i = 0; i < boxes.size(); ++i) {
          const double hit = distance(boxes[i], origin, direction, time);
          if (hit < range) {
            range = hit;
            object = static_cast<int>(i);
          }
        }
        const double noise = random.uniform(-0.01, 0.01);
        if (range > 80.0) continue;
        result.points.push_back((ray * (range + noise)).cast<float>());
        result.object.push_back(object);
      }
    }
    return result;
  }

 private:
  static constexpr double kNever = std::numeric_limits<double>::infinity();

  static double distance(const Box& box, const Eigen::Vector3d& origin,
                         const Eigen::Vector3d& direction, double time) {
    const Eigen::Vector3d from = origin - box.velocity * time;
    return distance_to(box.low, box.high, from, direction);
  }
};

/// Pose of a sensor at (x, y), kSensorHeight over the plane, turned by `yaw` (rad).
inline Eigen::Isometry3d sensor_at(double x, double y = 0.0, double yaw = 0.0) {
  return Eigen::Translation3d(x, y, kSensorHeight) *
         Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ());
}

/// `count` scans at 10 Hz along x at `speed` (m/s). The sensor is turned by `yaw` (rad).
inline std::vector<Scan> drive(const Scene& scene, int count, double speed, double yaw = 0.0,
                               int beam_count = 80) {
  std::vector<Scan> scans;
  for (int i = 0; i < count; ++i) {
    scans.push_back(scene.scan(sensor_at(speed * 0.1 * i, 0.0, yaw), 0.1 * i, beam_count));
  }
  return scans;
}

/// Two rows of pillars along x, nearer than 25 m, with a free lane between them.
inline Scene yard() {
  Scene scene;
  for (const double x : {-8.0, 0.0, 8.0, 16.0}) {
    for (const double y : {-9.0, 9.0}) {
      scene.boxes.push_back({{x - 1.0, y - 1.0, 0.0}, {x + 1.0, y + 1.0, 3.0}});
    }
  }
  return scene;
}

/// yard() with one more box.
inline Scene yard_with(const Box& box) {
  Scene scene = yard();
  scene.boxes.push_back(box);
  return scene;
}
inline constexpr int kAddedBox = 8;  ///< its index

/// yard() with an oncoming van: 22 m ahead at first, 12 m/s.
inline Scene oncoming() { return yard_with(van(22.0, 3.5, {-12.0, 0.0, 0.0})); }

}  // namespace dynains::test
