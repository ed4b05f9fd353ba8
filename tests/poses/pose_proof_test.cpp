// Right poses of sparse sensors are accepted, and jumps of poses are found, in written recordings.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "dynains/poses/diagnosis.hpp"
#include "dynains/poses/pose_jumps.hpp"
#include "dynains/simulation/random_world.hpp"
#include "poses/in_two_threads.hpp"
#include "poses/pose_diagnosis.hpp"
#include "poses/scan_registration.hpp"
#include "support/catch.hpp"
#include "support/drive_of.hpp"
#include "support/written_drive.hpp"

namespace dynains::test {
namespace {

using Drive = WrittenDrive;

simulation::Config short_world(std::uint64_t seed) {
  simulation::Config config = simulation::random_world(seed);
  config.scans = 30;
  return config;
}

/// As measured, with times of points.
simulation::Config skewed_world(std::uint64_t seed) {
  simulation::Config config = short_world(seed);
  config.rolling_shutter = true;
  config.deskewed = 0.0;
  return config;
}

/// Finding on the drive as measured, with times of points, if its poses have errors of this size.
Diagnosis diagnosis_with(
    const Drive& drive, double metres,
    const std::function<double(double)>& time_of = [](double s) { return s; }) {
  const TemporaryFolder folder;
  drive.write_with_times(folder.path(), time_of);
  std::mt19937 random(3);
  std::normal_distribution<double> error(0.0, metres);
  std::vector<Pose> rows = drive.poses();
  for (Pose& T : rows) T.translation() += Eigen::Vector3d(error(random), error(random), 0.0);
  write_poses(folder / "poses.txt", rows);
  RecordingOptions options;
  options.deskew = true;
  return diagnose(Recording(folder.path(), options));
}

Pose sideways(double metres, double degrees) {
  Pose T = Pose::Identity();
  T.linear() =
      Eigen::AngleAxisd(degrees * M_PI / 180.0, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  T.translation().y() = metres;
  return T;
}

TEST_CASE("Right poses of a sparse sensor in a crowd raise no doubt, wrong ones do") {
  const auto seed = GENERATE(71U, 72U);
  INFO("seed " << seed);
  const Drive drive(drive_of(simulation::Scene::kCrowd, simulation::Sensor::kMid360, 40, seed));
  const Diagnosis right = diagnose(Recording(drive.path()));
  CHECK((right.verdict == PoseVerdict::kAgree || right.verdict == PoseVerdict::kNoMotion));
  CHECK(right.option.empty());

  const auto is_accepted = [&](const Diagnosis& d) {
    return d.verdict == PoseVerdict::kAgree || d.verdict == PoseVerdict::kNoMotion;
  };
  CHECK_FALSE(is_accepted(
      diagnose(drive.with_poses([](std::size_t, const Pose& T) { return Pose(T.inverse()); }))));
  std::mt19937 random(3);
  std::normal_distribution<double> metres(0.0, 0.2);
  const Diagnosis noisy = diagnose(drive.with_poses([&](std::size_t, Pose T) {
    T.translation() += Eigen::Vector3d(metres(random), metres(random), metres(random));
    return T;
  }));
  CHECK_FALSE(is_accepted(noisy));
}

TEST_CASE("Uneven motion within de-skewed scans does not make right poses inexact") {
  const Drive drive(skewed_world(21077));
  CHECK(diagnosis_with(drive, 0.0).verdict == PoseVerdict::kAgree);
  CHECK(diagnosis_with(drive, 0.1).verdict == PoseVerdict::kInexact);
}

TEST_CASE("Traces of beams on the persons of a crowd do not make right poses inexact") {
  const Drive drive(short_world(21001));
  CHECK(diagnose(Recording(drive.path())).verdict == PoseVerdict::kAgree);
  const Diagnosis noisy =
      diagnose(drive.with_poses([random = std::mt19937(3)](std::size_t, Pose T) mutable {
        std::normal_distribution<double> metres(0.0, 0.1);
        T.translation() += Eigen::Vector3d(metres(random), metres(random), 0.0);
        return T;
      }));
  CHECK(noisy.verdict == PoseVerdict::kInexact);
}

TEST_CASE("Right poses of a sparse sensor that comes to rest are no other recording's") {
  const Drive drive(skewed_world(23009));
  CHECK(diagnosis_with(drive, 0.0).verdict == PoseVerdict::kAgree);
  CHECK(diagnosis_with(drive, 0.2).verdict != PoseVerdict::kAgree);
}

TEST_CASE("A plane that contains the beam through it is no surface") {
  const auto has_surface = [](double range, double sine_to_beam) {
    const Eigen::Vector3d middle(range, 0.5, 0.5);
    const double sine = sine_to_beam + middle.z() / middle.norm();
    const Eigen::Vector3d along(std::sqrt(1.0 - sine * sine), 0.0, sine);
    PointBuffer points;
    for (int i = -4; i <= 4; ++i) {
      for (int k = -4; k <= 4; ++k) {
        const Eigen::Vector3f p =
            (middle + 0.1 * i * along + 0.1 * k * Eigen::Vector3d::UnitY()).cast<float>();
        points.push_back(p.x(), p.y(), p.z());
      }
    }
    return RegistrationScan(points).find(2, middle) != nullptr;
  };
  const auto sign = GENERATE(1.0, -1.0);
  CHECK_FALSE(has_surface(10.5, 0.035 * sign));
  CHECK(has_surface(10.5, 0.045 * sign));
  CHECK_FALSE(has_surface(20.5, 0.45 / 20.5 * sign));
  CHECK(has_surface(20.5, 0.55 / 20.5 * sign));  // ground far away
}

TEST_CASE("Sway alone tells times of points that run backwards") {
  const Drive drive(skewed_world(9304));
  const double period = drive.scan(1).time - drive.scan(0).time;
  CHECK(diagnosis_with(drive, 0.0).point_times.empty());
  CHECK(diagnosis_with(drive, 0.0, [&](double s) { return period - s; }).verdict ==
        PoseVerdict::kPointTimes);
}

TEST_CASE("Oncoming traffic on a motorway does not contradict right poses") {
  const Drive drive(short_world(21057));
  const Diagnosis right = diagnose(Recording(drive.path()));
  CHECK(right.sound());
  CHECK(right.verdict != PoseVerdict::kInexact);
  CHECK_FALSE(diagnose(drive.with_poses([](std::size_t, const Pose& T) {
                return Pose(T.inverse());
              })).sound());
  CHECK_FALSE(diagnose(drive.with_poses([](std::size_t, Pose T) {
                T.translation() *= 1000.0;
                return T;
              })).sound());
}

TEST_CASE("Traffic of nearly the own speed does not make right ways too long, and wrong ones are") {
  const Drive drive(short_world(22025));
  CHECK(diagnose(Recording(drive.path())).sound());
  const Diagnosis scaled = diagnose(drive.with_poses([](std::size_t, Pose T) {
    T.translation() *= 1.1;
    return T;
  }));
  CHECK(scaled.verdict == PoseVerdict::kScaled);
  CHECK(scaled.convention.scale == Approx(1.0 / 1.1).margin(0.02));
}

TEST_CASE("A few registrations confirm right poses, and never those of a turned body") {
  const auto sensor = GENERATE(simulation::Sensor::kOs1_64, simulation::Sensor::kVlp16);
  const Drive drive(drive_of(simulation::Scene::kStopAndGo, sensor, 40, 4));
  CHECK(confirms_poses(Recording(drive.path()), 0, 39));
  CHECK_FALSE(confirms_poses(
      drive.with_poses([](std::size_t, const Pose& T) { return Pose(T * sideways(0.0, 90.0)); }), 0,
      39));
  CHECK_FALSE(confirms_poses(
      drive.with_poses([](std::size_t, const Pose& T) { return Pose(T.inverse()); }), 0, 39));
}

TEST_CASE("Few registrations prove poses whose errors are below 3 cm, and no others") {
  const Drive drive(drive_of(simulation::Scene::kStopAndGo, simulation::Sensor::kOs1_64, 40, 4));
  double longest = 0.0;  // m, over five scans
  for (std::size_t i = 0; i + 5 < drive.size(); ++i) {
    longest =
        std::max(longest, (drive.pose(i + 5).translation() - drive.pose(i).translation()).norm());
  }
  const auto is_proven = [&](double error) {
    const Recording recording = drive.with_poses([&](std::size_t, Pose T) {
      T.translation() *= 1.0 + error / longest;
      return T;
    });
    Diagnosis d;
    d.verdict = PoseVerdict::kAgree;
    return accept_proven_poses(recording, d);
  };
  INFO(longest << " m");
  CHECK(is_proven(0.0));
  CHECK(is_proven(0.02));
  CHECK_FALSE(is_proven(0.04));
}

TEST_CASE("Results of two threads keep their order, and the first exception is thrown") {
  const auto squares = in_two_threads(100, [](std::size_t i) { return i * i; });
  REQUIRE(squares.size() == 100);
  for (std::size_t i = 0; i < squares.size(); ++i) CHECK(squares[i] == i * i);
  const auto fail_from = [](std::size_t first) {
    in_two_threads(100, [&](std::size_t i) {
      return i < first ? i : throw std::out_of_range(std::to_string(i));
    });
  };
  CHECK_THROWS_WITH(fail_from(7), "7");
  CHECK_NOTHROW(fail_from(100));
  CHECK(in_two_threads(0, [](std::size_t i) { return i; }).empty());
}

TEST_CASE("Jumps of poses are found with scan and size, and none in right poses") {
  const Drive drive(drive_of(simulation::Scene::kUrban, simulation::Sensor::kOs1_64, 40, 41));
  CHECK(find_pose_jumps(Recording(drive.path()), 0, 39).empty());
  const auto [metres, degrees] = GENERATE(
      table<double, double>({{0.3, 0.3}, {1.5, 0.0}, {3.0, 2.0}, {0.0, 5.0}, {20.0, 0.0}}));
  INFO(metres << " m, " << degrees << " deg");
  const Pose& T_world_c = drive.pose(20);
  const Pose change = T_world_c * sideways(metres, degrees) * T_world_c.inverse();
  const Recording recording =
      drive.with_poses([&](std::size_t i, const Pose& T) { return i < 20 ? T : Pose(change * T); });
  const std::vector<PoseJump> jumps = find_pose_jumps(recording, 0, 39);
  REQUIRE(jumps.size() == 1);
  CHECK(jumps[0].scan == 20);
  CHECK(jumps[0].translation == Approx(metres).margin(0.1));
  CHECK(jumps[0].rotation == Approx(degrees).margin(0.3));
  CHECK_THAT(sentence_on(recording, jumps), StartsWith("poses jump 1 time, at scan 000020 by "));
}

}  // namespace
}  // namespace dynains::test
