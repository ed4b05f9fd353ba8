// Trials of the warnings about faulty recordings. Each random world is spoilt by each kind of fault
// of poses and clouds. A fault counts as harmful if at least 5 % more of the static points within
// 50 m are called moving than with right poses, or if nothing is judged. It is told if the
// plausibility check of the remover says so, or if `dynains run` would refuse or warn before its
// first scan; the cause is right if that text has the words of the kind.
//   plausibility_trials [FROM [WORLDS [SCANS [right|all]]]]
// Prints a row for each world and kind with the largest shares of any window, then the counts.
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <iomanip>
#include <iostream>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "dynains/compiled_remover.hpp"
#include "dynains/io/kitti.hpp"
#include "dynains/poses/pose_jumps.hpp"
#include "dynains/simulation/random_world.hpp"
#include "dynains/simulation/simulator.hpp"
#include "dynains/simulation/write_sequence.hpp"
#include "run/start_check.hpp"
#include "support/simulated_runs.hpp"

using namespace dynains;

namespace {

using Scans = std::vector<simulation::SimulatedScan>;

/// Cloud and pose that a host pushes instead of the right ones.
struct Pushed {
  std::vector<float> xyzi;
  Pose T_world_sensor;
  bool is_lost = false;  // not pushed at all
};

using Fault = std::function<Pushed(const Scans&, std::size_t)>;

struct Kind {
  std::string name;
  std::vector<std::string> causes;  ///< words of a right text; none: any text is right
  Fault fault;
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
    return Pushed{scans[i].xyzi, change(scans, i)};
  };
}

Fault of_body(const Pose& T_sensor_body) {
  return posed([T_sensor_body](const Scans& scans, std::size_t i) {
    return Pose(scans[i].T_world_sensor * T_sensor_body);
  });
}

Fault scaled_poses(double factor) {
  return posed([factor](const Scans& scans, std::size_t i) {
    Pose T = scans[i].T_world_sensor;
    T.translation() *= factor;
    return T;
  });
}

/// `change_of_scan(i)` gives the function that changes each coordinate of scan i.
template <class ChangeOfScan>
Fault changed_points(ChangeOfScan change_of_scan) {
  return [change_of_scan](const Scans& scans, std::size_t i) {
    Pushed pushed{scans[i].xyzi, scans[i].T_world_sensor};
    auto change = change_of_scan(i);
    for (std::size_t k = 0; k < pushed.xyzi.size(); ++k) {
      if (k % 4 != 3) pushed.xyzi[k] = change(pushed.xyzi[k]);
    }
    return pushed;
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
    Pushed pushed{scans[i].xyzi, scans[i].T_world_sensor * moved(-x, -y, -z)};
    for (std::size_t k = 0; k + 3 < pushed.xyzi.size(); k += 4) {
      pushed.xyzi[k] += x;
      pushed.xyzi[k + 1] += y;
      pushed.xyzi[k + 2] += z;
    }
    return pushed;
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
  const auto right =
      posed([](const Scans& scans, std::size_t i) { return scans[i].T_world_sensor; });
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
      const bool is_behind = i >= first + count;
      return Pushed{scans[i].xyzi, scans[is_behind ? i - count : i].T_world_sensor,
                    first <= i && !is_behind};
    };
  };
  const std::vector<std::string> body = {"--extrinsic"}, none;
  return {{"right", none, right},
          {"clouds of a body", {"--sensor-origin", "rays do not begin"}, in_body(1.0F, 0.0F, 1.5F)},
          {"jump of 3 m", {"poses jump"}, jump(3, 2)},
          {"points in mm", {"units"}, scaled_points(1000.0F)},
          {"points in cm", {"units"}, scaled_points(100.0F)},
          {"poses in mm", {"--pose-units mm"}, scaled_poses(1000.0)},
          {"poses in km", none, scaled_poses(0.001)},
          {"poses 10 % too long", {"--pose-scale"}, scaled_poses(1.1)},
          {"inverse", {"--invert-poses"}, posed([](const Scans& scans, std::size_t i) {
             return Pose((scans[0].T_world_sensor.inverse() * scans[i].T_world_sensor).inverse());
           })},
          {"yawed by 90 deg", body, of_body(turned(90))},
          {"yawed by 180 deg", body, of_body(turned(180))},
          {"upside down", body, of_body(turned(180, Eigen::Vector3d::UnitX()))},
          {"late by two scans",
           {"--pose-shift", "--time-offset"},
           posed([](const Scans& scans, std::size_t i) {
             return scans[std::min(i + 2, scans.size() - 1)].T_world_sensor;
           })},
          {"three clouds lost", {"seem to be missing", "may be missing"}, lost(3)},
          {"noise of 20 cm and 1 deg", {"inexact"}, posed([](const Scans& scans, std::size_t i) {
             return Pose(scans[i].T_world_sensor * noise(i, 0.2, 1.0));
           })},
          {"no motion", none,
           posed([](const Scans& scans, std::size_t) { return scans[0].T_world_sensor; })},
          {"random points", none, random_points},
          {"points with noise of 30 cm", none, noisy_points}};
}

