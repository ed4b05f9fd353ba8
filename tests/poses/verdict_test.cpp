// Verdicts on right and wrong poses of written recordings.

#include "dynains/io/kitti.hpp"
#include "dynains/io/trajectory.hpp"
#include "dynains/poses/diagnosis.hpp"
#include "dynains/surfaces/scan_registration.hpp"
#include "dynains/threads/in_two_threads.hpp"
#include "poses/pose_fit.hpp"
#include "simulation/config.hpp"
#include "support/catch.hpp"
#include "support/drive_of.hpp"
#include "support/scene.hpp"
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

bool is_accepted(const Diagnosis& d) {
  return d.verdict == PoseVerdict::kAgree || d.verdict == PoseVerdict::kNoMotion;
}

/// Adds errors to the horizontal places of poses.
class Noise {
 public:
  explicit Noise(double metres) : error_(0.0, metres) {}
  Pose operator()(std::size_t, Pose T) {
    const double x = error_(random_);
    T.translation() += Eigen::Vector3d(x, error_(random_), 0.0);
    return T;
  }

 private:
  std::mt19937 random_{3};
  std::normal_distribution<double> error_;
};

/// Finding on the drive as measured, with times of points, if its poses have errors of this size.
Diagnosis diagnosis_with(const Drive& drive, double metres) {
  const TemporaryFolder folder;
  drive.write_with_times(folder.path());
  std::vector<Pose> rows = drive.poses();
  Noise noise(metres);
  for (Pose& T : rows) T = noise(0, T);
  write_poses(folder / "poses.txt", rows);
  RecordingOptions options;
  options.deskew = true;
  return diagnose(Recording(folder.path(), options));
}

TEST_CASE("Right poses of a sparse sensor in a crowd raise no doubt, wrong ones do") {
  const auto seed = GENERATE(71U, 72U);
  INFO("seed " << seed);
  const Drive drive(drive_of(simulation::Scene::kCrowd, simulation::Sensor::kMid360, 40, seed));
  CHECK(is_accepted(diagnose(Recording(drive.path()))));
  CHECK_FALSE(is_accepted(diagnose(drive.with_poses(inverse_pose))));
  CHECK_FALSE(is_accepted(diagnose(drive.with_poses(Noise(0.2)))));
}

TEST_CASE("Errors that add up over many scans make poses inexact, and no mirror explains them") {
  auto config = drive_of(simulation::Scene::kGarage, simulation::Sensor::kMid360, 40, 5);
  config.ego_speed = 1.5;
  const Drive drive(config);
  CHECK(diagnose(Recording(drive.path())).verdict == PoseVerdict::kAgree);
  const auto drifting = [&](double degrees) {
    return diagnose(drive.with_poses([&](std::size_t i, const Pose& T) {
      return Pose(T *
                  Eigen::AngleAxisd(degrees * M_PI / 180.0 * double(i), Eigen::Vector3d::UnitZ()));
    }));
  };
  for (const double degrees : {0.1, 0.25, -0.25}) {
    const Diagnosis d = drifting(degrees);
    CAPTURE(degrees, d.translation_error, d.rotation_error);
    CHECK(d.verdict == PoseVerdict::kInexact);
    CHECK(d.error_span > 1);
    CHECK_FALSE(d.proposal.convention.left_handed);
  }
  const Diagnosis scaled = diagnose(drive.with_poses(scaled_poses(1.03)));
  CHECK(scaled.verdict == PoseVerdict::kInexact);
}

TEST_CASE("Exact poses are confirmed at a few places, and no others") {
  const Drive drive(drive_of(simulation::Scene::kUrban, simulation::Sensor::kVlp16, 30, 12));
  CHECK(are_poses_exact(Recording(drive.path())));
  CHECK_FALSE(are_poses_exact(drive.with_poses(Noise(0.1))));
  CHECK_FALSE(are_poses_exact(drive.with_poses(inverse_pose)));
  CHECK_FALSE(are_poses_exact(drive.with_poses(no_motion)));
  CHECK_FALSE(are_poses_exact(drive.with_poses(scaled_poses(1.05))));
}

