// Simulated sequences through the remover, and their score.
#pragma once

#include "dynains/compiled_remover.hpp"
#include "dynains/evaluation/evaluate.hpp"
#include "simulation/simulator.hpp"
#include "support/standard.hpp"

namespace dynains::test {

inline std::vector<simulation::SimulatedScan> simulate(const simulation::Config& config) {
  simulation::Simulator simulator(config);
  std::vector<simulation::SimulatedScan> scans;
  for (std::size_t i = 0; i < simulator.size(); ++i) scans.push_back(simulator.scan(i));
  return scans;
}

inline RawPoints<float> points_of(const simulation::SimulatedScan& scan) {
  const std::uint8_t* const sensors = scan.sensors.empty() ? nullptr : scan.sensors.data();
  return {scan.xyzi.data(), scan.labels.size(), 4, sensors};
}

/// Pushes all scans and gives each frame and each final verdict to a function.
template <class TakeFrame, class TakeFinal>
void push_all(DynaInsRemover& remover, const std::vector<simulation::SimulatedScan>& scans,
              const TakeFrame& take_frame, const TakeFinal& take_final) {
  for (const simulation::SimulatedScan& scan : scans) {
    const FrameResult frame = remover.push(points_of(scan), scan.T_world_sensor, scan.time);
    take_frame(frame);
    if (frame.finished) take_final(*frame.finished);
  }
  remover.flush(take_final);
}

/// For each scan and point, whether the point is static.
using StaticPoints = std::vector<std::vector<std::uint8_t>>;

struct StaticByVerdict {
  StaticPoints newest, final;
};

inline StaticByVerdict static_points(const std::vector<simulation::SimulatedScan>& scans,
                                     const DynaInsRemover::Config& config = {}) {
  StaticByVerdict result{StaticPoints(scans.size()), StaticPoints(scans.size())};
  const auto keep = [](const ScanVerdict& verdict, StaticPoints& points) {
    for (const PointLabel label : verdict.labels) {
      points.at(verdict.scan).push_back(is_static(label) ? 1 : 0);
    }
  };
  DynaInsRemover remover(config);
  push_all(
      remover, scans, [&](const FrameResult& frame) { keep(frame.newest(), result.newest); },
      [&](const ScanVerdict& verdict) { keep(verdict, result.final); });
  return result;
}

/// Settings for scores within 50 m.
inline evaluation::EvaluationConfig within_50_m() {
  evaluation::EvaluationConfig config;
  config.max_range = 50.0;
  return config;
}

/// A point is static by estimate k, called `names[k]`, if bit k of `in_map` is 1. `mounts`: those
/// of the simulator.
inline evaluation::Evaluation evaluate(const std::vector<simulation::SimulatedScan>& scans,
                                       const StaticPoints& in_map,
                                       const std::vector<std::string>& names,
                                       const std::vector<Pose>& mounts = {},
                                       const evaluation::EvaluationConfig& config = within_50_m()) {
  std::vector<Eigen::Vector3d> origins;
  for (const Pose& mount : mounts) origins.emplace_back(mount.translation());
  const auto source = [&](std::size_t i, evaluation::LabelledScan& scan) {
    if (i == scans.size()) return false;
    scan.xyz = scans[i].xyzi.data();
    scan.stride = 4;
    scan.sensors = scans[i].sensors.empty() ? nullptr : scans[i].sensors.data();
    scan.origins = origins;
    scan.T_world_sensor = scans[i].T_world_sensor;
    scan.truth = scans[i].labels;
    scan.in_map = in_map[i];
    return true;
  };
  return evaluation::evaluate(source, names, {}, config);
}

/// PR, RR and F1 of ERASOR.
inline evaluation::Score score(const std::vector<simulation::SimulatedScan>& scans,
                               const StaticPoints& in_map) {
  return evaluate(scans, in_map, {"run"}).rows[2].voxels;
}

}  // namespace dynains::test
