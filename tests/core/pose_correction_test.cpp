// Correction of poses for comparisons, against known perturbations of the exact poses of simulated
// scans.
#include "dynains/registration/pose_correction.hpp"

#include "dynains/median.hpp"
#include "support/catch.hpp"
#include "support/drive_of.hpp"
#include "support/points.hpp"
#include "support/random.hpp"
#include "support/simulated_runs.hpp"

namespace dynains::test {
namespace {

using namespace detail;

using simulation::Scene;
using simulation::Sensor;
using simulation::SimulatedScan;

constexpr double kTolerance = 0.01;  // m
constexpr double kDegrees = M_PI / 180.0;

PoseCorrection new_correction() { return PoseCorrection(kTolerance); }

std::vector<SimulatedScan> drive(Scene scene, Sensor sensor, int scans) {
  return simulate(drive_of(scene, sensor, scans, 31));
}

GroundSplit split_of(const SimulatedScan& scan) { return test::split_of(buffer_of(scan.xyzi)); }

// A correction that knows all scans but the last, under their exact poses.
PoseCorrection after_all_but_last(const std::vector<SimulatedScan>& scans) {
  PoseCorrection correction = new_correction();
  correction.begin_epoch(scans.front().T_world_sensor);
  for (std::size_t i = 0; i + 1 < scans.size(); ++i) {
    const GroundSplit split = split_of(scans[i]);
    correction.insert(correction.correct(scans[i].T_world_sensor, split, {}), split, {});
  }
  return correction;
}

Eigen::Isometry3d perturbation(const Eigen::Vector3d& metres, const Eigen::Vector3d& degrees) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = metres;
  const Eigen::Vector3d turn = degrees * kDegrees;
  T.linear() = Eigen::AngleAxisd(turn.norm(), turn.stableNormalized()).toRotationMatrix();
  return T;
}

double degrees(const Eigen::Isometry3d& T) {
  return Eigen::AngleAxisd(T.linear()).angle() / kDegrees;
}

// Residuals of all scans but the first, whose exact poses must stay.
std::vector<PoseResidual> residuals_of_exact(PoseCorrection correction,
                                             const std::vector<SimulatedScan>& scans,
                                             const std::function<void(GroundSplit&)>& spoil) {
  std::vector<PoseResidual> residuals;
  correction.begin_epoch(scans.front().T_world_sensor);
  for (const SimulatedScan& scan : scans) {
    GroundSplit split = split_of(scan);
    spoil(split);
    const Eigen::Isometry3d T = correction.correct(scan.T_world_sensor, split, {});
    CHECK((T.matrix() - scan.T_world_sensor.matrix()).norm() == 0.0);
    correction.insert(T, split, {});
    if (correction.residual()) residuals.push_back(*correction.residual());
  }
  CHECK(residuals.size() == scans.size() - 1);
  return residuals;
}

TEST_CASE("exact poses stay, with residuals below 1 cm and 0.02 deg") {
  const auto [scene, sensor] = GENERATE(
      table<Scene, Sensor>({{Scene::kUrban, Sensor::kHdl64}, {Scene::kCrowd, Sensor::kOs1_64}}));
  const std::vector<SimulatedScan> scans = drive(scene, sensor, 15);
  std::vector<double> translations, rotations;
  for (const PoseResidual& residual :
       residuals_of_exact(new_correction(), scans, [](GroundSplit&) {})) {
    translations.push_back(residual.translation);
    rotations.push_back(residual.rotation);
  }
  CHECK(median(translations) < 0.01);
  CHECK(median(rotations) < 0.02);
  CHECK(*std::max_element(translations.begin(), translations.end()) < 0.03);
  CHECK(*std::max_element(rotations.begin(), rotations.end()) < 0.06);
}

// A point as a sensor measures it whose elevations (rad), ranges (m) and mounting (rad, about the
// axes x and y) are wrong. `of_beam`: rad, standard deviation of the elevation of each beam.
struct SensorFault {
  double elevation, range, roll, pitch, of_beam;
  static const std::vector<double> kErrors;  // of beams, standard normal