TEST_CASE("Uneven motion within de-skewed scans does not make right poses inexact") {
  const Drive drive(skewed_world(21077));
  CHECK(diagnosis_with(drive, 0.0).verdict == PoseVerdict::kAgree);
  CHECK(diagnosis_with(drive, 0.1).verdict == PoseVerdict::kInexact);
}

TEST_CASE("Reversed times of points bring the advice not to de-skew") {
  const Drive drive(skewed_world(42001));
  const TemporaryFolder folder;
  drive.write_with_times(folder.path(), [](double s) { return 0.1 - s; });
  RecordingOptions options;
  options.deskew = true;
  const Diagnosis d = diagnose(Recording(folder.path(), options));
  CHECK(d.verdict == PoseVerdict::kOtherwise);
  CHECK_FALSE(d.proposal.deskew);
}

/// Writes the drive as clouds of this many turns, with the poses at their begin.
void write_turns(const Drive& drive, double turns, const std::filesystem::path& folder) {
  const double period = 0.1 * turns;  // s
  std::filesystem::create_directories(folder / "velodyne");
  std::vector<std::pair<double, Eigen::Vector4f>> points;  // by their time, s
  for (std::size_t i = 0; i < drive.size(); ++i) {
    const simulation::SimulatedScan& scan = drive.scan(i);
    for (std::size_t k = 0; k < scan.times.size(); ++k) {
      points.emplace_back(scan.time + static_cast<double>(scan.times[k]),
                          Eigen::Vector4f::Map(&scan.xyzi[4 * k]));
    }
  }
  std::stable_sort(points.begin(), points.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<Pose> poses;
  std::vector<double> times;
  auto point = points.begin();
  for (std::size_t i = 0; i + 1 < drive.size(); ++i) {
    const double time = period * static_cast<double>(i), at = time / 0.1;
    const auto before = static_cast<std::size_t>(at);
    if (before + 2 >= drive.size()) break;
    std::vector<float> xyzi;
    for (; point->first < time + period; ++point) {
      xyzi.insert(xyzi.end(), point->second.data(), point->second.data() + 4);
    }
    write_scan(folder / "velodyne" / (simulation::scan_name(i) + ".bin"), xyzi);
    poses.push_back(
        interpolate(drive.pose(before), drive.pose(before + 1), at - static_cast<double>(before)));
    times.push_back(time);
  }
  write_poses(folder / "poses.txt", poses);
  write_times(folder / "times.txt", times);
}

TEST_CASE("Right poses of clouds of more than a turn are given no other reading") {
  simulation::Config config =
      drive_of(simulation::Scene::kUrban, simulation::Sensor::kVlp16, 40, 82);
  config.ego_speed = 9.0;
  config.rolling_shutter = true;
  config.deskewed = 0.0;
  const Drive drive(config);
  for (const double turns : {1.008, 1.04, 1.09}) {
    CAPTURE(turns);
    const TemporaryFolder folder;
    write_turns(drive, turns, folder.path());
    CHECK(diagnose(Recording(folder.path())).sound());
  }
}

TEST_CASE("Traces of beams, open directions and swaying do not make right poses inexact") {
  auto config = simulation::random_world(GENERATE(21001U, 840010U, 840015U, 840030U, 840059U));
  config.scans = config.seed == 21001 ? 30 : 20;
  CAPTURE(config.seed);
  const Drive drive(config);
  CHECK(is_accepted(diagnose(Recording(drive.path()))));
  CHECK_FALSE(is_accepted(diagnose(drive.with_poses(Noise(0.1)))));
}

TEST_CASE("Right poses of a sparse sensor that comes to rest are no other recording's") {
  const Drive drive(skewed_world(23009));
  CHECK(diagnosis_with(drive, 0.0).sound());
  CHECK(diagnosis_with(drive, 0.2).verdict != PoseVerdict::kAgree);
}

TEST_CASE("A drive that stands for most of the time tells what its poses mean") {
  const Drive drive(drive_of(simulation::Scene::kVegetation, simulation::Sensor::kVlp16, 60, 112));
  CHECK(diagnose(Recording(drive.path())).sound());
  const Diagnosis d = diagnose(drive.with_poses(inverse_pose));
  CHECK(d.verdict == PoseVerdict::kOtherwise);
  CHECK(d.proposal.convention.invert);
}

TEST_CASE("Jumps of the poses of a slow sensor are no other reading of them") {
  auto config = drive_of(simulation::Scene::kUrban, simulation::Sensor::kVlp16, 80, 1);
  config.ego_speed = 0.15;
  const Diagnosis d = diagnose(Drive(config).with_poses([](std::size_t i, const Pose& T) {
    return i % 9 == 8 ? Pose(Eigen::Translation3d(0.0, 0.07, 0.0) * T) : T;
  }));
  CHECK(d.verdict == PoseVerdict::kAgree);
}

TEST_CASE("Poses that stand are right if the sensor stands, and wrong if it moves") {
  auto config = drive_of(simulation::Scene::kHighway, simulation::Sensor::kMid360, 30, 603);
  const auto standing = [&](double metres_per_second) {
    config.ego_speed = metres_per_second;
    return diagnose(Drive(config).with_poses(no_motion));
  };
  CHECK(standing(0.0).verdict == PoseVerdict::kNoMotion);
  CHECK(standing(10.0).verdict == PoseVerdict::kDisagree);
}

/// Writes 30 scans of 16 beams, 0.8 m over the floor of an empty box of this size (m), by a sensor
/// that moves along x by `step` (m) from scan to scan. Clouds are in a frame on the floor if
/// `is_on_floor`, which the poses are of. `drift`: m a scan along y, of the poses alone.
void write_box(const std::filesystem::path& folder, const Eigen::Vector3d& size, double step,
               bool is_on_floor, double drift = 0.0) {
  constexpr int kScans = 30, kBeams = 16, kColumns = 900;
  constexpr double kHeight = 0.8;
  const Eigen::Vector3d high(0.5 * size.x(), 0.5 * size.y(), size.z() - kHeight);
  const Eigen::Vector3d low(-high.x(), -high.y(), -kHeight);
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0.0, 0.01);
  std::filesystem::create_directories(folder / "velodyne");
  std::vector<Pose> poses;
  for (int scan = 0; scan < kScans; ++scan) {
    const Eigen::Vector3d place(step * scan, 0.0, 0.0);
    std::vector<float> xyzi;
    for (int k = 0; k < kBeams * kColumns; ++k) {
      const double elevation = (-25.0 + 2.5 * (k % kBeams)) * M_PI / 180.0;
      const double azimuth = 2.0 * M_PI * (k / kBeams) / kColumns;
      const Eigen::Vector3d ray = dynains::test::ray_of(elevation, azimuth);
      const double range = dynains::test::range_to_wall(place, ray, low, high);
      if (range > 40.0) continue;
      Eigen::Vector3d p = (range + noise(random)) * ray;
      if (is_on_floor) p.z() += kHeight;
      for (const double value : {p.x(), p.y(), p.z(), 0.3}) {
        xyzi.push_back(static_cast<float>(value));
      }
    }
    write_scan(folder / "velodyne" / (simulation::scan_name(std::size_t(scan)) + ".bin"), xyzi);
    poses.emplace_back(Eigen::Translation3d(place.x(), drift * scan, 0.0));
  }
  write_poses(folder / "poses.txt", poses);
}

