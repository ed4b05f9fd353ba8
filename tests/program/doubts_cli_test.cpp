// Messages about faulty recordings, and no message about right ones.
#include <initializer_list>

#include "program/run_folder.hpp"
#include "run/remarks/cloud_remarks.hpp"
#include "simulation/config.hpp"
#include "support/catch.hpp"
#include "support/drive_of.hpp"
#include "support/written_drive.hpp"

using namespace dynains;
using namespace dynains::test;

namespace {

simulation::Config street() {
  return drive_of(simulation::Scene::kStopAndGo, simulation::Sensor::kVlp16, 30, 4);
}

/// A drive that the program runs over.
class Drive : public WrittenDrive {
 public:
  explicit Drive(const simulation::Config& config = street()) : WrittenDrive(config) {}

  std::string out() const { return folder_ / "out"; }

  Outcome run(const Arguments& flags = {}) const {
    fs::remove_all(out());
    return start(Arguments{"run", path(), "-o", out(), "-q"} + flags);
  }
  nlohmann::json report() const { return report_in(out()); }

 private:
  TemporaryFolder folder_;
};

/// Writes points in the frame of a world that is moved by `shift`, and its poses.
void write_world(const Drive& drive, const Eigen::Vector3d& shift) {
  drive.move_points([&](const simulation::SimulatedScan& scan, const Eigen::Vector3d& p) {
    return Eigen::Vector3d(scan.T_world_sensor * p + shift);
  });
  drive.with_poses([&](std::size_t, Pose T) {
    T.translation() += shift;
    return T;
  });
}

}  // namespace

TEST_CASE("run says nothing about a right recording, and its report has no doubts") {
  const Drive drive;
  const Outcome outcome = drive.run();
  CHECK(outcome.code == 0);
  CHECK(outcome.err.empty());
  CHECK(drive.report()["doubts"]["jumps"].empty());
  CHECK(drive.report()["doubts"]["suspicious"].empty());
  CHECK(drive.report()["doubts"]["warnings"].empty());
}

TEST_CASE("run names the scan at which poses jump, and the size") {
  const Drive drive;
  const Pose& T_world_c = drive.pose(15);
  const Pose sideways = Eigen::Translation3d(0.0, 3.0, 0.0) *
                        Eigen::AngleAxisd(2.0 * M_PI / 180.0, Eigen::Vector3d::UnitZ());
  const Pose change = T_world_c * sideways * T_world_c.inverse();
  drive.with_poses([&](std::size_t i, const Pose& T) { return i < 15 ? T : Pose(change * T); });
  const Outcome outcome = drive.run();
  check_warns(outcome, "poses jump 1 time, at scan 000015 by 3.0");
  const nlohmann::json jumps = drive.report()["doubts"]["jumps"];
  REQUIRE(jumps.size() == 1);
  CHECK(jumps[0]["scan"] == "000015");
  const nlohmann::json warnings = drive.report()["doubts"]["warnings"];
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(outcome.err, ContainsSubstring("warning: " + warnings[0].get<std::string>()));
  CHECK(jumps[0]["metres"].get<double>() == Approx(3.0).margin(0.3));
  CHECK(jumps[0]["degrees"].get<double>() == Approx(2.0).margin(1.0));
}

TEST_CASE("run and check name scans with far fewer points than those before them") {
  const Drive drive;
  const auto cut = [&](std::size_t first, std::size_t last, std::size_t share) {
    for (std::size_t i = first; i <= last; ++i) {
      const std::vector<float>& whole = drive.scan(i).xyzi;
      const auto end = whole.begin() + static_cast<std::ptrdiff_t>(whole.size() / 4 / share * 4);
      const std::vector<float> part(whole.begin(), end);
      write_scan(drive.file_of(i), part);
    }
  };
  const auto is_told = [&](const std::string& scans) {
    const std::string remark = scans + ": far fewer points than the scans before";
    CHECK_THAT(start({"check", drive.path()}).out, ContainsSubstring("note: " + remark));
    CHECK_THAT(drive.run({"--accept-poses"}).err, ContainsSubstring("warning: " + remark));
  };
  cut(12, 12, 1000000);
  is_told("scan 000012");
  cut(12, 12, 10);
  cut(16, 22, 3);
  is_told("8 scans from 000012 to 000022");
}

