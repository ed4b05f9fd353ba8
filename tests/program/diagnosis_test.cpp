// Findings of `dynains check` on simulated streets with all usual mistakes in the poses.
#include "dynains/poses/diagnosis.hpp"

#include "dynains/io/trajectory.hpp"
#include "program/run_folder.hpp"
#include "run/remarks/recording_check.hpp"
#include "support/catch.hpp"
#include "support/drive_of.hpp"
#include "support/written_drive.hpp"

using namespace dynains;
using namespace dynains::test;

namespace {

using Poses = std::vector<Pose>;

/// A drive around the bends of a hilly street.
simulation::Config bends() {
  simulation::Config config =
      drive_of(simulation::Scene::kHill, simulation::Sensor::kVlp16, 24, 18);
  config.rate = 5.0;
  config.sensor_height = 1.9;
  return config;
}

/// A drive with bends and changes of speed, by a sensor whose scans determine its motion well.
simulation::Config dense() {
  simulation::Config config =
      drive_of(simulation::Scene::kStopAndGo, simulation::Sensor::kOs1_64, 24, 4);
  config.rate = 5.0;
  return config;
}

class Street : public WrittenDrive {
 public:
  explicit Street(const simulation::Config& config = bends()) : WrittenDrive(config) {}

  Diagnosis diagnose(const std::function<Eigen::Isometry3d(Eigen::Isometry3d)>& spoil) const {
    return dynains::diagnose(
        with_poses([&](std::size_t, const Pose& T) { return Pose(spoil(T)); }));
  }
  /// The flags that a diagnosis of the present poses proposes.
  std::string flags(const Diagnosis& diagnosis) const {
    return run::proposed_flags(Recording(path()), diagnosis.proposal);
  }
  std::string advice(const Diagnosis& diagnosis) const {
    return run::advice(Recording(path()), diagnosis);
  }
};

Eigen::Isometry3d scaled(Eigen::Isometry3d pose, double factor) {
  pose.translation() *= factor;
  return pose;
}

}  // namespace

TEST_CASE("check names the mistake in the poses and the option against it") {
  const Street street;
  const Diagnosis sound = street.diagnose([](const Eigen::Isometry3d& T) { return T; });
  CHECK(sound.verdict == PoseVerdict::kAgree);
  CHECK(sound.sound());
  CHECK_THAT(street.advice(sound), ContainsSubstring("agree as they are"));
  CHECK(sound.scan_files == 24);
  CHECK(sound.pose_rows == 24);
  REQUIRE(sound.mounting.known);
  CHECK(std::abs(sound.mounting.height - 1.9) < 0.1);
  CHECK(sound.invalid_share == 0.0);

  const auto option_of = [&](auto&& spoil) {
    const Diagnosis diagnosis = street.diagnose(spoil);
    CHECK(diagnosis.verdict == PoseVerdict::kOtherwise);
    return street.flags(diagnosis);
  };
  const Eigen::Isometry3d axes = camera_axes();
  CHECK(option_of([](const Eigen::Isometry3d& T) { return T.inverse(); }) == "--invert-poses");
  CHECK(option_of([](const Eigen::Isometry3d& T) { return scaled(T, 1000.0); }) ==
        "--pose-units mm");
  CHECK(option_of([](const Eigen::Isometry3d& T) { return scaled(T, 100.0); }) ==
        "--pose-units cm");
  CHECK(option_of([&](const Eigen::Isometry3d& T) { return axes * T * axes.inverse(); }) ==
        "--pose-frame camera");
  CHECK(option_of([&](const Eigen::Isometry3d& T) {
          return scaled((axes * T * axes.inverse()).inverse(), 1000.0);
        }) == "--invert-poses --pose-units mm --pose-frame camera");

  std::vector<double> times;
  for (std::size_t i = 0; i < street.size(); ++i) times.push_back(0.2 * static_cast<double>(i));
  const auto pose_of = [&](std::size_t i) { return street.pose(i); };
  write_text(street.path() / "poses.txt", timed_rows(times, pose_of, true));
  const Diagnosis quaternions = diagnose(Recording(street.path()));
  CHECK(quaternions.verdict == PoseVerdict::kOtherwise);
  CHECK(street.flags(quaternions) == "--quaternion-order wxyz");

  // The named option corrects the mistake.
  RecordingOptions options;
  options.convention.quaternion = QuaternionOrder::kWxyz;
  const Recording healed(street.path(), options);
  CHECK(diagnose(healed).verdict == PoseVerdict::kAgree);
}