TEST_CASE("Right poses in a smooth corridor are sound, and those that leave it are not") {
  const TemporaryFolder folder;
  const Eigen::Vector3d corridor(300.0, 2.2, 2.6);
  const double step = GENERATE(0.1, 1.0);  // m
  write_box(folder.path(), corridor, step, false);
  const Diagnosis d = diagnose(Recording(folder.path()));
  CHECK(d.verdict == PoseVerdict::kNoMotion);
  CHECK_FALSE(d.flaws.has_equal_orientations);
  write_box(folder.path(), corridor, step, false, 0.3);
  CHECK_FALSE(diagnose(Recording(folder.path())).sound());
}

TEST_CASE("The origin of clouds in another frame is measured from their beams, a right one kept") {
  const TemporaryFolder folder;
  const bool is_on_floor = GENERATE(true, false);
  const double step = GENERATE(0.1, 0.0);  // m
  write_box(folder.path(), {14.0, 11.0, 3.2}, step, is_on_floor);
  RecordingOptions options;
  const Eigen::Vector3d right(0.0, 0.0, is_on_floor ? 0.8 : 0.0);
  for (const double height : {0.0, 0.8, 1.6}) {
    options.sensor_origin = Eigen::Vector3d(0.0, 0.0, height);
    const Diagnosis d = diagnose(Recording(folder.path(), options));
    const bool is_right = height == right.z();
    CHECK(d.sound() == is_right);
    CHECK((d.proposal.sensor_origin - right).norm() < 0.02);
  }
}