TEST_CASE("Counts of points that vary from scan to scan are not those of cut files") {
  const auto thin = [](const std::vector<std::uint64_t>& points) {
    std::vector<run::ScanCounts> counts;
    for (const std::uint64_t one : points) counts.push_back({one, 0});
    return run::thin_scans(counts);
  };
  using Scans = std::vector<std::size_t>;
  // A Mid-360 in a crowd.
  const std::vector<std::uint64_t> near = {5063, 5193, 5368, 5710, 6172, 7725, 4371, 6677};
  const auto then = [&](std::initializer_list<std::uint64_t> more) {
    auto points = near;
    points.insert(points.end(), more);
    return points;
  };
  CHECK(thin(then({2732, 8639, 7272, 6333})).empty());
  CHECK(thin(then({1900, 2100, 2000, 1800, 7000})) == Scans{8, 9, 10, 11});
  CHECK(thin({20, 100, 110, 120, 115, 108, 50, 49, 40, 110}) == Scans{0, 6, 7, 8});
  CHECK(thin({100, 100, 40, 100, 40, 100, 40, 100, 40}) == Scans{2, 4, 6, 8});
  CHECK(thin({}).empty());
  CHECK(thin({0}).empty());
}

TEST_CASE("run and check name scans at the places of others, and none in a right recording") {
  const Drive drive;
  const std::string misplaced = ": surfaces do not lie where the pose places them";
  const auto words = [&] {
    return start({"check", drive.path()}).out + drive.run({"--accept-poses"}).err;
  };
  const auto swap = [&](std::size_t i, std::size_t k) {
    write_scan(drive.file_of(i), drive.scan(k).xyzi);
    write_scan(drive.file_of(k), drive.scan(i).xyzi);
  };
  swap(8, 20);
  const std::string remark = "2 scans from 000008 to 000020" + misplaced;
  const std::string outputs = words();
  CHECK_THAT(outputs, ContainsSubstring("note: " + remark));     // by check
  CHECK_THAT(outputs, ContainsSubstring("warning: " + remark));  // by run
  for (const std::size_t i : {8U, 20U}) write_scan(drive.file_of(i), drive.scan(i).xyzi);

  std::vector<float> noise = drive.scan(12).xyzi;
  std::mt19937 random(3);
  std::uniform_real_distribution<float> place(-40.0F, 40.0F);
  for (float& value : noise) value = place(random);
  write_scan(drive.file_of(12), noise);
  const std::string one = "scan 000012" + misplaced;
  CHECK_THAT(words(), ContainsSubstring("note: " + one) && ContainsSubstring("warning: " + one));
  write_scan(drive.file_of(12), drive.scan(12).xyzi);
  CHECK_THAT(words(), !ContainsSubstring(misplaced));

  const Drive crowd(drive_of(simulation::Scene::kCrowd, simulation::Sensor::kMid360, 40, 71));
  CHECK_THAT(start({"check", crowd.path()}).out, !ContainsSubstring(misplaced));
}

TEST_CASE("run tells by how much its parameters leave points unjudged") {
  const Drive drive, crowd(drive_of(simulation::Scene::kCrowd, simulation::Sensor::kVlp16, 30, 4));
  const auto told = [](const Drive& place, const Arguments& flags, const std::string& words) {
    const std::string text = place.run(flags).err;
    CAPTURE(text);
    const std::size_t at = text.find(" % of the points " + words);
    REQUIRE(at != std::string::npos);
    CHECK(std::stoi(text.substr(text.rfind(' ', at - 1))) > 50);
  };
  const std::string outside = "are not judged: ", loose = "above the ground are in no cluster";
  told(drive, {"--max-range", "4.5"}, outside);
  told(drive, {"--noise-depth", "0.1"}, outside);
  told(drive, {"--self-box", "-50 -50 -50 50 50 50"}, outside);
  told(drive, {"--cluster-range", "0.001"}, loose);
  told(crowd, {"--footprint", "2"},
       "that are removed are ground below what moves; see --footprint");
}

