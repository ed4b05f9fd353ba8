// Trials of `dynains check`: simulated recordings times kinds of wrong poses, as a table in
// Markdown. An answer is right if the proposed options give the true motion, or if the poses as
// given do and no option is proposed, or if they are called inexact and are so by 3 cm.
//   pose_trials [EVERY]   (every n-th recording)

#include "dynains/errors.hpp"
#include "dynains/io/kitti.hpp"
#include "dynains/median.hpp"
#include "dynains/poses/diagnosis.hpp"
#include "support/written_drive.hpp"

using namespace dynains;

namespace {

using Poses = std::vector<Pose>;

constexpr std::size_t kScans = 60;
constexpr double kPeriod = 0.1;  // s

Eigen::Isometry3d pose_of(double x, double y, double z, double roll, double pitch, double yaw) {
  constexpr double kRadians = M_PI / 180.0;
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = (Eigen::AngleAxisd(yaw * kRadians, Eigen::Vector3d::UnitZ()) *
                Eigen::AngleAxisd(pitch * kRadians, Eigen::Vector3d::UnitY()) *
                Eigen::AngleAxisd(roll * kRadians, Eigen::Vector3d::UnitX()))
                   .toRotationMatrix();
  T.translation() = Eigen::Vector3d(x, y, z);
  return T;
}

/// True poses at any time within the drive and a second around it, by interpolation.
Eigen::Isometry3d at(const Poses& poses, double time) {
  const double last = static_cast<double>(poses.size() - 1);
  const double index = std::clamp(time / kPeriod, 0.0, last);
  const auto before = static_cast<std::size_t>(std::min(std::floor(index), last - 1.0));
  return interpolate(poses[before], poses[before + 1], index - static_cast<double>(before));
}

std::vector<double> times_of(const Poses& poses) {
  std::vector<double> times;
  for (std::size_t i = 0; i < poses.size(); ++i) times.push_back(kPeriod * static_cast<double>(i));
  return times;
}

void write_timed(const fs::path& folder, const std::vector<double>& times, const Poses& poses,
                 bool w_first = false) {
  const auto pose_of = [&](std::size_t i) { return poses[i]; };
  test::write_text(folder / "poses.txt", test::timed_rows(times, pose_of, w_first));
}

void write_rows(const fs::path& folder, const Poses& poses,
                const std::function<Eigen::Isometry3d(const Eigen::Isometry3d&)>& spoil) {
  Poses rows;
  for (const Pose& pose : poses) rows.push_back(spoil(pose));
  write_poses(folder / "poses.txt", rows);
}

enum class Answer { kOption, kNone, kInexact, kDisagree, kGap };

struct Kind {
  std::string name;
  Answer expected;
  std::function<void(const fs::path&, const Poses&)> write;
};

/// A trajectory with `period` (s) whose clock differs by `offset` (s).
Kind timed(const std::string& name, Answer expected, double period, double offset) {
  return {name, expected, [period, offset](const fs::path& folder, const Poses& poses) {
            std::vector<double> times = times_of(poses);
            write_times(folder / "times.txt", times);
            times.clear();
            Poses rows;
            const double last = kPeriod * static_cast<double>(poses.size() - 1);
            for (double time = 0.0; time < last + 1e-9; time += period) {
              times.push_back(time + offset);
              rows.push_back(at(poses, time));
            }
            write_timed(folder, times, rows);
          }};
}

Kind spoilt(const std::string& name,
            const std::function<Eigen::Isometry3d(const Eigen::Isometry3d&)>& spoil,
            Answer expected = Answer::kOption) {
  return {name, expected, [spoil](const fs::path& folder, const Poses& poses) {
            write_rows(folder, poses, spoil);
          }};
}

Kind of_body(const std::string& name, const Eigen::Isometry3d& T_body_sensor) {
  return spoilt(
      name, [T_body_sensor](const Eigen::Isometry3d& T) { return T * T_body_sensor.inverse(); });
}

Eigen::Isometry3d scaled(Eigen::Isometry3d pose, double factor) {
  pose.translation() *= factor;
  return pose;
}

std::vector<Kind> kinds() {
  const auto same = [](const Eigen::Isometry3d& T) { return T; };
  const Eigen::Isometry3d axes = camera_axes();
  std::vector<Kind> all = {
      spoilt("right, one row a scan", same, Answer::kNone),
      timed("right, 100 Hz", Answer::kNone, 0.01, 0.0),
      spoilt("inverse", [](const Eigen::Isometry3d& T) { return T.inverse(); }),
      spoilt("millimetres", [](const Eigen::Isometry3d& T) { return scaled(T, 1000.0); }),
      spoilt("centimetres", [](const Eigen::Isometry3d& T) { return scaled(T, 100.0); }),
      {"w x y z", Answer::kOption,
       [](const fs::path& folder, const Poses& poses) {
         write_timed(folder, times_of(poses), poses, true);
       }},
      spoilt("left-handed",
             [](const Eigen::Isometry3d& T) {
               PoseConvention mirrored;
               mirrored.left_handed = true;
               return apply(mirrored, T, QuaternionOrder::kNone);
             }),
      spoilt("camera", [axes](const Eigen::Isometry3d& T) { return axes * T * axes.inverse(); }),
      spoilt("inverse camera, mm",
             [axes](const Eigen::Isometry3d& T) {
               return scaled((axes * T * axes.inverse()).inverse(), 1000.0);
             }),
      spoilt("odometry, ways 10 % too long",
             [](const Eigen::Isometry3d& T) { return scaled(T, 1.1); }),
      {"rows of two scans later", Answer::kOption,
       [](const fs::path& folder, const Poses& poses) {
         Poses rows(poses.begin() + 2, poses.end());
         rows.resize(poses.size(), poses.back());
         write_poses(folder / "poses.txt", rows);
       }},
      of_body("IMU, yaw 90", pose_of(0, 0, 0, 0, 0, 90)),
      of_body("IMU, yaw -35 and lever arm", pose_of(1.2, -0.3, 0.5, 0, 0, -35)),
      of_body("IMU upside down", pose_of(0.2, 0, -0.4, 180, 0, 0)),
      of_body("antenna 2 m behind", pose_of(2.0, 0.4, 0.6, 0, 0, 0)),
      timed("clock 100 ms late", Answer::kOption, 0.01, 0.1),
      timed("clock 300 ms early", Answer::kOption, 0.01, -0.3),
      timed("trajectory of 0.5 Hz", Answer::kGap, 2.0, 0.0),
      {"noise 10 cm, 0.5 deg", Answer::kInexact,
       [](const fs::path& folder, const Poses& poses) {
         std::mt19937 random(5);
         std::normal_distribution<double> metres(0.0, 0.1);
         std::normal_distribution<double> degrees(0.0, 0.5);
         write_rows(folder, poses, [&](const Eigen::Isometry3d& T) {
           return T * pose_of(metres(random), metres(random), metres(random), degrees(random),
                              degrees(random), degrees(random));
         });
       }},
      {"odometry, 1 deg a scan lost", Answer::kInexact,
       [](const fs::path& folder, const Poses& poses) {
         std::size_t i = 0;
         write_rows(folder, poses, [&](const Eigen::Isometry3d& T) {
           return pose_of(0, 0, 0, 0, 0, 1.0 * static_cast<double>(i++)) * T;
         });
       }},
      {"of another drive", Answer::kDisagree,
       [](const fs::path& folder, const Poses& poses) {
         double heading = 0.0;
         Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
         write_rows(folder, poses, [&](const Eigen::Isometry3d&) {
           heading += 0.05;
           T = T * pose_of(1.5 + std::sin(heading), 0, 0, 0, 0, 4.0 * std::sin(7.0 * heading));
           return T;
         });
       }},
  };
  return all;
}

/// Median error (m, of points 10 m away) of the motion over `step` scans.
double error_of(const Recording& recording, const Poses& truth, std::size_t step = 3) {
  std::vector<double> errors;
  for (std::size_t i = 0; i + step < recording.size(); ++i) {
    const auto a = static_cast<std::size_t>(recording.number(i));
    const auto b = static_cast<std::size_t>(recording.number(i + step));
    const Eigen::Isometry3d E =
        (recording.T_world_sensor(i).inverse() * recording.T_world_sensor(i + step)).inverse() *
        truth[a].inverse() * truth[b];
    errors.push_back(
        std::hypot(E.translation().norm(), 10.0 * std::abs(Eigen::AngleAxisd(E.linear()).angle())));
  }
  if (errors.empty()) return 1e9;
  return median(std::move(errors));
}

bool is_right(const fs::path& folder, const Kind& kind, const Poses& truth) {
  constexpr double kTrue = 0.08;  // m, for points 10 m away, over three scans
  try {
    const Recording recording(folder);
    const Diagnosis d = diagnose(recording);
    const bool is_sound = d.sound() && d.verdict != PoseVerdict::kInexact;
    const double given = error_of(recording, truth);
    if (kind.expected == Answer::kNone) return is_sound;
    if (kind.expected == Answer::kInexact) return !is_sound;
    if (kind.expected == Answer::kDisagree) return d.verdict == PoseVerdict::kDisagree;
    if (is_sound) return given < kTrue;
    if (d.verdict == PoseVerdict::kInexact) {
      return given < kTrue && error_of(recording, truth, d.error_span) > 0.03;
    }
    if (d.verdict != PoseVerdict::kOtherwise) return false;
    const double healed = error_of(Recording(folder, d.proposal), truth);
    return healed < kTrue || healed < 0.25 * given;
  } catch (const IoError& error) {
    return kind.expected == Answer::kGap &&
           std::string(error.what()).find("--pose-gap") != std::string::npos;
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::size_t every = argc > 1 ? std::strtoul(argv[1], nullptr, 10) : 1;
  constexpr std::size_t kFirstSeed = 100;
  const std::vector<Kind> all = kinds();
  std::map<std::string, std::pair<int, int>> right_of;
  std::size_t number = 0;
  for (const std::string scene : value_names(simulation::Scene())) {
    for (const char* const sensor : {"hdl64", "vlp16", "os1-64", "hdl32", "livox"}) {
      if (scene == "static" || number++ % every != 0) continue;
      simulation::Config config;
      config.scene = value_of_name<simulation::Scene>(scene).value();
      config.sensor = value_of_name<simulation::Sensor>(sensor).value();
      config.scans = static_cast<int>(kScans);
      config.seed = kFirstSeed + number;
      const test::WrittenDrive drive(config);
      const Poses truth = drive.poses();
      for (const Kind& kind : all) {
        fs::remove(drive.path() / "times.txt");
        kind.write(drive.path(), truth);
        auto& [good, count] = right_of[kind.name];
        ++count;
        if (is_right(drive.path(), kind, truth)) {
          ++good;
        } else {
          std::cout << "wrong: " << scene << ' ' << sensor << ' ' << config.seed << ", "
                    << kind.name << std::endl;
        }
      }
    }
  }
  int good = 0;
  int count = 0;
  std::cout << "| poses | right answers |\n|---|---|\n";
  for (const Kind& kind : all) {
    const auto [g, n] = right_of[kind.name];
    std::cout << "| " << kind.name << " | " << g << " of " << n << " |\n";
    good += g;
    count += n;
  }
  std::cout << "| all | " << good << " of " << count << " |\n";
}