  Eigen::Vector3f operator()(const Eigen::Vector3f& point) const {
    const Eigen::Vector3d p = point.cast<double>();
    const double distance = p.head<2>().norm();
    const double right = std::atan2(p.z(), distance);
    const auto beam = static_cast<std::uint64_t>(1000.0 + std::floor(right / (0.4 * kDegrees)));
    const double angle = right + elevation + of_beam * kErrors[beam % kErrors.size()];
    const double scale = (p.norm() + range) / std::max(distance, 1e-9);
    const Eigen::Vector3d measured(scale * std::cos(angle) * p.x(), scale * std::cos(angle) * p.y(),
                                   (p.norm() + range) * std::sin(angle));
    const Eigen::AngleAxisd about_x(roll, Eigen::Vector3d::UnitX());
    const Eigen::AngleAxisd about_y(pitch, Eigen::Vector3d::UnitY());
    return (about_y * about_x * measured).cast<float>();
  }
};

const std::vector<double> SensorFault::kErrors = [] {
  Random random(17);
  std::vector<double> errors(1000);
  for (double& error : errors) error = random.normal();
  return errors;
}();

// Such errors show in all scans alike. Taken for errors of poses, they would add up.
TEST_CASE("exact poses stay if elevations, ranges or the mounting of the sensor are wrong") {
  const double elevation = GENERATE(-0.4, 0.4);
  const SensorFault fault =
      GENERATE_COPY(SensorFault{elevation * kDegrees, 0.0, 0.0, 0.0, 0.0},
                    SensorFault{0.0, 0.075 * elevation, 0.0, 0.0, 0.0},
                    SensorFault{0.0, 0.0, elevation * kDegrees, -elevation * kDegrees, 0.0},
                    SensorFault{0.0, 0.0, 0.0, 0.0, 0.25 * elevation * kDegrees});
  static const std::vector<SimulatedScan> scans = drive(Scene::kUrban, Sensor::kHdl64, 30);
  residuals_of_exact(PoseCorrection(0.003), scans, [&](GroundSplit& split) {
    for (std::size_t i = 0; i < split.count; ++i) {
      const Eigen::Vector3f p = fault({split.points.x[i], split.points.y[i], split.points.z[i]});
      split.points.x[i] = p.x();
      split.points.y[i] = p.y();
      split.points.z[i] = p.z();
    }
  });
}

// The errors allowed are those along the street, the direction with the least information.
TEST_CASE("a perturbed pose is found and corrected") {
  constexpr double kMetres = 0.035, kDegreesLeft = 0.05;
  static const std::vector<SimulatedScan> scans = drive(Scene::kUrban, Sensor::kHdl64, 8);
  const Eigen::Isometry3d& T_truth = scans.back().T_world_sensor;
  const GroundSplit split = split_of(scans.back());
  const auto [metres, turn] =
      GENERATE(table<Eigen::Vector3d, Eigen::Vector3d>({{{0.3, 0.0, 0.0}, {0.0, 0.0, 0.0}},
                                                        {{0.0, -0.3, 0.0}, {0.0, 0.0, 0.0}},
                                                        {{0.0, 0.0, 0.2}, {0.0, 0.0, 0.0}},
                                                        {{0.0, 0.0, 0.0}, {0.5, 0.0, 0.0}},
                                                        {{0.0, 0.0, 0.0}, {0.0, -0.5, 0.0}},
                                                        {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.8}},
                                                        {{0.05, 0.04, -0.03}, {0.1, 0.1, -0.2}},
                                                        {{-0.3, 0.4, 0.05}, {0.1, -0.1, 0.3}}}));
  const Eigen::Isometry3d T_wrong = T_truth * perturbation(metres, turn);
  PoseCorrection correction = after_all_but_last(scans);
  const Eigen::Isometry3d T = correction.correct(T_wrong, split, {});
  INFO(metres.transpose() << " m, " << turn.transpose() << " deg");
  REQUIRE(correction.residual());
  CHECK_FALSE(correction.misfit());
  CHECK(correction.residual()->translation == Approx(metres.norm()).margin(kMetres));
  CHECK(correction.residual()->rotation == Approx(turn.norm()).margin(kDegreesLeft));
  const Eigen::Isometry3d T_error = T_truth.inverse() * T;
  CHECK(T_error.translation().norm() < kMetres);
  CHECK(degrees(T_error) < kDegreesLeft);