TEST_CASE("check names poses that belong to the scan before or behind, if the drive shows it") {
  simulation::Config config = bends();
  config.scene = simulation::Scene::kUrban;
  config.seed = 4;
  const Street street(config);
  const auto diagnosis_of = [&](int shift) {
    RecordingOptions options;
    options.convention.shift = shift;
    const Recording recording(street.path(), options);
    const Diagnosis d = diagnose(recording);
    return std::pair(d.verdict, run::proposed_flags(recording, d.proposal));
  };
  CHECK(diagnosis_of(0) == std::pair(PoseVerdict::kAgree, std::string()));
  for (const int shift : {-2, -1, 1, 2}) {
    CAPTURE(shift);
    CHECK(diagnosis_of(shift) == std::pair(PoseVerdict::kOtherwise, std::string("--pose-shift 0")));
  }
}

TEST_CASE("check estimates the place of the lidar in the body whose poses are given") {
  const Street street(dense());
  const Eigen::Isometry3d T_body_sensor(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ()));
  const auto of_body = [&](const Eigen::Isometry3d& T) { return T * T_body_sensor.inverse(); };
  const Diagnosis yawed = street.diagnose(of_body);
  CHECK(yawed.verdict == PoseVerdict::kOtherwise);
  CHECK_THAT(street.advice(yawed), ContainsSubstring("pose of the lidar in the body") &&
                                       ContainsSubstring("pass --extrinsic \""));
  const Eigen::Isometry3d found = yawed.proposal.convention.T_body_sensor;
  CHECK(Eigen::AngleAxisd(found.linear().transpose() * T_body_sensor.linear()).angle() < 0.03);
  CHECK(found.translation().norm() < 0.3);

  // The flag that check prints corrects the poses.
  const std::string seq = street.path();
  const std::string pose = extrinsic_text(found);
  check_says(start({"check", seq}), 1,
             "\n    dynains run " + seq + " --extrinsic \"" + pose + "\" --out OUT\n");
  check_says(start({"check", seq, "--extrinsic", pose}), 0, "agree as they are");
}

TEST_CASE("check estimates the offset of the clocks") {
  const Street street(dense());
  std::vector<double> times, late_times;
  for (std::size_t i = 0; i < street.size(); ++i) {
    times.push_back(0.2 * static_cast<double>(i));
    late_times.push_back(times.back() + 0.15);
  }
  write_times(street.path() / "times.txt", times);
  const std::string rows = timed_rows(late_times, [&](std::size_t i) { return street.pose(i); });
  write_text(street.path() / "poses.txt", rows);
  const Diagnosis late = diagnose(Recording(street.path()));
  CHECK(late.verdict == PoseVerdict::kOtherwise);
  CHECK(std::abs(late.proposal.time_offset - 0.15) < 0.02);
  RecordingOptions options;
  options.time_offset = late.proposal.time_offset;
  CHECK(diagnose(Recording(street.path(), options)).verdict == PoseVerdict::kAgree);

  // A trajectory with fewer poses than the default gap allows.
  std::string sparse = rows.substr(0, rows.find('\n') + 1);
  sparse += rows.substr(rows.rfind('\n', rows.size() - 2) + 1);
  write_text(street.path() / "poses.txt", sparse);
  check_refused(start({"check", street.path()}), 1, "Poses are 4.6 s apart: --pose-gap takes them");
}

TEST_CASE("check gives the error of inexact poses in centimetres and degrees") {
  const Street street(dense());
  std::mt19937 random(3);
  std::normal_distribution<double> metres(0.0, 0.05);
  const Diagnosis noisy = street.diagnose([&](Eigen::Isometry3d T) {
    T.translation() += Eigen::Vector3d(metres(random), metres(random), metres(random));
    return T;
  });
  CHECK(noisy.verdict == PoseVerdict::kInexact);
  CHECK(noisy.sound());
  // Median length of the difference of two errors with a deviation of 5 cm an axis.
  CHECK(noisy.translation_error == Approx(0.05 * std::sqrt(2.0) * 1.54).epsilon(0.35));
  CHECK(noisy.registered_pairs >= 8);
  CHECK_THAT(street.advice(noisy), ContainsSubstring("inexact by about 1") &&
                                       ContainsSubstring(" deg from one scan to the next"));
}