TEST_CASE("run tells the error of a return to a place, and check writes it for a pose graph") {
  constexpr int kScans = 75;  // of the way there
  const Drive drive(drive_of(simulation::Scene::kUrban, simulation::Sensor::kVlp16, kScans, 4));
  const auto drive_back = [&](double drift) {
    std::vector<Pose> rows;
    for (int i = 0; i < 2 * kScans; ++i) {
      const auto scan = static_cast<std::size_t>(i < kScans ? i : 2 * kScans - 1 - i);
      if (i >= kScans)
        write_scan(drive.file_of(static_cast<std::size_t>(i)), drive.scan(scan).xyzi);
      rows.push_back(drive.pose(scan));
      rows.back().translation().y() += drift * static_cast<double>(i);
    }
    write_poses(drive.path() / "poses.txt", rows);
  };
  const std::string told = "the trajectory returns to scan";
  const auto check_edges = [&](bool is_told) {
    const std::string file = drive.out() + ".g2o";
    const Outcome outcome = start({"check", drive.path(), "--closures", file, "--force"});
    CHECK((outcome.out.find(told) != std::string::npos) == is_told);
    std::istringstream edge(read_text(file));
    std::string tag;
    std::size_t from = 0, to = 0;
    Eigen::Vector3d place(0.0, 0.0, 0.0);
    edge >> tag >> from >> to >> place.x() >> place.y() >> place.z();
    CHECK(tag == "EDGE_SE3:QUAT");
    REQUIRE((from < to && to < 2 * kScans));
    const Pose T_from_to = drive.pose(from).inverse() * drive.pose(2 * kScans - 1 - to);
    CHECK((place - T_from_to.translation()).norm() < 0.15);
  };
  drive_back(0.0);
  check_edges(false);
  CHECK_THAT(drive.run().err, !ContainsSubstring(told));

  drive_back(0.006);  // m
  check_edges(true);
  CHECK_THAT(drive.run({"--passes", "1"}).err, ContainsSubstring(told));
  const nlohmann::json returns = drive.report()["doubts"]["returns"];
  REQUIRE(returns.size() == 1);
  CHECK(returns[0]["metres"].get<double>() == Approx(0.85).margin(0.1));
}

TEST_CASE("check and run tell coordinates that float32 put into stripes") {
  const Drive drive;
  const Eigen::Vector3d utm(512345.0, 5412345.0, 100.0);
  for (const bool in_stripes : {true, false}) {
    write_world(drive, in_stripes ? utm : Eigen::Vector3d(12.0, 34.0, 1.0));
    const Outcome checked = start({"check", drive.path(), "--frame", "world"});
    CHECK((checked.out.find("lie in stripes of 0.50 m") != std::string::npos) == in_stripes);
    const Outcome outcome = drive.run({"--frame", "world", "--accept-poses"});
    CHECK((outcome.err.find("lie in stripes of 0.50 m") != std::string::npos) == in_stripes);
  }
}

TEST_CASE("check and run tell points of the world that are taken for those of the sensor") {
  const Drive drive;
  const Eigen::Vector3d first = drive.pose(0).translation();
  for (const Eigen::Vector3d& shift :
       {Eigen::Vector3d(-first), Eigen::Vector3d(400.0, -300.0, 5.0)}) {
    write_world(drive, shift);
    CHECK_THAT(start({"check", drive.path()}).out, ContainsSubstring("pass --frame world"));
    check_refused(drive.run(), 2, "--frame world");
    CHECK(drive.run({"--frame", "world"}).code == 0);
  }
}

TEST_CASE("check and run tell points that lie on a grid") {
  const Drive drive;
  for (const double step : {0.2, 0.02}) {
    drive.move_points([&](const simulation::SimulatedScan&, const Eigen::Vector3d& p) {
      const Eigen::Array3d centre_of_voxel = step * ((p.array() / step).floor() + 0.5);
      return Eigen::Vector3d(centre_of_voxel);
    });
    const bool is_coarse = step > 0.1;
    const auto is_told = [](const std::string& text) {
      return text.find("points lie on a grid of 0.20 m") != std::string::npos;
    };
    CHECK(is_told(start({"check", drive.path()}).out) == is_coarse);
    CHECK(is_told(drive.run().err) == is_coarse);
  }
}

TEST_CASE("check and run tell clouds that were recorded twice") {
  const Drive drive;
  for (std::size_t i = 1; i < drive.size(); i += 2) {
    write_scan(drive.file_of(i), drive.scan(i - 1).xyzi);
  }
  for (const std::string& told :
       {start({"check", drive.path()}).out, drive.run({"--accept-poses"}).err}) {
    CHECK_THAT(told, ContainsSubstring("are equal, though the sensor moves"));
  }
}

