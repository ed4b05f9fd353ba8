// Sensors that are mounted at a tilt: scans are levelled inside, and answers are in the sensor
// frame.

#include "support/catch.hpp"
#include "support/runs.hpp"

namespace dynains::test {
namespace {

using Config = DynaInsRemover::Config;

// A drive at 5 m/s.
std::vector<Scan> drive_slanted(double pitch, double roll) {
  const Scene scene = oncoming();
  std::vector<Scan> scans;
  for (int i = 0; i < 10; ++i) {
    Eigen::Isometry3d T_world_sensor = sensor_at(0.5 * i);
    T_world_sensor.rotate(slant(pitch, roll));
    scans.push_back(scene.scan(T_world_sensor, 0.1 * i));
  }
  return scans;
}

double kept_share(const std::vector<Scan>& scans, const std::vector<Verdict>& verdicts) {
  const Share removed = share(scans, verdicts, PointLabel::kDynamic);
  const Share van = share(scans, verdicts, PointLabel::kDynamic, kAddedBox);
  return 1.0 - static_cast<double>(removed.labelled - van.labelled) /
                   static_cast<double>(removed.total - van.total);
}

TEST_CASE("a tilted sensor gives results as good as a level one") {
  const auto [pitch, roll] =
      GENERATE(std::pair(0.0, 0.0), std::pair(5.0, 0.0), std::pair(15.0, 0.0), std::pair(25.0, 0.0),
               std::pair(-20.0, 10.0), std::pair(0.0, 30.0), std::pair(175.0, 0.0));
  INFO("pitch " << pitch << " deg, roll " << roll << " deg");
  const std::vector<Scan> scans = drive_slanted(pitch, roll);
  const std::vector<Verdict> verdicts = run(Config(), scans).final;
  const Share moving = share(scans, verdicts, PointLabel::kDynamic, kAddedBox);
  REQUIRE(moving.total > 1500);
  CHECK(moving.value() > 0.9);
  CHECK(kept_share(scans, verdicts) > 0.99);
  CHECK(share(scans, verdicts, PointLabel::kGround, kGroundObject).value() > 0.5);
}

TEST_CASE("poses and map stay in the user's frames") {
  const std::vector<Scan> scans = drive_slanted(20.0, 5.0);
  DynaInsRemover remover;
  const auto check = [&](const ScanVerdict& verdict) {
    CHECK(verdict.T_world_sensor.isApprox(scans[verdict.scan].T_world_sensor, 1e-12));
  };
  for (const Scan& scan : scans) check(push(remover, scan).newest());
  remover.flush(check);
  CHECK_FALSE(remover.sensor().is_level());
  std::size_t count = 0, off = 0;
  remover.map().for_each([&](const Eigen::Vector3d& p) {
    ++count;
    bool on_pillar = false;
    for (const Box& box : yard().boxes) {
      on_pillar |= p.x() > box.low.x() - 0.05 && p.x() < box.high.x() + 0.05 &&
                   p.y() > box.low.y() - 0.05 && p.y() < box.high.y() + 0.05 && p.z() < 3.05;
    }
    if (!on_pillar && std::abs(p.z()) > 0.05) ++off;
  });
  REQUIRE(count > 3000);
  CHECK(off < count / 100);  // remaining points of the van
}

TEST_CASE("a level sensor is only turned to its scene, and not at all without the option level") {
  const double pitch = GENERATE(0.0, 2.0);
  const std::vector<Scan> scans = drive_slanted(pitch, 0.0);
  DynaInsRemover levelled;
  run(levelled, scans);
  CHECK(levelled.sensor().is_level());
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  CHECK(levelled.sensor().R_level_sensor() * up == up);
  CHECK_FALSE(levelled.sensor().R_level_sensor().isIdentity(0.0));

  Config config;
  config.level = false;
  DynaInsRemover plain(config);
  run(plain, scans);
  CHECK(plain.sensor().R_level_sensor().isIdentity(0.0));
}

TEST_CASE("a tilt of more than four degrees is levelled, and the height of the sensor is found") {
  for (const double pitch : {3.0, 5.0}) {
    for (const double height : {1.2, 2.6}) {
      Eigen::Isometry3d T_world_sensor = sensor_at(0.0);
      T_world_sensor.translation().z() = height;
      T_world_sensor.rotate(slant(pitch, 0.0));
      DynaInsRemover remover;
      run(remover, {yard().scan(T_world_sensor, 0.0)});
      CAPTURE(pitch, height);
      CHECK(remover.sensor().is_level() == (pitch < 4.0));
      CHECK(remover.sensor().height == Approx(height).margin(0.03));
    }
  }
}

TEST_CASE("a given tilt is used without estimation") {
  const auto [pitch, roll] =
      GENERATE(std::pair(20.0, -10.0), std::pair(20.0, 0.0), std::pair(0.0, -20.0));
  const std::vector<Scan> scans = drive_slanted(pitch, roll);
  Config config;
  config.mounting_pitch = pitch;
  config.mounting_roll = roll;
  DynaInsRemover remover(config);
  const std::vector<Verdict> verdicts = run(remover, scans).final;
  const Eigen::Vector3d up = slant(pitch, roll).row(2);
  CHECK((remover.sensor().R_level_sensor() * up).isApprox(Eigen::Vector3d::UnitZ(), 1e-9));
  CHECK(share(scans, verdicts, PointLabel::kDynamic, kAddedBox).value() > 0.9);

  config.level = false;
  DynaInsRemover as_it_is(config);
  run(as_it_is, {scans[0]});
  CHECK(as_it_is.sensor().is_level());
}

TEST_CASE("the range of points is that of the sensor frame, tilted or not") {
  std::vector<Scan> scans = drive_slanted(25.0, 0.0);
  for (const Verdict& verdict : run(Config(), scans).final) {
    const Scan& scan = scans[verdict.scan];
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      const bool is_near = std::hypot(scan.points[i].x(), scan.points[i].y()) < 2.7;
      REQUIRE((verdict.labels[i] == PointLabel::kOutOfRange) == is_near);
    }
  }
}

TEST_CASE("after reset another sensor may have another mounting") {
  const std::vector<Scan> slanted = drive_slanted(20.0, 0.0);
  const std::vector<Scan> upright = drive_slanted(0.0, 0.0);
  DynaInsRemover used;
  run(used, slanted);
  used.reset();
  CHECK((run(used, upright).final == run(Config(), upright).final));
  used.reset();
  CHECK((run(used, slanted).final == run(Config(), slanted).final));
}

}  // namespace
}  // namespace dynains::test
