// All parameters of a remover: RemoverConfig and the Config of each stage.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <string>
#include <type_traits>
#include <vector>

#include "dynains/clusters/cluster_set.hpp"
#include "dynains/errors.hpp"
#include "dynains/evidence/free_space_config.hpp"
#include "dynains/parameters.hpp"
#include "dynains/pose.hpp"

namespace dynains {

namespace detail {

/// Whether `Operation<T>` is well-formed; detects optional members of T.
template <template <class> class Operation, class T, class = void>
struct Offers : std::false_type {};
template <template <class> class Operation, class T>
struct Offers<Operation, T, std::void_t<Operation<T>>> : std::true_type {};

/// `Config::paper()`, or the defaults if the config has no such member.
template <class Config>
auto paper_config(int) -> decltype(Config::paper()) {
  return Config::paper();
}
template <class Config>
Config paper_config(...) {
  return Config();
}

/// `Config::published()`, or that of paper_config() if the config has no such member.
template <class Config>
auto published_config(int) -> decltype(Config::published()) {
  return Config::published();
}
template <class Config>
Config published_config(...) {
  return paper_config<Config>(0);
}

}  // namespace detail

/// Evidence by which points are classified as dynamic.
enum class Decision {
  kWindow,     ///< occupancy of clusters within a sliding window of scans: the paper, Eq. 3-19
  kFreeSpace,  ///< beams of other scans through the position of a point; not in the paper
};

constexpr std::array<const char*, 2> value_names(Decision) { return {"window", "free_space"}; }

/// Observations of a cluster that update its belief sequentially (Eq. 15, 16).
enum class BeliefObservations {
  kNewest,  ///< only the newest observation, compared with the whole cluster
  kOthers,  ///< all observations, each compared with all others
};

constexpr std::array<const char*, 2> value_names(BeliefObservations) {
  return {"newest", "others"};
}

/// Parameters of BasicDynaInsRemover itself. visit() gives their meaning and bounds.
struct RemoverConfig {
  Decision decision = Decision::kFreeSpace;
  int window = 4;          ///< scans, K of Eq. 3
  bool use_belief = true;  ///< Eq. 13-19
  BeliefObservations belief_observations = BeliefObservations::kNewest;
  Comparison compared_clusters = Comparison::kEnds;
  bool big_is_static = false;
  int votes = 1;           ///< number of windows
  double min_range = 2.7;  ///< m, in the sensor's x-y plane
  double max_range = 250;  ///< m, in the sensor's x-y plane, and along its z axis
  /// By sensor, its pose in the frame of the pushed clouds (m), such as base_link: its rays begin
  /// at its origin. PointCloudTraits give the sensor of a point; by default it is the first one.
  std::vector<Pose> sensors = {Pose::Identity()};
  double max_gap = 1.0;    ///< s
  double max_speed = 100;  ///< m/s
  bool level = true;
  double mounting_pitch = 0.0;  ///< deg, nose down
  double mounting_roll = 0.0;   ///< deg, left side up
  int threads = 1;
  bool build_map = true;
  bool objects = false;

  /// Verdicts by the method of the paper (Eq. 3-19).
  static RemoverConfig paper() {
    RemoverConfig config;
    config.decision = Decision::kWindow;
    config.level = false;
    return config;
  }

  /// Verdicts as the public implementation of the paper gives them.
  static RemoverConfig published() {
    RemoverConfig config = paper();
    config.belief_observations = BeliefObservations::kOthers;
    config.compared_clusters = Comparison::kAnyBefore;
    config.big_is_static = true;
    config.votes = 0;
    return config;
  }

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& visitor) {
    visitor(Parameter{"decision", self.decision, Bounds(), "",
                      "evidence of motion: occupancy of clusters in a sliding window of scans (the "
                      "paper), or free space that beams of other scans passed through"});
    visitor(Parameter{"window", self.window, closed(2, 64), "scans",
                      "sliding window K (Eq. 3) of decision = window"});
    visitor(Parameter{"use_belief", self.use_belief, Bounds(), "",
                      "revert proposals of the window by belief (Eq. 13-19); false: IOC only"});
    visitor(Parameter{"belief_observations", self.belief_observations, Bounds(), "",
                      "observations that update the belief (Eq. 15, 16): the newest against the "
                      "whole cluster, or each against all others"});
    visitor(Parameter{"compared_clusters", self.compared_clusters, Bounds(), "",
                      "clusters of a window that can be dynamic: seen in both its ends, or in the "
                      "newest scan and any before it"});
    visitor(Parameter{"big_is_static", self.big_is_static, Bounds(), "",
                      "clusters of a window that are longer than 25 m, higher than 3.5 m, reach "
                      "3.5 m over the sensor or have at most three points in each end are static"});
    visitor(Parameter{"votes", self.votes, closed(0, 64), "windows",
                      "windows that must call a point dynamic; 0: only the newest window decides, "
                      "without latency"});
    visitor(Parameter{
        "min_range", self.min_range, closed(0, 100), "m",
        "nearer points (x-y plane of their sensor) belong to the robot and are not judged"});
    visitor(Parameter{"max_range", self.max_range, half_open_below(0, 10000), "m",
                      "farther points (x-y plane or z axis of their sensor) are not judged"});
    visitor(
        Parameter{"max_gap", self.max_gap, half_open_below(0, 1e9), "s",
                  "a longer pause begins an epoch: scans before and after it are not compared"});
    visitor(Parameter{"max_speed", self.max_speed, half_open_below(0, 1e9), "m/s",
                      "a pose that needs a higher speed begins an epoch"});
    visitor(Parameter{"level", self.level, Bounds(), "",
                      "turn scans level, and along the scene, before they are judged"});
    visitor(Parameter{"mounting_pitch", self.mounting_pitch, closed(-180, 180), "deg",
                      "tilt of the sensor about y, nose down (x forward), before the roll; both 0: "
                      "found in the first scan"});
    visitor(Parameter{"mounting_roll", self.mounting_roll, closed(-180, 180), "deg",
                      "tilt of the sensor about x, left side up"});
    visitor(Parameter{"threads", self.threads, closed(1, 2), "threads",
                      "2: two stages run in parallel, with the same verdicts; a final verdict "
                      "comes one scan later, unless it has no latency"});
    visitor(Parameter{"build_map", self.build_map, Bounds(), "", "accumulate the static map"});
    visitor(Parameter{"objects", self.objects, Bounds(), "",
                      "list moving instances as boxes with ids and velocities"});
  }

