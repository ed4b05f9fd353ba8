// Scans of several sensors: each point has the origin of its own.

#include "dynains/errors.hpp"
#include "support/catch.hpp"
#include "support/runs.hpp"

namespace dynains::test {
namespace {

using Config = DynaInsRemover::Config;

/// A scan in the frame of a body, with the sensor of each point.
struct MergedScan : Scan {
  std::vector<std::uint8_t> sensors;
};

/// Two sensors at the corners of a vehicle, turned outwards.
std::vector<Pose> corners() {
  std::vector<Pose> sensors(2, Pose::Identity());
  for (std::size_t i = 0; i < 2; ++i) {
    const double side = i == 0 ? 1.0 : -1.0;
    sensors[i].translation() = Eigen::Vector3d(1.5, 1.1 * side, kSensorHeight);
    sensors[i].linear() =
        Eigen::AngleAxisd(0.8 * side, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  }
  return sensors;
}

/// Drives with these sensors at 5 m/s; every other point is measured.
std::vector<MergedScan> merged(const Scene& scene, int count, const std::vector<Pose>& sensors) {
  std::vector<MergedScan> scans;
  for (int i = 0; i < count; ++i) {
    MergedScan& all = scans.emplace_back();
    all.time = 0.1 * i;
    all.T_world_sensor.translation().x() = 0.5 * i;
    for (std::size_t s = 0; s < sensors.size(); ++s) {
      const Eigen::Isometry3d T_body_sensor(sensors[s].matrix());
      const Scan one = scene.scan(all.T_world_sensor * T_body_sensor, all.time);
      for (std::size_t p = 0; p < one.points.size(); p += 2) {
        all.points.push_back(T_body_sensor.cast<float>() * one.points[p]);
        all.object.push_back(one.object[p]);
        all.sensors.push_back(static_cast<std::uint8_t>(s));
      }
    }
  }
  return scans;
}

RawPoints<float> cloud_of(const MergedScan& scan) {
  return {scan.points.front().data(), scan.points.size(), 3, scan.sensors.data()};
}

/// Points of the first sensor, which come first.
std::size_t points_of_first(const MergedScan& scan) {
  const auto& sensors = scan.sensors;
  return static_cast<std::size_t>(std::count(sensors.begin(), sensors.end(), std::uint8_t{0}));
}

/// Shares of the removed points of the van, and of the removed points of everything else.
struct Removed {
  double van = 0.0, rest = 0.0;
};
template <class Push>
Removed removed(const Config& config, const std::vector<MergedScan>& scans, Push&& push) {
  DynaInsRemover remover(config);
  Share van, rest;
  const auto take = [&](const ScanVerdict& verdict) {
    const MergedScan& scan = scans[verdict.scan];
    for (std::size_t i = 0; i < scan.object.size(); ++i) {
      Share& share = scan.object[i] == kAddedBox ? van : rest;
      ++share.total;
      share.labelled += verdict.labels[i] == PointLabel::kDynamic ? 1 : 0;
    }
  };
  for (const MergedScan& scan : scans) {
    const FrameResult frame = push(remover, scan);
    if (frame.finished) take(*frame.finished);
  }
  remover.flush(take);
  return {van.value(), rest.value()};
}

FrameResult push_with_sensors(DynaInsRemover& remover, const MergedScan& scan) {
  return remover.push(cloud_of(scan), scan.T_world_sensor, scan.time);
}

TEST_CASE("points of two sensors are judged by the rays of both") {
  const std::vector<MergedScan> scans = merged(oncoming(), 12, corners());
  Config config;
  config.min_range = 0.5;  // the van passes 1.5 m beside a sensor
  const Config one = config;
  config.sensors = corners();
  const Removed by_two = removed(config, scans, push_with_sensors);
  CHECK(by_two.van > 0.95);
  CHECK(by_two.rest < 0.004);

  // The sensors as ranges of the cloud instead of an accessor.
  const Removed by_ranges = removed(config, scans, [](auto& remover, const MergedScan& scan) {
    const std::size_t first = points_of_first(scan);
    const std::vector<SensorRange> ranges = {{first, scan.points.size() - first, 1}};
    return remover.push(scan.points, scan.T_world_sensor, scan.time, ranges);
  });
  CHECK(by_ranges.van == by_two.van);
  CHECK(by_ranges.rest == by_two.rest);

  // With rays from the origin of the body, parts of the rest are lost.
  const Removed by_body = removed(one, scans, push_with_sensors);
  CHECK(by_body.rest > 2.0 * by_two.rest);
}

TEST_CASE("a sensor that is missing at first, or in between, is no fault") {
  std::vector<MergedScan> scans = merged(oncoming(), 12, corners());
  for (const std::size_t i : {0, 1, 7}) {
    MergedScan& scan = scans[i];
    const std::size_t first = points_of_first(scan);
    scan.points.resize(first);
    scan.object.resize(first);
    scan.sensors.resize(first);
  }
  Config config;
  config.min_range = 0.5;
  config.sensors = corners();
  std::vector<std::size_t> epochs;
  std::size_t number = 0;
  const Removed found = removed(config, scans, [&](auto& remover, const MergedScan& scan) {
    const FrameResult frame = push_with_sensors(remover, scan);
    if (frame.began_epoch) epochs.push_back(number);
    ++number;
    return frame;
  });
  CHECK(found.van > 0.9);
  CHECK(found.rest < 0.01);
  CHECK((epochs == std::vector<std::size_t>{0, 2}));  // the second sensor is seen first in scan 2
}

TEST_CASE("the range of a point is that from its own sensor") {
  Config config;
  config.sensors = corners();
  config.min_range = 2.0;
  DynaInsRemover remover(config);
  // Beside the second sensor: near to it, 2.2 m from the first one.
  std::vector<float> points = {1.5F, -1.6F, 1.0F, 1.5F, -1.6F, 1.0F, 0.0F, 0.0F, 0.0F};
  points.push_back(std::numeric_limits<float>::quiet_NaN());
  points.insert(points.end(), {0.0F, 0.0F});
  const std::vector<std::uint8_t> sensors = {0, 1, 1, 0};
  const FrameResult frame =
      remover.push(RawPoints<float>{points.data(), 4, 3, sensors.data()}, Pose::Identity());
  const Span<const PointLabel> labels = frame.newest().labels;
  CHECK(labels[0] != PointLabel::kOutOfRange);
  CHECK(labels[1] == PointLabel::kOutOfRange);
  CHECK(labels[2] == PointLabel::kInvalid);
  CHECK(labels[3] == PointLabel::kInvalid);
}

TEST_CASE("wrong sensors are refused with the field") {
  Config config;
  config.sensors = corners();
  config.sensors[1].linear() *= 1.1;
  CHECK_THROWS_WITH(DynaInsRemover(config), StartsWith("DynaInsRemover.sensors[1] is not rigid"));
  config.sensors.assign(256, Pose::Identity());
  CHECK_THROWS_WITH(DynaInsRemover(config), StartsWith("DynaInsRemover.sensors has 256 poses"));
  config.sensors.clear();
  CHECK_THROWS_AS(DynaInsRemover(config), ConfigError);

  config.sensors = corners();
  DynaInsRemover remover(config);
  const std::vector<float> points(9, 4.0F);
  const std::vector<std::uint8_t> sensors = {0, 1, 2};
  CHECK_THROWS_AS(
      remover.push(RawPoints<float>{points.data(), 3, 3, sensors.data()}, Pose::Identity()),
      CloudError);
  const std::vector<SensorRange> ranges = {{2, 2, 1}};
  CHECK_THROWS_AS(
      remover.push(RawPoints<float>{points.data(), 3}, Pose::Identity(), std::nullopt, ranges),
      CloudError);
  CHECK_NOTHROW(remover.push(RawPoints<float>{points.data(), 3}, Pose::Identity()));
}

}  // namespace
}  // namespace dynains::test