TEST_CASE("check reports what it cannot decide") {
  const Street street;
  // Poses as if every scan came from another place.
  std::size_t i = 0;
  const Diagnosis chaos = street.diagnose([&](const Eigen::Isometry3d&) {
    const auto x = static_cast<double>((7919 * ++i) % 101);
    return Eigen::Isometry3d(Eigen::Translation3d(x, 0.0, 0.0));
  });
  CHECK(chaos.verdict == PoseVerdict::kDisagree);
  CHECK_FALSE(chaos.sound());

  const TemporaryFolder folder;
  write_text(folder / "velodyne/0.bin", std::string(16, '\0'));
  write_text(folder / "poses.txt", pose_row());
  const Diagnosis one = diagnose(Recording(folder.path()));
  CHECK(one.verdict == PoseVerdict::kUnknown);
  CHECK(one.invalid_share == 1.0);
  CHECK_FALSE(one.mounting.known);
}

TEST_CASE("check and run report a problem in one sentence") {
  const Street street;
  Poses inverse;
  for (const Pose& pose : street.poses()) inverse.push_back(pose.inverse());
  write_poses(street.path() / "poses.txt", inverse);
  const std::string seq = street.path();

  const Outcome wrong = start({"check", seq});
  check_says(wrong, 1,
             "pass --invert-poses.\n    dynains run " + seq + " --invert-poses --out OUT\n");
  CHECK(wrong.err.empty());
  check_says(start({"check", seq, "--invert-poses"}), 0, "agree as they are");
  CHECK_THAT(
      start({"check", seq, "--left-handed-poses", "--pose-units", "cm", "--invert-poses"}).out,
      ContainsSubstring("leave out --left-handed-poses, pass --pose-units m.\n"));

  const TemporaryFolder out;
  const Outcome stopped = start({"run", seq, "-o", out / "wrong", "-q"});
  CHECK(stopped.code == 2);
  CHECK_THAT(
      stopped.err,
      StartsWith("dynains: error: Scans agree under other options (--invert-poses: poses are "
                 "from the world to the sensor") &&
          ContainsSubstring("pass --invert-poses. See: dynains check " + seq) &&
          ContainsSubstring("--accept-poses"));
  CHECK_FALSE(fs::exists(out / "wrong"));
  const Outcome warned = succeed(start({"run", seq, "-o", out / "wrong", "-q", "--accept-poses"}));
  CHECK_THAT(warned.err, !ContainsSubstring("Scans agree under other options"));
  const Outcome fine = succeed(start({"run", seq, "-o", out / "right", "-q", "--invert-poses"}));
  CHECK(fine.err.empty());
}

TEST_CASE("Proposed commands repeat the flags of the user, as a shell reads them") {
  const Street street;
  Poses millimetres;
  for (const Pose& pose : street.poses()) {
    millimetres.push_back(scaled(pose, 1000.0).inverse());
  }
  const std::string poses = street.path() / "a user's poses.txt";
  write_poses(poses, millimetres);
  const std::string seq = street.path();
  const Outcome outcome = start({"check", seq, "--poses", poses, "--invert-poses", "--pose-shift",
                                 "0", "--extrinsic", "0 0 0 0 0 0 1"});
  check_says(
      outcome, 1,
      "\n    dynains run " + seq + " --poses '" + seq + "/a user'\\''s poses.txt' --invert-poses");
  CHECK_THAT(outcome.out,
             ContainsSubstring(" --pose-shift 0 --extrinsic '0 0 0 0 0 0 1' --pose-units mm "
                               "--out OUT\n"));
}

TEST_CASE("check tells if there are more poses than scans") {
  const Street street;
  Poses poses = street.poses();
  poses.resize(30, poses.back());
  write_poses(street.path() / "poses.txt", poses);
  check_says(
      start({"check", street.path()}), 0,
      " 30 poses for 24 scans in poses.txt: row N belongs to the scan with number N, counted "
      "from 0; if clouds");
  poses.resize(60, poses.back());  // of a longer recording
  write_poses(street.path() / "poses.txt", poses);
  CHECK_THAT(start({"check", street.path()}).out,
             !ContainsSubstring("if clouds were lost") && ContainsSubstring("counted from 0\n"));
}