/// Text by which `dynains run` would warn or refuse the poses before its first scan; empty if it
/// accepts them.
std::string said_by_run(const Scans& scans, const Fault& fault,
                        const std::filesystem::path& folder) {
  std::filesystem::remove_all(folder / "velodyne");
  std::filesystem::create_directory(folder / "velodyne");
  std::vector<Pose> rows;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    const Pushed pushed = fault(scans, i);
    if (pushed.is_lost) continue;
    write_scan(folder / "velodyne" / (simulation::scan_name(rows.size()) + ".bin"), pushed.xyzi);
    rows.push_back(pushed.T_world_sensor);
  }
  write_poses(folder / "poses.txt", rows);
  const Recording recording(folder);
  const std::size_t last = recording.size() - 1;
  std::string text;
  const std::vector<PoseJump> jumps = find_pose_jumps(recording, 0, last);
  if (!jumps.empty()) text = sentence_on(recording, jumps) + ' ';
  const program::StartCheck start =
      program::check_start(recording, {0, last}, RemoverConfig(), false, folder.string());
  for (const std::string& warning : start.warnings) text += warning + ' ';
  return text + start.refusal;
}

struct Outcome {
  double lost = 0.0;  // share of the static points
  Plausibility worst;
  Suspicion first = Suspicion::kNone;
  std::uint64_t since = 0;
  std::string said;  ///< by a run, before its first scan
};

Outcome judge(const Scans& scans, const Fault& fault) {
  constexpr float kFarthest = 50.0F;  // m
  Outcome outcome;
  std::uint64_t fixed = 0, lost = 0;
  std::vector<std::size_t> pushes;  // scan of each
  const auto count = [&](const ScanVerdict& verdict) {
    const simulation::SimulatedScan& scan = scans[pushes[verdict.scan]];
    for (std::size_t i = 0; i < verdict.labels.size(); ++i) {
      const std::uint32_t label = scan.labels[i] & 0xFFFFU;
      const bool is_fixed = label > 1 && label < 252;
      if (!is_fixed || std::hypot(scan.xyzi[4 * i], scan.xyzi[4 * i + 1]) > kFarthest) continue;
      ++fixed;
      lost += verdict.labels[i] == PointLabel::kDynamic ? 1 : 0;
    }
  };
  DynaInsRemover remover;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    const Pushed pushed = fault(scans, i);
    if (pushed.is_lost) continue;
    pushes.push_back(i);
    const RawPoints<float> points{pushed.xyzi.data(), scans[i].labels.size(), 4};
    const FrameResult frame =
        remover.push(points, pushed.T_world_sensor, scans[pushes.size() - 1].time);
    outcome.worst.raise_shares(frame.plausibility);
    if (outcome.first == Suspicion::kNone && frame.plausibility.suspicion != Suspicion::kNone) {
      outcome.first = frame.plausibility.suspicion;
      outcome.since = frame.plausibility.since;
    }
    if (frame.finished) count(*frame.finished);
  }
  remover.flush(count);
  outcome.lost = fixed == 0 ? 0.0 : static_cast<double>(lost) / static_cast<double>(fixed);
  return outcome;
}

