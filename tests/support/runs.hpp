// Runs a remover over scans and keeps the verdicts.
#pragma once

#include "dynains/compiled_remover.hpp"
#include "support/scene.hpp"
#include "support/standard.hpp"

namespace dynains::test {

/// A ScanVerdict that owns its arrays.
struct Verdict {
  std::uint64_t scan = 0;
  double time = 0.0;
  std::vector<PointLabel> labels;
  std::vector<std::uint32_t> instances;
  std::vector<float> beliefs;
  std::vector<Cause> causes;

  Verdict() = default;
  explicit Verdict(const ScanVerdict& v)
      : scan(v.scan),
        time(v.time),
        labels(v.labels.begin(), v.labels.end()),
        instances(v.instances.begin(), v.instances.end()),
        beliefs(v.beliefs.begin(), v.beliefs.end()),
        causes(v.causes.begin(), v.causes.end()) {}

  friend bool operator==(const Verdict& a, const Verdict& b) {
    return a.scan == b.scan && a.time == b.time && a.labels == b.labels &&
           a.instances == b.instances && a.beliefs == b.beliefs && a.causes == b.causes;
  }
};

template <class Stages>
FrameResult push(BasicDynaInsRemover<Stages>& remover, const Scan& scan) {
  return remover.push(scan.points, scan.T_world_sensor, scan.time);
}

inline std::vector<Eigen::Vector3d> map_points(const DynaInsRemover& remover) {
  std::vector<Eigen::Vector3d> points;
  remover.map().for_each([&](const Eigen::Vector3d& point) { points.push_back(point); });
  return points;
}

struct Run {
  std::vector<Verdict> newest;  // verdicts without latency
  std::vector<Verdict> final;   // in the order of their calls
};

/// Runs over the scans, each converted to another type of cloud.
template <class Stages, class Convert>
Run run(BasicDynaInsRemover<Stages>& remover, const std::vector<Scan>& scans, Convert&& convert) {
  Run result;
  for (const Scan& scan : scans) {
    const auto& cloud = convert(scan.points);  // outlives the call of push
    const FrameResult frame = remover.push(cloud, scan.T_world_sensor, scan.time);
    result.newest.emplace_back(frame.newest());
    if (frame.finished) result.final.emplace_back(*frame.finished);
  }
  remover.flush([&](const ScanVerdict& verdict) { result.final.emplace_back(verdict); });
  return result;
}

template <class Stages>
Run run(BasicDynaInsRemover<Stages>& remover, const std::vector<Scan>& scans) {
  return run(
      remover, scans, [](const auto& points) -> const auto& { return points; });
}

inline Run run(const DynaInsRemover::Config& config, const std::vector<Scan>& scans) {
  DynaInsRemover remover(config);
  return run(remover, scans);
}

inline Run run_paper(const std::vector<Scan>& scans) {
  return run(DynaInsRemover::Config::paper(), scans);
}

/// Number of points of one object (all objects if `object` is kAnyObject), and number of them with
/// a label.
inline constexpr int kAnyObject = -2;
struct Share {
  std::size_t labelled = 0;
  std::size_t total = 0;
  double value() const {
    return total == 0 ? 0.0 : static_cast<double>(labelled) / static_cast<double>(total);
  }
};
inline Share share(const std::vector<Scan>& scans, const std::vector<Verdict>& verdicts,
                   PointLabel label, int object = kAnyObject) {
  Share result;
  for (const Verdict& verdict : verdicts) {
    const Scan& scan = scans.at(verdict.scan);
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      if (object != kAnyObject && scan.object[i] != object) continue;
      ++result.total;
      if (verdict.labels[i] == label) ++result.labelled;
    }
  }
  return result;
}

/// Share of points with different labels in two runs.
inline double disagreement(const std::vector<Verdict>& a, const std::vector<Verdict>& b) {
  std::size_t different = 0;
  std::size_t total = 0;
  for (std::size_t s = 0; s < a.size(); ++s) {
    for (std::size_t i = 0; i < a[s].labels.size(); ++i) {
      ++total;
      if (a[s].labels[i] != b.at(s).labels.at(i)) ++different;
    }
  }
  return static_cast<double>(different) / static_cast<double>(total);
}

}  // namespace dynains::test