  /// Whether a scan starts a new epoch. `pause`: s since the previous scan. `distance`: m from its
  /// pose.
  bool starts_epoch(double pause, double distance) const {
    return pause > max_gap || distance > max_speed * pause;
  }

  /// Throws ConfigError for a field out of bounds, min_range >= max_range, votes > window, or
  /// sensors that are none, more than 255, farther than 1000 m, or without a rigid pose.
  void validate() const {
    validate_parameters("DynaInsRemover", *this);
    validate_sensors();
    if (!(min_range < max_range)) {
      throw ConfigError("DynaInsRemover.min_range = " + std::to_string(min_range) +
                        " must be less than max_range = " + std::to_string(max_range));
    }
    if (votes > window) {
      throw ConfigError("DynaInsRemover.votes = " + std::to_string(votes) +
                        " must be at most window = " + std::to_string(window));
    }
  }

 private:
  void validate_sensors() const {
    constexpr std::size_t kMaxSensors = 255;
    if (sensors.empty() || sensors.size() > kMaxSensors) {
      throw ConfigError("DynaInsRemover.sensors has " + std::to_string(sensors.size()) +
                        " poses; expected 1 to " + std::to_string(kMaxSensors));
    }
    for (std::size_t i = 0; i < sensors.size(); ++i) {
      const std::string name = "DynaInsRemover.sensors[" + std::to_string(i) + "]";
      try {
        validate_pose(name, sensors[i]);
      } catch (const PoseError& error) {
        throw ConfigError(error.what());
      }
      if (sensors[i].translation().cwiseAbs().maxCoeff() > 1000.0) {
        throw ConfigError(name + " is farther than 1000 m from the origin of the clouds");
      }
    }
  }
};

/// All parameters: `BasicDynaInsRemover<Stages>::Config`.
template <class Stages>
struct PipelineConfig : RemoverConfig {
  typename Stages::Ground::Config ground;
  typename Stages::Clusterer::Config clusterer;
  typename Stages::Descriptor::Config descriptor;
  typename Stages::Belief::Config belief;
  FreeSpaceConfig evidence;
  typename Stages::Map::Config map;

  /// Method and parameters of the paper. Voxels, cells and ground, for which the paper gives no
  /// values, follow its public implementation. Ranges differ, see docs/algorithm.md.
  static PipelineConfig paper() {
    PipelineConfig config;
    visit_sections(config, [](const char*, auto& section) {
      section = detail::paper_config<std::remove_reference_t<decltype(section)>>(0);
    });
    return config;
  }

  /// Method and parameters of the paper's public implementation, where it departs from the text.
  static PipelineConfig published() {
    PipelineConfig config;
    visit_sections(config, [](const char*, auto& section) {
      section = detail::published_config<std::remove_reference_t<decltype(section)>>(0);
    });
    return config;
  }

  /// For recordings, where latency does not matter: more later scans are evidence, at the cost of
  /// memory.
  static PipelineConfig offline() {
    PipelineConfig config;
    config.evidence = FreeSpaceConfig::offline();
    return config;
  }

  /// For the loop around an odometry: corrects motions from 3 mm on, and builds no map, since the
  /// pushed poses are not final.
  static PipelineConfig odometry() {
    PipelineConfig config;
    config.build_map = false;
    config.evidence = FreeSpaceConfig::odometry();
    return config;
  }

  /// The configuration with this name: "default", "paper", "published", "offline" or "odometry".
  /// Throws ConfigError.
  static PipelineConfig preset(const std::string& name) {
    if (name == "default") return PipelineConfig();
    if (name == "paper") return paper();
    if (name == "published") return published();
    if (name == "offline") return offline();
    if (name == "odometry") return odometry();
    throw ConfigError("preset = " + name + ": expected default|paper|published|offline|odometry");
  }

  /// Calls `visitor(name, config)` for the RemoverConfig and for the Config of each stage.
  template <class Self, class Visitor>
  static void visit_sections(Self& self, Visitor&& visitor) {
    using Own = std::conditional_t<std::is_const_v<Self>, const RemoverConfig, RemoverConfig>;
    visitor("DynaInsRemover", static_cast<Own&>(self));
    visitor("GroundSegmenter", self.ground);
    visitor("CurvedVoxelClusterer", self.clusterer);
    visitor("OccupancyDescriptor", self.descriptor);
    visitor("BeliefUpdater", self.belief);
    visitor("FreeSpaceEvidence", self.evidence);
    visitor("StaticMapAccumulator", self.map);
  }

  /// Calls `visitor` with the Parameter of every field; names are unique over all stages.
  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& visitor) {
    visit_sections(self, [&visitor](const char*, auto& section) {
      std::remove_const_t<std::remove_reference_t<decltype(section)>>::visit(section, visitor);
    });
  }

  /// Throws ConfigError for an invalid section.
  void validate() const {
    visit_sections(*this, [](const char*, const auto& section) { section.validate(); });
  }
};

}  // namespace dynains