TEST_CASE("check tells clouds that are parts of a turn") {
  constexpr std::size_t kParts = 6;
  const Drive drive;
  const TemporaryFolder parts;
  fs::create_directories(parts / "velodyne");
  std::vector<Pose> poses;
  for (std::size_t i = 0; i < drive.size(); ++i) {
    const std::vector<float>& xyzi = drive.scan(i).xyzi;
    std::vector<std::vector<float>> clouds(kParts);
    for (std::size_t k = 0; k < xyzi.size(); k += 4) {
      const double turn = 0.5 + std::atan2(xyzi[k + 1], xyzi[k]) / (2.0 * M_PI);
      const auto part = static_cast<std::size_t>(turn * static_cast<double>(kParts)) % kParts;
      clouds[part].insert(clouds[part].end(), &xyzi[k], &xyzi[k] + 4);
    }
    for (const std::vector<float>& cloud : clouds) {
      const std::string name = simulation::scan_name(poses.size());
      write_scan(parts / ("velodyne/" + name + ".bin"), cloud);
      poses.push_back(drive.pose(i));
    }
  }
  write_poses(parts / "poses.txt", poses);
  CHECK_THAT(start({"check", parts.path()}).out,
             ContainsSubstring("Scans 6 apart agree better than neighbours") &&
                 ContainsSubstring("parts of a turn"));
}

TEST_CASE("one scan alone is told") {
  const Drive drive;
  check_warns(drive.run({"--start", "3", "--end", "3"}), "one scan alone");
}

/// Turns the sensor of a drive nose down by this angle (deg), in addition.
void turn_down(const Drive& drive, double angle) {
  const Pose T_level_sensor(Eigen::AngleAxisd(angle * M_PI / 180.0, Eigen::Vector3d::UnitY()));
  drive.move_points([&](const simulation::SimulatedScan&, const Eigen::Vector3d& p) {
    return Eigen::Vector3d(T_level_sensor.linear().transpose() * p);
  });
  drive.with_poses([&](std::size_t, const Pose& T) { return Pose(T * T_level_sensor); });
}

/// The pitch (deg) that `dynains check` proposes for the mounting.
double proposed_pitch(const Drive& drive) {
  const std::string told = start({"check", drive.path()}).out;
  CAPTURE(told);
  const std::size_t at = told.find("--mounting-pitch ");
  REQUIRE(at != std::string::npos);
  CHECK_THAT(told, !ContainsSubstring("no option is needed"));
  return std::stod(told.substr(at + 17));
}

TEST_CASE("check and run propose the mounting of a sensor that lies on its side") {
  const Drive drive;
  turn_down(drive, 60.0);  // which the estimate of the mounting does not reach
  CHECK(proposed_pitch(drive) == Approx(60.0).margin(3.0));
  CHECK_THAT(drive.run().err, ContainsSubstring("tilted by 60 deg: pass --mounting-pitch "));
  CHECK(drive.run({"--mounting-pitch", "60"}).err.empty());
}

TEST_CASE("check proposes the mounting of a sensor that looks down from 10 m, as on a drone") {
  auto config = drive_of(simulation::Scene::kCarPark, simulation::Sensor::kOs1_64, 12, 9);
  config.sensor_height = 10.0;
  config.mounting_pitch = 45.0;
  const Drive drive(config);
  turn_down(drive, 45.0);
  CHECK(proposed_pitch(drive) == Approx(90.0).margin(3.0));
}

TEST_CASE("run refuses clouds in the frame of a body, and names where their beams begin") {
  const Drive body;  // on the ground
  body.move_points([](const simulation::SimulatedScan&, const Eigen::Vector3d& p) {
    return Eigen::Vector3d(p + Eigen::Vector3d(1.0, 0.0, 1.8));
  });
  const Outcome refused = body.run();
  CHECK(refused.code == 2);
  const std::string flag = "pass --sensor-origin \"";
  const std::size_t at = refused.err.find(flag);
  REQUIRE(at != std::string::npos);
  std::istringstream origin(refused.err.substr(at + flag.size()));
  double x = 0.0, y = 0.0, z = 0.0;
  REQUIRE(origin >> x >> y >> z);
  CHECK((Eigen::Vector3d(x, y, z) - Eigen::Vector3d(1.0, 0.0, 1.8)).norm() < 0.05);
}

