#include <algorithm>
#include <cstddef>

#include "dynains/poses/diagnosis.hpp"
#include "dynains/surfaces/scan_registration.hpp"
#include "dynains/surfaces/surface_grid.hpp"

namespace dynains {
namespace {

/// The points of one sensor in a scan, and the surfaces of the other sensors in the scans around
/// it. All in the frame of the cloud, m.
struct Comparison {
  std::vector<Eigen::Vector3d> points;
  SurfaceGrid others{true};
};

struct Point {
  Eigen::Vector3d position;  ///< m, frame of the cloud
  std::size_t sensor;
};

/// Points that are not of the own vehicle.
std::vector<Point> points_of(const RecordedScan& scan, const std::vector<Pose>& sensors) {
  std::vector<Point> points;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const Eigen::Vector3d p =
        Eigen::Map<const Eigen::Vector3f>(scan.xyzi.data() + 4 * i).cast<double>();
    const std::size_t sensor = scan.sensor.empty() ? 0 : scan.sensor[i];
    if (p.isZero(0.0) || !p.allFinite() || sensor >= sensors.size()) continue;
    if ((p - sensors[sensor].translation()).norm() > kMinPoint) points.push_back({p, sensor});
  }
  return points;
}

/// The comparisons of all sensors in scan i, whose fits are added to `result`.
std::vector<Comparison> compare(const Recording& recording, std::size_t i,
                                std::vector<SensorAgreement>& result) {
  constexpr std::size_t kAround = 3;  // scans
  const std::vector<Pose>& sensors = recording.sensors();
  std::vector<Comparison> comparisons(sensors.size());
  std::vector<SurfaceGrid> own(sensors.size(), SurfaceGrid(true));  // in other scans
  const std::size_t last = std::min(i + kAround, recording.size() - 1);
  RecordedScan scan;
  for (std::size_t j = i - std::min(i, kAround); j <= last; ++j) {
    recording.read_scan(j, scan);
    const Pose T = recording.T_world_sensor(i).inverse() * recording.T_world_sensor(j);
    std::vector<VoxelHashTable<>> taken(sensors.size());
    for (const Point& point : points_of(scan, sensors)) {
      const Eigen::Vector3d p = T * point.position;
      for (std::size_t k = 0; k < sensors.size(); ++k) {
        if (k != point.sensor) comparisons[k].others.insert(p);
      }
      if (j != i) {
        own[point.sensor].insert(p);
        continue;
      }
      result[point.sensor].points += 1.0;
      if (adds(taken[point.sensor], voxel_at(p, kThinned))) {
        comparisons[point.sensor].points.push_back(p);
      }
    }
  }
  for (std::size_t k = 0; k < sensors.size(); ++k) {
    const auto& [points, others] = comparisons[k];
    result[k].fit_of_scans += fit_of(own[k], points, Pose::Identity());
    result[k].fit_of_others += fit_of(others, points, Pose::Identity());
  }
  return comparisons;
}

/// Motion of the sensor, in the frame of the clouds, by which its points fit to the surfaces of the
/// others in all scans.
Pose register_to_others(const std::vector<Comparison>& scans) {
  std::vector<Overlap> overlaps;
  overlaps.reserve(scans.size());
  for (const Comparison& scan : scans) overlaps.push_back({&scan.others, &scan.points});
  Pose T = Pose::Identity();
  for (const FitStage& stage : {FitStage{1, 0.2, 8}, FitStage{2, 0.1, 12}, FitStage{2, 0.05, 8}}) {
    T = refined(overlaps, T, stage);
  }
  return T;
}

}  // namespace

std::vector<SensorAgreement> compare_sensors(const Recording& recording) {
  constexpr std::size_t kSamples = 8;
  const std::vector<Pose>& sensors = recording.sensors();
  if (sensors.size() < 2 || recording.size() == 0) return {};
  std::vector<SensorAgreement> result(sensors.size());
  std::vector<std::vector<Comparison>> of_sensor(sensors.size());
  const std::size_t samples = std::min(kSamples, recording.size());
  for (std::size_t n = 0; n < samples; ++n) {
    const std::size_t i = (2 * n + 1) * recording.size() / (2 * samples);
    std::vector<Comparison> all = compare(recording, i, result);
    for (std::size_t k = 0; k < sensors.size(); ++k) of_sensor[k].push_back(std::move(all[k]));
  }
  for (std::size_t k = 0; k < sensors.size(); ++k) {
    SensorAgreement& agreement = result[k];
    agreement.points /= static_cast<double>(samples);
    agreement.fit_of_scans /= static_cast<double>(samples);
    agreement.fit_of_others /= static_cast<double>(samples);
    const Pose T = register_to_others(of_sensor[k]);
    agreement.T_cloud_sensor = T * sensors[k];
    agreement.distance = (agreement.T_cloud_sensor.translation() - sensors[k].translation()).norm();
    agreement.angle = angle_of(T.linear());
  }
  return result;
}

}  // namespace dynains