TEST_CASE("check verifies the size of every scan file") {
  const Street street;
  const std::string seq = street.path();
  fs::resize_file(street.file_of(21), fs::file_size(street.file_of(21)) - 3);
  const std::string first =
      "dynains: error: " + (street.file_of(21)).string() + ": truncated at byte " +
      std::to_string(fs::file_size(street.file_of(21))) + ": expected a multiple of 16 bytes";
  const Outcome one = start({"check", seq});
  CHECK(one.code == 1);
  CHECK_THAT(one.err, StartsWith(first) && !ContainsSubstring("more scan files"));
  fs::resize_file(street.file_of(22), 7);
  fs::resize_file(street.file_of(23), 17);
  const Outcome three = start({"check", seq});
  CHECK(three.code == 1);
  CHECK(start({"check", seq, "--accept-missing"}).code == 0);
  CHECK_THAT(three.err,
             StartsWith(first) && ContainsSubstring("; 2 more scan files are broken; "
                                                    "--accept-missing leaves such files out\n"));
}

TEST_CASE("check and run report scans that are too far apart in time to be compared") {
  const Street street;
  std::string times;  // a pause after each fifth scan
  for (std::size_t i = 0; i < street.size(); ++i) times += std::to_string(i + 95 * (i / 5)) + '\n';
  write_text(street.path() / "times.txt", times);
  const std::string seq = street.path();
  const TemporaryFolder out;
  const Outcome check = start({"check", seq});
  CHECK(check.code == 1);
  CHECK_THAT(check.out, ContainsSubstring("\n4 of 24 scans come so long after") &&
                            ContainsSubstring("--max-gap") &&
                            !ContainsSubstring("no option is needed"));
  const Outcome warned = succeed(start({"run", seq, "-o", out / "alone", "-q"}));
  CHECK_THAT(warned.err, StartsWith("dynains: warning: 4 of 24 scans come so long after"));
  const Outcome told = succeed(start({"run", seq, "-o", out / "told", "-q", "--max-gap", "200"}));
  CHECK(told.err.empty());
}

TEST_CASE("run takes PCD scans and writes cleaned ones that can be read again") {
  const Street street;
  const TemporaryFolder folder;
  const Recording source(street.path());
  fs::create_directories(folder / "seq/pcd");
  PointColumns columns;
  columns.intensity = columns.ring = columns.time = true;
  for (std::size_t i = 0; i < 12; ++i) {
    const RecordedScan scan = source.read_scan(i);
    PointFileWriter file(folder / ("seq/pcd/" + std::to_string(i) + ".pcd"), columns,
                         source.T_world_sensor(i));
    for (std::size_t k = 0; k < scan.size(); ++k) {
      FilePoint point = scan.point(k);
      point.position = source.T_world_sensor(i) * point.position;
      point.ring = 5;
      point.time = 0.125;
      file.add(point);
    }
    file.commit();
    const std::string name = folder / ("seq/pcd/" + std::to_string(i) + ".pcd");
    std::string text = read_text(name);
    write_text(name, text.replace(text.find("intensity"), 9, "reflectivity"));
  }
  succeed(start(
      {"run", folder / "seq", "-o", folder / "out", "-q", "--write-clean", "--frame", "world"}));
  CHECK(count_entries(folder / "out/labels") == 12);

  RecordingOptions options;
  options.frame = PointFrame::kWorld;
  const Recording before(folder / "seq", options);
  const Recording clean(folder / "out/clean", options);
  REQUIRE(clean.size() == 12);
  for (std::size_t i = 0; i < 12; ++i) {
    const RecordedScan all = before.read_scan(i);
    const RecordedScan kept = clean.read_scan(i);
    const std::vector<std::uint32_t> labels = labels_in(folder / "out", std::to_string(i));
    REQUIRE(labels.size() == all.size());
    const auto moving = std::count_if(labels.begin(), labels.end(), is_removed);
    CHECK(kept.size() + static_cast<std::size_t>(moving) == all.size());
    CHECK(clean.T_world_sensor(i).isApprox(before.T_world_sensor(i), 1e-9));
    REQUIRE_FALSE(kept.ring.empty());
    CHECK(kept.ring.front() == 5);
    CHECK(kept.time.front() == 0.125);
  }
  CHECK_THAT(read_text(folder / "out/clean/0.pcd"),
             ContainsSubstring("FIELDS x y z reflectivity ring time"));
  const PointFile moving = read_points(folder / "out/dynamic_points.ply");
  CHECK(moving.ring.size() == moving.positions.size());
  CHECK(moving.time.size() == moving.positions.size());
}