TEST_CASE("Clouds of more than a turn without times are told, and those of one turn are not") {
  const Drive drive(drive_of(simulation::Scene::kUrban, simulation::Sensor::kVlp16, 12, 3));
  // In the order of their measurement: rings are interleaved.
  const auto write_turns = [&](double degrees) {
    for (std::size_t i = 0; i < drive.size(); ++i) {
      std::vector<std::array<float, 5>> points;  // azimuth (rad) first
      const std::vector<float>& xyzi = drive.scan(i).xyzi;
      for (std::size_t k = 0; k < xyzi.size(); k += 4) {
        const float azimuth = std::atan2(xyzi[k + 1], xyzi[k]);
        points.push_back({azimuth, xyzi[k], xyzi[k + 1], xyzi[k + 2], xyzi[k + 3]});
        const double again = -M_PI + (degrees - 360.0) * M_PI / 180.0;
        if (azimuth > again) continue;
        points.push_back(points.back());
        points.back()[0] += 2.0F * static_cast<float>(M_PI);
      }
      std::sort(points.begin(), points.end());
      std::vector<float> turned;
      for (const auto& p : points) turned.insert(turned.end(), p.begin() + 1, p.end());
      write_scan(drive.file_of(i), turned);
    }
  };
  const std::string told = "deg, so that their ends overlap";
  write_turns(392.0);
  CHECK_THAT(drive.run().err, ContainsSubstring("clouds go around by 392 " + told) ||
                                  ContainsSubstring("clouds go around by 391 " + told));
  CHECK_THAT(start({"check", drive.path()}).out, ContainsSubstring(told));
  write_turns(360.0);
  CHECK_THAT(drive.run().err, !ContainsSubstring(told));
}

TEST_CASE("People near a robot that stands are judged, and many points that are not are told") {
  const Drive drive;
  drive.with_poses(no_motion);
  // One still scene, with a person who walks around the sensor, 1.8 m away.
  for (std::size_t i = 0; i < drive.size(); ++i) {
    std::vector<float> xyzi = drive.scan(0).xyzi;
    const double around = 0.1 * static_cast<double>(i);
    for (double side = -0.25; side < 0.25; side += 0.01) {
      for (double z = -1.4; z < 0.2; z += 0.02) {
        const double x = 1.8 * std::cos(around) - side * std::sin(around);
        const double y = 1.8 * std::sin(around) + side * std::cos(around);
        for (const double value : {x, y, z, 0.3}) xyzi.push_back(static_cast<float>(value));
      }
    }
    write_scan(drive.file_of(i), xyzi);
  }
  CHECK(drive.run().code == 0);
  CHECK(drive.report().at("labels").at("dynamic") > 10000);
  CHECK_THAT(drive.run({"--min-range", "7"}).err,
             ContainsSubstring("% of the points are not judged: nearer than --min-range"));
}

TEST_CASE("check names ways of the poses that are too long, and the factor") {
  const Drive drive(drive_of(simulation::Scene::kUrban, simulation::Sensor::kOs1_64, 30, 41));
  for (const double factor : {1.1, 0.9}) {
    drive.with_poses(scaled_poses(factor));
    check_says(start({"check", drive.path()}), 1,
               factor > 1.0 ? "pass --pose-scale 0.909" : "pass --pose-scale 1.11");
    CHECK(start({"check", drive.path(), "--pose-scale", std::to_string(1.0 / factor)}).code == 0);
  }
  CHECK(start({"check", drive.path(), "--pose-scale", "0.01"}).code == 2);
}

TEST_CASE("check proposes to de-skew points whose times explain what the poses do not") {
  const TemporaryFolder folder;
  const std::string path = folder / "drive";
  succeed(
      start({"simulate", path, "-q", "--format", "mcap", "--sensor", "os1-64", "--scans", "30",
             "--seed", GENERATE("43", "92"), "--ego-speed", "12", "--rolling-shutter", "true"}));
  check_says(start({"check", path}), 1, "pass --deskew");
  check_says(start({"check", path, "--deskew"}), 0, "agree as they are");
}

TEST_CASE("check names poses without orientation, and proposes nothing for coarse coordinates") {
  const Drive drive(drive_of(simulation::Scene::kHill, simulation::Sensor::kVlp16, 60, 7));
  drive.with_poses([](std::size_t, Pose T) {
    T.linear().setIdentity();
    return T;
  });
  CHECK_THAT(start({"check", drive.path()}).out,
             ContainsSubstring("All orientations of the poses are equal") &&
                 !ContainsSubstring("pass --"));
  drive.with_poses([](std::size_t, Pose T) {
    T.translation() = T.translation().array().round();
    return T;
  });
  CHECK_THAT(start({"check", drive.path()}).out,
             !ContainsSubstring("pass --") && !ContainsSubstring("agree as they are"));
}

TEST_CASE("Options that do not fit a right recording are refused") {
  const Drive drive(drive_of(simulation::Scene::kUrban, simulation::Sensor::kVlp16, 40, 11));
  const std::vector<std::string> wrong =
      GENERATE(std::vector<std::string>{"--frame", "world"},
               std::vector<std::string>{"--sensor-origin", "0 0 3"});
  const Outcome outcome = drive.run(wrong);
  CAPTURE(wrong, outcome.err);
  CHECK(outcome.code == 2);
  CHECK_FALSE(fs::exists(drive.out()));
}