  // The aligned motion does not depend on the error of the pushed pose.
  const Eigen::Isometry3d T_motion = scans[scans.size() - 2].T_world_sensor.inverse() * T_truth;
  const Eigen::Isometry3d T_difference =
      T_motion.inverse() * correction.residual()->T_previous_newest;
  CHECK(T_difference.translation().norm() < kMetres);
  CHECK(degrees(T_difference) < kDegreesLeft);
}

// Errors of the best fit, in standard deviations along each axis. Of normal errors, 99.7 % are
// below three.
TEST_CASE("the covariance of the best fit explains its errors") {
  const auto [scene, sensor] = GENERATE(
      table<Scene, Sensor>({{Scene::kUrban, Sensor::kHdl64}, {Scene::kCrowd, Sensor::kVlp16}}));
  const std::vector<SimulatedScan> scans = drive(scene, sensor, 8);
  const Eigen::Isometry3d T_motion =
      scans[scans.size() - 2].T_world_sensor.inverse() * scans.back().T_world_sensor;
  const GroundSplit split = split_of(scans.back());
  Random random(5);
  int errors = 0, large = 0;
  double largest_deviation = 0.0;
  for (int trial = 0; trial < 20; ++trial) {
    const auto draw = [&](double most) {
      const Eigen::Vector3d high = Eigen::Vector3d::Constant(most);
      return random.vector(-high, high);
    };
    PoseCorrection correction = after_all_but_last(scans);
    const Eigen::Vector3d metres = draw(0.1), turn = draw(0.2);
    correction.correct(scans.back().T_world_sensor * perturbation(metres, turn), split, {});
    REQUIRE(correction.residual());
    const PoseResidual& residual = *correction.residual();
    const Eigen::Isometry3d T_error =
        Eigen::Isometry3d(residual.T_previous_aligned).inverse() * T_motion;
    const Eigen::AngleAxisd rotation(T_error.linear());
    for (std::size_t axis = 0; axis < 6; ++axis) {
      const auto k = static_cast<int>(axis % 3);
      const double error =
          axis < 3 ? T_error.translation()[k] : rotation.angle() * rotation.axis()[k];
      const double deviation = std::sqrt(residual.covariance[7 * axis]);
      ++errors;
      large += std::abs(error) > 3.0 * deviation;
      if (residual.is_supported(axis) && axis < 3) {
        largest_deviation = std::max(largest_deviation, deviation);
      }
    }
  }
  CHECK(large <= errors / 20);
  CHECK(largest_deviation > 0.0);
  CHECK(largest_deviation <= 0.1 / 3.0);
}

TEST_CASE("a covariance goes to another frame as the errors that it describes") {
  const Eigen::Isometry3d T_a_b = perturbation({1.0, -2.0, 0.5}, {20.0, -40.0, 70.0});
  constexpr double kSmall = 1e-6;
  for (std::size_t axis = 0; axis < 6; ++axis) {
    std::array<double, 36> covariance = {};
    covariance[7 * axis] = 1.0;
    Eigen::Vector3d metres = Eigen::Vector3d::Zero(), turn = Eigen::Vector3d::Zero();
    (axis < 3 ? metres : turn)[static_cast<int>(axis % 3)] = kSmall;
    const Eigen::Isometry3d T_error =
        T_a_b * perturbation(metres, turn / kDegrees) * T_a_b.inverse();
    const Eigen::AngleAxisd rotation(T_error.linear());
    Eigen::Matrix<double, 6, 1> error;
    error << T_error.translation(), rotation.angle() * rotation.axis();
    error /= kSmall;
    const std::array<double, 36> moved = detail::transported_covariance(covariance, T_a_b);
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 6; ++j) {
        CHECK(moved[static_cast<std::size_t>(6 * i + j)] ==
              Approx(error[i] * error[j]).margin(1e-4));
      }
    }
  }
}

TEST_CASE("a lasting offset is one residual, and later poses are corrected by it") {
  const std::vector<SimulatedScan> scans = drive(Scene::kUrban, Sensor::kHdl64, 12);
  const Pose T_moved_world(Eigen::Translation3d(0.3, -0.4, 0.0));
  PoseCorrection correction = new_correction();
  correction.begin_epoch(scans.front().T_world_sensor);
  for (std::size_t i = 0; i < scans.size(); ++i) {
    const bool is_moved = i >= 6;
    const GroundSplit split = split_of(scans[i]);
    const Pose T_pushed =
        is_moved ? T_moved_world * scans[i].T_world_sensor : scans[i].T_world_sensor;
    const Eigen::Isometry3d T = correction.correct(T_pushed, split, {});
    correction.insert(T, split, {});
    INFO("scan " << i);
    CHECK((T.translation() - scans[i].T_world_sensor.translation()).norm() < 0.03);
    if (i > 0) {
      REQUIRE(correction.residual());
      const double expected = i == 6 ? 0.5 : 0.0;
      CHECK(correction.residual()->translation == Approx(expected).margin(0.03));
    }
  }
}