struct Counts {
  int trials = 0, harmful = 0, told = 0, with_cause = 0, alarms = 0;
};

bool has_right_cause(const Outcome& outcome, const std::vector<std::string>& causes) {
  const std::string text = outcome.said + (outcome.first == Suspicion::kUnits ? " units" : "");
  return std::any_of(causes.begin(), causes.end(), [&](const std::string& cause) {
    return text.find(cause) != std::string::npos;
  });
}

void take(const std::string& world, const Kind& named, const Outcome& outcome, double usual,
          std::map<std::string, Counts>& counts) {
  constexpr double kHarm = 0.05;
  const std::string& kind = named.name;
  const bool is_told = outcome.first != Suspicion::kNone || !outcome.said.empty();
  const bool is_harmful = outcome.lost > usual + kHarm || outcome.worst.not_judged > 0.98F;
  Counts& sum = counts[kind];
  ++sum.trials;
  sum.alarms += is_told ? 1 : 0;
  sum.harmful += is_harmful ? 1 : 0;
  sum.told += is_harmful && is_told ? 1 : 0;
  sum.with_cause +=
      is_harmful && is_told && (named.causes.empty() || has_right_cause(outcome, named.causes)) ? 1
                                                                                                : 0;
  const Plausibility& worst = outcome.worst;
  std::cout << std::fixed << std::setprecision(3) << world << ' ' << std::left << std::setw(26)
            << kind << " lost " << outcome.lost << " ground " << worst.ground_free << " instances "
            << worst.instance_free << " residual " << worst.residual << " misfits " << worst.misfits
            << " unjudged " << worst.not_judged << " told " << static_cast<int>(outcome.first)
            << " since " << outcome.since << " said " << outcome.said << std::endl;
}

}  // namespace

int main(int argc, char** argv) {
  const auto number = [&](int k, std::uint64_t usual) {
    return argc > k ? std::strtoull(argv[k], nullptr, 10) : usual;
  };
  const std::uint64_t from = number(1, 1), worlds = number(2, 10);
  const bool only_right = argc > 4 && std::string(argv[4]) == "right";
  std::map<std::string, Counts> counts;
  std::string pattern =
      (std::filesystem::temp_directory_path() / "plausibility_trials_XXXXXX").string();
  const std::filesystem::path folder = ::mkdtemp(pattern.data());
  for (std::uint64_t seed = from; seed < from + worlds; ++seed) {
    simulation::Config config = simulation::random_world(seed);
    config.scans = static_cast<int>(number(3, 40));
    const std::string world = std::to_string(seed) + ' ' +
                              simulation::scene_names()[static_cast<std::size_t>(config.scene)] +
                              ' ' +
                              simulation::sensor_names()[static_cast<std::size_t>(config.sensor)];
    const Scans scans = test::simulate(config);
    double usual = 0.0;
    for (const Kind& kind : kinds()) {
      Outcome outcome = judge(scans, kind.fault);
      outcome.said = said_by_run(scans, kind.fault, folder);
      if (kind.name == "right") usual = outcome.lost;
      take(world, kind, outcome, usual, counts);
      if (only_right) break;
    }
    if (only_right) continue;
    config.rolling_shutter = true;
    config.deskewed = 0.0;
    const Scans skewed = test::simulate(config);
    const Fault right = kinds().front().fault;
    Outcome outcome = judge(skewed, right);
    outcome.said = said_by_run(skewed, right, folder);
    take(world, {"not de-skewed", {}, right}, outcome, usual, counts);
  }
  std::filesystem::remove_all(folder);
  std::cout << "| kind | trials | harmful | of them told | with the cause | told in all |\n"
               "|---|---|---|---|---|---|\n";
  for (const auto& [kind, sum] : counts) {
    std::cout << "| " << kind << " | " << sum.trials << " | " << sum.harmful << " | " << sum.told
              << " | " << sum.alarms << " |\n";
  }
}
