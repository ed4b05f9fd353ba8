// Sensors of a rig agree under their exact poses; a wrong pose of one is reported.
#include "dynains/io/kitti.hpp"
#include "dynains/io/recording.hpp"
#include "dynains/poses/diagnosis.hpp"
#include "io/files.hpp"
#include "simulation/simulator.hpp"
#include "simulation/write_sequence.hpp"
#include "support/catch.hpp"

namespace dynains {
namespace {

TEST_CASE("A sensor that is 5 cm and 0.5 deg off is found to 2 cm, and exact ones are not off") {
  simulation::Config config;
  config.sensor = simulation::Sensor::kVlp16;
  config.rig = GENERATE(simulation::Rig::kCorners, simulation::Rig::kRoofThree);
  config.scans = 25;
  config.seed = 11;
  const test::TemporaryFolder folder;
  simulation::Simulator simulator(config);
  simulation::write_sequence(simulator, folder.path(), {});
  const Recording recording(folder.path());
  const std::size_t last = recording.sensors().size() - 1;
  for (const SensorAgreement& sensor : compare_sensors(recording)) {
    CAPTURE(config.rig, sensor.distance, sensor.angle);
    CHECK_FALSE(sensor.is_off());
    CHECK(sensor.distance < 0.02);
    CHECK(sensor.fit_of_others > 0.6);
    CHECK(sensor.points > 5000.0);
  }

  const Pose off = Eigen::Translation3d(0.03, -0.03, 0.0264) *
                   Eigen::AngleAxisd(0.5 * M_PI / 180.0, Eigen::Vector3d(1, -1, 1).normalized());
  const Pose& T_cloud_sensor = recording.sensors()[last];
  const Pose T_found_exact = T_cloud_sensor * off * T_cloud_sensor.inverse();
  for (std::size_t i = 0; i < recording.size(); ++i) {
    RecordedScan scan = recording.read_scan(i);
    for (std::size_t k = 0; k < scan.size(); ++k) {
      Eigen::Map<Eigen::Vector3f> p(scan.xyzi.data() + 4 * k);
      if (scan.sensor[k] == last) p = (T_found_exact * p.cast<double>()).cast<float>();
    }
    write_scan(recording.file(i), scan.xyzi);
  }
  const SensorAgreement found = compare_sensors(recording)[last];
  CHECK(found.is_off());
  const Pose error = (T_cloud_sensor * off.inverse()).inverse() * found.T_cloud_sensor;
  CHECK(error.translation().norm() < 0.02);
  CHECK(Eigen::AngleAxisd(error.linear()).angle() < 0.1 * M_PI / 180.0);
}

}  // namespace
}  // namespace dynains