TEST_CASE("The height of an origin is measured also from beams with noise of their directions") {
  auto config = drive_of(simulation::Scene::kMixed, simulation::Sensor::kOs1_64, 20, 42001);
  config.direction_noise = 0.045;
  const Drive drive(config);
  CHECK(diagnose(Recording(drive.path())).proposal.sensor_origin.isZero(0.0));
  const Eigen::Vector3d origin(1.0, 0.0, 1.5);
  drive.move_points(
      [&](const simulation::SimulatedScan&, const Eigen::Vector3d& p) { return p + origin; });
  const Diagnosis d = diagnose(drive.with_poses(
      [&](std::size_t, const Pose& T) { return T * Eigen::Translation3d(-origin); }));
  CHECK_FALSE(d.sound());
  CHECK(std::abs(d.proposal.sensor_origin.z() - origin.z()) < 0.1);
}

TEST_CASE("Noise of directions beside a near wall does not shift the origin of beams") {
  auto config = simulation::random_world(840048);  // 16 beams, 0.37 m over a car park
  config.scans = 20;
  CHECK(diagnose(Recording(Drive(config).path())).sound());
}

TEST_CASE("Clouds without rings, of one time or not, say nothing of the origin of their beams") {
  const auto sensor = GENERATE(simulation::Sensor::kMid360, simulation::Sensor::kLivox);
  const Drive drive(drive_of(simulation::Scene::kUrban, sensor, 12, 5));
  CHECK(diagnose(Recording(drive.path())).proposal.sensor_origin.isZero(0.0));
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
    return RegistrationScan(points).surfaces().find(2, middle) != nullptr;
  };
  const auto sign = GENERATE(1.0, -1.0);
  CHECK_FALSE(has_surface(10.5, 0.035 * sign));
  CHECK(has_surface(10.5, 0.045 * sign));
  CHECK_FALSE(has_surface(20.5, 0.035 * sign));
  CHECK(has_surface(20.5, 0.045 * sign));
}

TEST_CASE("Right poses on a motorway are sound with oncoming traffic and with few beams ahead") {
  const simulation::Config empty_road =
      drive_of(simulation::Scene::kHighway, simulation::Sensor::kLivox, 24, 61);
  for (const simulation::Config& config : {short_world(21057), empty_road}) {
    const Drive drive(config);
    const Diagnosis right = diagnose(Recording(drive.path()));
    CHECK(right.sound());
    if (config.seed == 21057) CHECK(right.verdict != PoseVerdict::kInexact);
    const Diagnosis inverse = diagnose(drive.with_poses(inverse_pose));
    CHECK(inverse.proposal.convention.invert);
    const Diagnosis in_mm = diagnose(drive.with_poses(scaled_poses(1000.0)));
    CHECK(in_mm.proposal.convention.unit == 0.001);
  }
}

TEST_CASE("Traffic on both lanes of a tunnel does not refute right poses") {
  auto config = simulation::random_world(870012);
  config.scans = 40;
  CHECK(diagnose(Recording(Drive(config).path())).sound());
}

TEST_CASE("Traffic of nearly the own speed does not make right ways too long, and wrong ones are") {
  simulation::Config config = short_world(22025);
  config.seed = 5;
  const Drive drive(config);
  CHECK(diagnose(Recording(drive.path())).sound());
  const Diagnosis scaled = diagnose(drive.with_poses(scaled_poses(1.1)));
  CHECK(scaled.verdict == PoseVerdict::kOtherwise);
  CHECK(scaled.proposal.convention.scale == Approx(1.0 / 1.1).margin(0.02));
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

}  // namespace
}  // namespace dynains::test
