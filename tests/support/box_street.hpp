// A street of boxes on flat ground, and the scans of a session that drives along it.
#pragma once

#include "dynains/points.hpp"
#include "support/scene.hpp"
#include "support/standard.hpp"

namespace dynains::test {

struct StreetBox {
  Eigen::Vector3d lowest, highest;  // m, world frame
  std::uint32_t label;
};

struct BoxScan {
  PointBuffer points;  // m, sensor frame
  std::vector<PointLabel> verdicts;
  std::vector<std::uint32_t> labels;
  Eigen::Isometry3d T_world_sensor = Eigen::Isometry3d::Identity();
};

/// One scan at (x, y), 1.7 m above the ground, of the boxes and two walls at y = -12 and 12.
inline BoxScan scan_boxes(std::vector<StreetBox> boxes, double x, double y) {
  constexpr double kRadians = M_PI / 180.0;
  boxes.push_back({{-100, 12, 0}, {100, 13, 6}, 50});
  boxes.push_back({{-100, -13, 0}, {100, -12, 6}, 50});
  BoxScan scan;
  scan.T_world_sensor.translation() = Eigen::Vector3d(x, y, 1.7);
  const Eigen::Vector3d origin = scan.T_world_sensor.translation();
  for (double elevation = -20.0; elevation <= 8.0; elevation += 0.8) {
    for (double azimuth = 0.05; azimuth < 360.0; azimuth += 0.5) {
      const Eigen::Vector3d direction = ray_of(elevation * kRadians, azimuth * kRadians);
      double range = direction.z() < 0.0 ? -origin.z() / direction.z() : 1e9;
      std::uint32_t label = 40;
      for (const StreetBox& box : boxes) {
        const double to_box = distance_to(box.lowest, box.highest, origin, direction);
        if (to_box >= range) continue;
        range = to_box;
        label = box.label;
      }
      if (range > 60.0) continue;
      const Eigen::Vector3f point = (range * direction).cast<float>();
      scan.points.push_back(point.x(), point.y(), point.z());
      scan.verdicts.push_back(label == 40 ? PointLabel::kGround : PointLabel::kStatic);
      scan.labels.push_back(label);
    }
  }
  return scan;
}

/// Scans of a drive along the x axis from `from` to `to`, 1 m apart.
inline std::vector<BoxScan> drive_along(const std::vector<StreetBox>& boxes, double from,
                                        double to) {
  std::vector<BoxScan> scans;
  for (double x = from; x <= to; x += 1.0) scans.push_back(scan_boxes(boxes, x, 0.0));
  return scans;
}

}  // namespace dynains::test