// A scan between two long walls along x at the position `x` (m), 20,000 points. With `vehicle`,
// 2,000 more are the rear of a vehicle that is 8 m ahead of the sensor.
GroundSplit corridor(std::uint64_t seed, float x, bool vehicle) {
  Random random(seed);
  PointBuffer points;
  for (std::size_t i = 0; i < 20000; ++i) {
    const int side = static_cast<int>(random.index(3));
    const float ahead = random.uniform_float(-30.0, 30.0) - x;
    const float left = side == 0 ? random.uniform_float(-4.0, 4.0) : side == 1 ? -4.0F : 4.0F;
    points.push_back(ahead, left, side == 0 ? -1.7F : random.uniform_float(-1.7, 2.0));
  }
  for (std::size_t i = 0; vehicle && i < 2000; ++i) {
    const float ahead = 8.0F + 0.01F * static_cast<float>(random.normal());
    const float left = random.uniform_float(-0.9, 0.9);
    points.push_back(ahead, left, random.uniform_float(-1.5, 0.0));
  }
  return test::split_of(points);
}

// The observable part of the error grows from scan to scan, and so does the other.
TEST_CASE("between two long walls, errors across them are corrected, those along them stay") {
  PoseCorrection correction = new_correction();
  correction.begin_epoch(Eigen::Isometry3d::Identity());
  for (int scan = 0; scan < 12; ++scan) {
    const float x = 0.5F * static_cast<float>(scan);
    const GroundSplit split = corridor(7 + static_cast<std::uint64_t>(scan), x, false);
    const double pushed_x = static_cast<double>(x) + 0.04 * scan;
    const Eigen::Isometry3d T_pushed =
        Eigen::Translation3d(pushed_x, 0.03 * scan, 0.0) *
        Eigen::Isometry3d(Eigen::AngleAxisd(0.2 * kDegrees * scan, Eigen::Vector3d::UnitZ()));
    const Eigen::Isometry3d T = correction.correct(T_pushed, split, {});
    INFO("scan " << scan);
    CHECK(T.translation().x() == Approx(pushed_x).margin(0.02));
    CHECK(T.translation().y() == Approx(0.0).margin(0.02));
    CHECK(degrees(T) < 0.1);
    if (scan > 0) {
      REQUIRE(correction.residual());
      const Eigen::Vector3d motion = correction.residual()->T_previous_newest.translation();
      CHECK(motion.x() == Approx(0.54).margin(0.02));
      CHECK(motion.y() == Approx(0.0).margin(0.03));
    }
    correction.insert(T, split, {});
  }
}

TEST_CASE("one object alone does not decide about a direction") {
  PoseCorrection correction = new_correction();
  correction.begin_epoch(Eigen::Isometry3d::Identity());
  for (int scan = 0; scan < 20; ++scan) {
    // The vehicle ahead drives as fast as the sensor, 2 cm per scan.
    const float x = 0.02F * static_cast<float>(scan);
    const GroundSplit split = corridor(40 + static_cast<std::uint64_t>(scan), x, true);
    const Eigen::Isometry3d T_pushed(
        Eigen::Translation3d(static_cast<double>(x), scan < 5 ? 0.0 : 0.1, 0.0));
    const Eigen::Isometry3d T = correction.correct(T_pushed, split, {});
    INFO("scan " << scan);
    CHECK(T.translation().x() == Approx(static_cast<double>(x)).margin(0.01));
    CHECK(T.translation().y() == Approx(0.0).margin(0.02));
    correction.insert(T, split, {});
  }
}

