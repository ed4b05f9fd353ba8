// Trials of the warnings about faulty recordings. Each random world is spoilt by each kind of fault
// of poses, clouds and times. A fault counts as harmful if at least 5 % more of the static points
// within 50 m are called moving than with right poses, or if nothing is judged. It is told if the
// plausibility check of the remover says so, or if `dynains run` would refuse or warn before its
// first scan.
//   plausibility_trials [FROM [WORLDS [SCANS [right|all [SCENE]]]]]
// Prints a row for each world and kind with the largest shares of any window, then the counts.
#include "dynains/errors.hpp"
#include "run/remarks/cloud_remarks.hpp"
#include "run/remarks/recording_check.hpp"
#include "support/drive_of.hpp"
#include "support/simulated_runs.hpp"
#include "support/written_drive.hpp"

using namespace dynains;

namespace {

using Scans = std::vector<simulation::SimulatedScan>;

/// Cloud and pose of a scan as they are recorded.
struct Recorded {
  std::vector<float> xyzi;
  Pose T_world_sensor;
  bool is_lost = false;  // not recorded at all
};

using Fault = std::function<Recorded(const Scans&, std::size_t)>;
/// Time of a point, s after that of its scan, of a sensor that takes `period` s for a scan.
using FaultOfTime = std::function<double(double time, double period)>;

struct Kind {
  std::string name;
  Fault fault;
  FaultOfTime time = {};  ///< for points that are recorded as measured, and de-skewed by the run
};

Pose moved(double x, double y, double z) {
  Pose T = Pose::Identity();
  T.translation() = Eigen::Vector3d(x, y, z);
  return T;
}

Pose turned(double degrees, const Eigen::Vector3d& axis = Eigen::Vector3d::UnitZ()) {
  Pose T = Pose::Identity();
  T.linear() = Eigen::AngleAxisd(degrees * M_PI / 180.0, axis).toRotationMatrix();
  return T;
}

/// Poses that `change(scans, i)` gives.
Fault posed(const std::function<Pose(const Scans&, std::size_t)>& change) {
  return [change](const Scans& scans, std::size_t i) {
    return Recorded{scans[i].xyzi, change(scans, i)};
  };
}

/// Poses that `change(i, T_world_sensor)` gives.
Fault changed_poses(const std::function<Pose(std::size_t, const Pose&)>& change) {
  return posed([change](const Scans& scans, std::size_t i) {
    return change(i, Pose(scans[i].T_world_sensor));
  });
}

Fault of_body(const Pose& T_sensor_body) {
  return changed_poses([T_sensor_body](std::size_t, const Pose& T) { return T * T_sensor_body; });
}

Fault scaled_poses(double factor) { return changed_poses(test::scaled_poses(factor)); }

/// `change_of_scan(i)` gives the function that changes each coordinate of scan i.
template <class ChangeOfScan>
Fault changed_points(ChangeOfScan change_of_scan) {
  return [change_of_scan](const Scans& scans, std::size_t i) {
    Recorded recorded{scans[i].xyzi, scans[i].T_world_sensor};
    auto change = change_of_scan(i);
    for (std::size_t k = 0; k < recorded.xyzi.size(); ++k) {
      if (k % 4 != 3) recorded.xyzi[k] = change(recorded.xyzi[k]);
    }
    return recorded;
  };
}

Fault scaled_points(float factor) {
  return changed_points(
      [factor](std::size_t) { return [factor](float coordinate) { return coordinate * factor; }; });
}

/// Clouds that were moved into a body in which the sensor lies at (x, y, z), with poses of the
/// body.
Fault in_body(float x, float y, float z) {
  return [x, y, z](const Scans& scans, std::size_t i) {
    Recorded recorded{scans[i].xyzi, scans[i].T_world_sensor * moved(-x, -y, -z)};
    for (std::size_t k = 0; k + 3 < recorded.xyzi.size(); k += 4) {
      recorded.xyzi[k] += x;
      recorded.xyzi[k + 1] += y;
      recorded.xyzi[k + 2] += z;
    }
    return recorded;
  };
}

Pose noise(std::size_t i, double metres, double degrees) {
  std::mt19937 random(static_cast<unsigned>(i));
  std::normal_distribution<double> normal;
  const Eigen::Vector3d t(metres * normal(random), metres * normal(random),
                          metres * normal(random));
  return moved(t.x(), t.y(), t.z()) * turned(degrees * normal(random));
}

std::vector<Kind> kinds() {
  const auto jump = [](double metres, double degrees) {
    return posed([=](const Scans& scans, std::size_t i) {
      const std::size_t middle = scans.size() / 2;
      const Pose& T = scans[middle].T_world_sensor;
      const Pose change = T * moved(0, metres, 0) * turned(degrees) * T.inverse();
      return i < middle ? scans[i].T_world_sensor : Pose(change * scans[i].T_world_sensor);
    });
  };
  const auto right = changed_poses([](std::size_t, const Pose& T) { return T; });
  const auto random_points = changed_points([](std::size_t i) {
    return [random = std::mt19937(static_cast<unsigned>(i)),
            place = std::uniform_real_distribution<float>(-40.0F, 40.0F)](float) mutable {
      return place(random);
    };
  });
  const auto noisy_points = changed_points([](std::size_t i) {
    return [random = std::mt19937(static_cast<unsigned>(i)),
            error = std::normal_distribution<float>(0.0F, 0.3F)](float coordinate) mutable {
      return coordinate + error(random);
    };
  });
  // Clouds that are lost a third through, so that later ones get the poses of earlier ones.
  const auto lost = [](std::size_t count) {
    return [count](const Scans& scans, std::size_t i) {
      const std::size_t first = scans.size() / 3;
      return Recorded{scans[i].xyzi, scans[i].T_world_sensor, first <= i && i < first + count};
    };
  };
  const auto held =
      posed([](const Scans& scans, std::size_t i) { return scans[i - i % 3].T_world_sensor; });
  const auto mirrored = [](const Scans& scans, std::size_t i) {
    Recorded recorded{scans[i].xyzi, scans[i].T_world_sensor};
    for (std::size_t k = 1; k < recorded.xyzi.size(); k += 4) recorded.xyzi[k] *= -1.0F;
    return recorded;
  };
  return {
      {"right", right},
      {"clouds of a body", in_body(1.0F, 0.0F, 1.5F)},
      {"jump of 3 m", jump(3, 2)},
      {"points in mm", scaled_points(1000.0F)},
      {"points in cm", scaled_points(100.0F)},
      {"points in feet", scaled_points(3.2808F)},
      {"mirrored points", mirrored},
      {"poses in mm", scaled_poses(1000.0)},
      {"poses in km", scaled_poses(0.001)},
      {"poses 10 % too long", scaled_poses(1.1)},
      {"inverse", posed([](const Scans& scans, std::size_t i) {
         return Pose((scans[0].T_world_sensor.inverse() * scans[i].T_world_sensor).inverse());
       })},
      {"yawed by 10 deg", of_body(turned(10))},
      {"yawed by 90 deg", of_body(turned(90))},
      {"yawed by 180 deg", of_body(turned(180))},
      {"upside down", of_body(turned(180, Eigen::Vector3d::UnitX()))},
      {"late by two scans", posed([](const Scans& scans, std::size_t i) {
         return scans[std::min(i + 2, scans.size() - 1)].T_world_sensor;
       })},
      {"poses held for three scans", held},
      {"one cloud lost", lost(1)},
      {"three clouds lost", lost(3)},
      {"noise of 20 cm and 1 deg",
       changed_poses([](std::size_t i, const Pose& T) { return T * noise(i, 0.2, 1.0); })},
      {"no motion", posed([](const Scans& scans, std::size_t) { return scans[0].T_world_sensor; })},
      {"random points", random_points},
      {"points with noise of 30 cm", noisy_points}};
}

/// Kinds of clouds that are recorded as measured.
std::vector<Kind> kinds_of_times() {
  const Fault right = kinds().front().fault;
  return {{"not de-skewed, no times", right},
          {"right times", right, [](double time, double) { return time; }},
          {"reversed times", right, [](double time, double period) { return period - time; }},
          {"half times", right, [](double time, double) { return 0.5 * time; }},
          {"double times", right, [](double time, double) { return 2.0 * time; }},
          {"times of another unit", right, [](double time, double) { return 1e-4 * time; }},
          {"times of noise", right,
           [](double time, double period) { return std::fmod(7919.0 * time, period); }}};
}

struct WrittenScans {
  Recording recording;
  std::vector<std::size_t> scans;  ///< simulated, of each recorded one
};

/// Writes clouds with times if `kind` has them, else the layout of KITTI without times, and poses
/// also of lost clouds. Throws IoError like `run`.
WrittenScans write_and_open(const Scans& scans, const Kind& kind,
                            const std::filesystem::path& folder) {
  std::filesystem::remove_all(folder);
  const std::filesystem::path clouds = folder / (kind.time ? "pcd" : "velodyne");
  std::filesystem::create_directories(clouds);
  std::vector<Pose> poses;
  std::vector<double> times;
  std::vector<std::size_t> written;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    const Recorded recorded = kind.fault(scans, i);
    poses.push_back(recorded.T_world_sensor);
    if (recorded.is_lost) continue;
    const std::string name = simulation::scan_name(written.size());
    if (kind.time) {
      const double period = scans[1].time - scans[0].time;
      test::write_timed_scan(clouds / (name + ".pcd"), recorded.xyzi, scans[i].times,
                             [&](double time) { return kind.time(time, period); });
    } else {
      write_scan(clouds / (name + ".bin"), recorded.xyzi);
    }
    times.push_back(scans[written.size()].time);
    written.push_back(i);
  }
  write_poses(folder / "poses.txt", poses);
  if (kind.time) write_times(folder / "times.txt", times);
  RecordingOptions options;
  options.deskew = static_cast<bool>(kind.time);
  return {Recording(folder, options), written};
}

