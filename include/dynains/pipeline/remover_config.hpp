// The facade's own parameters; those of the stages stand beside the stages.
#pragma once

#include <string>

#include "dynains/parameters.hpp"

namespace dynains {

/// How the window slides and which points take part.
struct RemoverConfig {
  int window = 1;          ///< scans in the sliding window, K; 1 compares no descriptors
  bool use_belief = true;  ///< false: initial proposals are verdicts (the paper's IOC-only rows)
  int votes = 1;           ///< windows, of the K that see a scan, that must call a point dynamic
  double min_range = 2.7;  ///< m, in the sensor's x-y plane; nearer points are the robot's own
  double max_range = 250;  ///< m, there and along its z axis; farther points are no measurements
  double max_gap = 1.0;    ///< s; a longer pause between scans starts a new window
  double max_speed = 100;  ///< m/s; a pose that jumps farther than that starts a new window
  bool level = true;       ///< turn scans level, and along the scene; from the first one that has
                           ///< enough points to tell (SensorModel::known())
  double mounting_pitch = 0.0;  ///< deg, nose down; with the roll: 0, 0 is found in the first scan
  double mounting_roll = 0.0;   ///< deg, left side up
  bool use_free_space = true;   ///< evidence from what other scans saw through
  bool build_map = true;        ///< false: labels only, the map stays empty

  /// K = 4 and nothing but the paper's own verdict.
  static RemoverConfig paper() {
    RemoverConfig config;
    config.window = 4;
    config.level = false;
    config.use_free_space = false;
    return config;
  }

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& visitor) {
    visitor(Parameter{"window", self.window, closed(1, 64), "scans",
                      "sliding window K (Eq. 3); 1 compares no descriptors"});
    visitor(Parameter{"use_belief", self.use_belief, Bounds(), "",
                      "revert proposals by belief (Eq. 13-19); off is the paper's IOC-only row"});
    visitor(Parameter{"votes", self.votes, closed(0, 64), "windows",
                      "windows that must call a point dynamic for the final verdict; 0: the newest "
                      "window alone decides, without latency"});
    visitor(
        Parameter{"min_range", self.min_range, closed(0, 100), "m",
                  "nearer points (in the sensor's own x-y plane, tilted or not) are the robot's "
                  "own and not judged"});
    visitor(Parameter{"max_range", self.max_range, half_open_below(0, 10000), "m",
                      "farther points (in the sensor's own x-y plane, or along its z axis) are not "
                      "judged"});
    visitor(Parameter{"max_gap", self.max_gap, half_open_below(0, 1e9), "s",
                      "a longer pause between two scans starts a new window"});
    visitor(Parameter{"max_speed", self.max_speed, half_open_below(0, 1e9), "m/s",
                      "a pose that is farther from the one before starts a new window"});
    visitor(Parameter{"level", self.level, Bounds(), "",
                      "turn scans level, and along the scene, before they are judged"});
    visitor(Parameter{"mounting_pitch", self.mounting_pitch, closed(-180, 180), "deg",
                      "tilt of the sensor about its y axis, nose down (x forward), before the "
                      "roll; if pitch and roll are 0, the tilt is found in the first scan"});
    visitor(Parameter{"mounting_roll", self.mounting_roll, closed(-180, 180), "deg",
                      "tilt of the sensor about its x axis, left side up"});
    visitor(Parameter{"use_free_space", self.use_free_space, Bounds(), "",
                      "remove what other scans saw through (beyond the paper)"});
    visitor(Parameter{"build_map", self.build_map, Bounds(), "", "accumulate the static map"});
  }

  /// Whether a scan begins a new window: `pause` s and `way` m behind the one before.
  bool breaks_off(double pause, double way) const {
    return pause > max_gap || way > max_speed * pause;
  }

  /// Throws ConfigError.
  void validate() const {
    validate_parameters("DynaInsRemover", *this);
    if (!(min_range < max_range)) {
      throw ConfigError("DynaInsRemover.min_range = " + std::to_string(min_range) +
                        " must be less than max_range = " + std::to_string(max_range));
    }
    if (votes > window) {
      throw ConfigError("DynaInsRemover.votes = " + std::to_string(votes) +
                        " must be at most window = " + std::to_string(window));
    }
  }
};

}  // namespace dynains