TEST_CASE("a scan of another place is lost, and a scan without points has no residual") {
  const std::vector<SimulatedScan> scans = drive(Scene::kUrban, Sensor::kHdl64, 4);
  const std::vector<SimulatedScan> others = drive(Scene::kHall, Sensor::kHdl64, 1);
  PoseCorrection correction = after_all_but_last(scans);
  const Eigen::Isometry3d tilted =
      scans.back().T_world_sensor * perturbation({0.0, 0.0, 0.4}, {6.0, 5.0, 30.0});
  correction.correct(tilted, split_of(others.front()), {});
  CHECK(correction.misfit() == EpochReason::kMisfit);
  CHECK_FALSE(correction.residual());

  PoseCorrection next = after_all_but_last(scans);
  const Eigen::Isometry3d T = next.correct(scans.back().T_world_sensor, GroundSplit(), {});
  CHECK_FALSE(next.misfit());
  CHECK_FALSE(next.residual());
  CHECK((T.matrix() - scans.back().T_world_sensor.matrix()).norm() == 0.0);
}

// Number of `points` that lie on the planes which they make.
std::size_t points_on_planes(const std::vector<Eigen::Vector3d>& points) {
  VoxelPlanes planes;
  planes.begin_scan(Pose::Identity());
  std::size_t found = 0;
  for (const bool is_asked : {false, true}) {
    for (const Eigen::Vector3d& p : points) {
      VoxelPlanes::Block block;
      block.push_back(p.x(), p.y(), p.z());
      if (is_asked) {
        planes.find(Pose::Identity(), block, [&](auto&&...) { ++found; });
      } else {
        planes.add(block);
      }
    }
  }
  return found;
}

// 3000 points of the ground, 1.7 m below the sensor. Two beams measure them at ranges `difference`
// (m) apart, with a noise along the beams.
std::vector<Eigen::Vector3d> ground_of_beams(double difference) {
  std::vector<Eigen::Vector3d> ground;
  Random random(7);
  for (int k = 0; k < 3000; ++k) {
    const double azimuth = 0.002 * k;
    const double distance = 20.2 + (k % 2) * difference;
    const Eigen::Vector3d point(distance * std::cos(azimuth), distance * std::sin(azimuth), -1.7);
    ground.push_back(point + 0.08 * random.normal() * point.normalized());
  }
  return ground;
}

// Points on a level square of 1 m at a distance of 20 m, at the height `z` (m).
std::vector<Eigen::Vector3d> level_square(double z) {
  std::vector<Eigen::Vector3d> points;
  Random random(8);
  for (int k = 0; k < 100; ++k) {
    points.emplace_back(20.0 + random.uniform(0.0, 1.0), random.uniform(0.0, 1.0), z);
  }
  return points;
}

TEST_CASE("noise along a beam makes no plane, ground of two beams does") {
  CHECK(points_on_planes(ground_of_beams(0.0)) == 0);
  CHECK(points_on_planes(ground_of_beams(0.5)) > 1500);
}

// For example foliage that one beam sees. The sine of the angle to the beams is 0.034 and 0.046.
TEST_CASE("points of one beam make no plane at any depth, ground at a small angle does") {
  CHECK(points_on_planes(level_square(-0.7)) == 0);
  CHECK(points_on_planes(level_square(-0.95)) == 100);
}

TEST_CASE("a block of points makes the planes of its single points") {
  const std::vector<Eigen::Vector3d> points = ground_of_beams(0.5);  // with runs in one voxel
  const auto planes_of = [&](std::size_t points_per_block) {
    VoxelPlanes planes;
    planes.begin_scan(Pose::Identity());
    VoxelPlanes::Block block;
    for (const Eigen::Vector3d& p : points) {
      block.push_back(p.x(), p.y(), p.z());
      if (block.count == points_per_block) planes.add(block);
    }
    planes.add(block);
    std::vector<double> distances;
    for (const Eigen::Vector3d& p : points) {
      block.count = 0;
      block.push_back(p.x(), p.y(), p.z());
      planes.find(Pose::Identity(), block, [&](std::size_t i, const auto& plane, const auto& at) {
        distances.push_back(plane.distance(at.point(i)));
      });
    }
    return distances;
  };
  const std::vector<double> expected = planes_of(1);
  REQUIRE(expected.size() > 1500);
  CHECK(planes_of(7) == expected);
  CHECK(planes_of(VoxelPlanes::Block::kMaxCount) == expected);
}

}  // namespace
}  // namespace dynains::test