/// The warnings and the refusal that `dynains run` prints before its first scan.
std::string start_of_run(const Recording& recording) {
  const run::ScanRange range{0, recording.size() - 1};
  std::string said;
  try {
    run::check_ranges(recording, range, RemoverConfig(), false);
  } catch (const ConfigError& error) {
    return error.what();
  }
  for (const std::string& warning : recording.warnings()) said += warning + ' ';
  const run::StartCheck start = run::check_start(recording, range, RemoverConfig(), false);
  for (const std::string& warning : start.warnings) said += warning + ' ';
  return said + start.refusal;
}

struct Outcome {
  double lost = 0.0;  // share of the static points
  Plausibility worst;
  Suspicion first = Suspicion::kNone;
  bool has_jump = false;  // scans that begin an epoch against their poses
  std::string said;

  bool is_told() const { return has_jump || first != Suspicion::kNone || !said.empty(); }
};

/// Removes from the recording as a run would if it began; times are those of the simulated scans.
Outcome judge(const Scans& scans, const WrittenScans& written) {
  constexpr float kMaxRange = 50.0F;  // m
  Outcome outcome;
  std::uint64_t fixed = 0, lost = 0;
  const auto count = [&](const ScanVerdict& verdict) {
    const simulation::SimulatedScan& scan = scans[written.scans[verdict.scan]];
    for (std::size_t i = 0; i < verdict.labels.size(); ++i) {
      const std::uint32_t label = test::class_of(scan.labels[i]);
      const bool is_fixed = label > 1 && label < 252;
      if (!is_fixed || std::hypot(scan.xyzi[4 * i], scan.xyzi[4 * i + 1]) > kMaxRange) continue;
      ++fixed;
      lost += verdict.labels[i] == PointLabel::kDynamic ? 1 : 0;
    }
  };
  DynaInsRemover remover;
  RecordedScan scan;
  for (std::size_t i = 0; i < written.recording.size(); ++i) {
    written.recording.read_scan(i, scan);
    const RawPoints<float> points{scan.xyzi.data(), scan.size(), 4};
    const FrameResult frame =
        remover.push(points, written.recording.T_world_sensor(i), scans[i].time);
    outcome.worst.raise_shares(frame.plausibility);
    outcome.has_jump = outcome.has_jump || frame.began_epoch == EpochReason::kJump ||
                       frame.began_epoch == EpochReason::kMisfit;
    if (outcome.first == Suspicion::kNone) outcome.first = frame.plausibility.suspicion;
    if (frame.finished) count(*frame.finished);
  }
  remover.flush(count);
  outcome.lost = fixed == 0 ? 0.0 : static_cast<double>(lost) / static_cast<double>(fixed);
  return outcome;
}

/// A recording that cannot be opened counts as refused, with nothing lost.
Outcome outcome_of(const Scans& scans, const Kind& kind, const std::filesystem::path& folder) {
  try {
    const WrittenScans written = write_and_open(scans, kind, folder);
    Outcome outcome = judge(scans, written);
    outcome.said = start_of_run(written.recording);
    return outcome;
  } catch (const IoError& error) {
    Outcome outcome;
    outcome.said = error.what();
    return outcome;
  }
}

struct Counts {
  int trials = 0, harmful = 0, told = 0, alarms = 0;
};

void take(const std::string& world, const Kind& kind, const Outcome& outcome, double usual,
          std::map<std::string, Counts>& counts) {
  constexpr double kHarm = 0.05;
  const bool is_told = outcome.is_told();
  const bool is_harmful = outcome.lost > usual + kHarm || outcome.worst.not_judged > 0.98F;
  Counts& sum = counts[kind.name];
  ++sum.trials;
  sum.alarms += is_told ? 1 : 0;
  sum.harmful += is_harmful ? 1 : 0;
  sum.told += is_harmful && is_told ? 1 : 0;
  const Plausibility& worst = outcome.worst;
  std::cout << std::fixed << std::setprecision(3) << world << ' ' << std::left << std::setw(26)
            << kind.name << " lost " << outcome.lost << (is_harmful ? " harmful" : "") << " ground "
            << worst.ground_free << " instances " << worst.instance_free << " residual "
            << worst.residual << " misfits " << worst.misfits << " unjudged " << worst.not_judged
            << " told " << static_cast<int>(outcome.first) << (outcome.has_jump ? " jumps" : "")
            << " said " << outcome.said << std::endl;
}

}  // namespace

int main(int argc, char** argv) {
  const auto number = [&](int k, std::uint64_t usual) {
    return argc > k ? std::strtoull(argv[k], nullptr, 10) : usual;
  };
  const std::uint64_t from = number(1, 1), worlds = number(2, 10);
  const bool only_right = argc > 4 && std::string(argv[4]) == "right";
  std::map<std::string, Counts> counts;
  const test::TemporaryFolder temporary;
  const std::filesystem::path& folder = temporary.path();
  for (std::uint64_t seed = from; seed < from + worlds; ++seed) {
    simulation::Config config = simulation::random_world(seed);
    if (argc > 5) config.scene = value_of_name<simulation::Scene>(argv[5]).value();
    config.scans = static_cast<int>(number(3, 40));
    const std::string world =
        std::to_string(seed) + ' ' + plain_value(config.scene) + ' ' + plain_value(config.sensor);
    const Scans scans = test::simulate(config);
    double usual = 0.0;
    for (const Kind& kind : kinds()) {
      const Outcome outcome = outcome_of(scans, kind, folder / "recording");
      if (kind.name == "right") usual = outcome.lost;
      take(world, kind, outcome, usual, counts);
      if (only_right) break;
    }
    config.rolling_shutter = true;
    config.deskewed = 0.0;
    const Scans skewed = test::simulate(config);
    for (const Kind& kind : kinds_of_times()) {
      if (only_right && kind.name != "right times") continue;
      take(world, kind, outcome_of(skewed, kind, folder / "recording"), usual, counts);
    }
    if (only_right) continue;
    Kind twice = kinds_of_times().at(1);
    const Recording deskewed = write_and_open(skewed, twice, folder / "deskewed").recording;
    twice.name = "de-skewed twice";
    twice.fault = [&](const Scans& raw, std::size_t k) {
      return Recorded{deskewed.read_scan(k).xyzi, raw[k].T_world_sensor};
    };
    take(world, twice, outcome_of(skewed, twice, folder / "recording"), usual, counts);
  }
  std::cout << "| kind | trials | harmful | of them told | told in all |\n"
               "|---|---|---|---|---|\n";
  for (const auto& [kind, sum] : counts) {
    std::cout << "| " << kind << " | " << sum.trials << " | " << sum.harmful << " | " << sum.told
              << " | " << sum.alarms << " |\n";
  }
}
