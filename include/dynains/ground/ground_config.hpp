// Parameters of the ground segmentation.
#pragma once

#include <array>
#include <cstddef>
#include <string>

#include "dynains/parameters.hpp"

namespace dynains {

/// Parameters of Patchwork, plus two additional ones: `ground_step` and `ground_fit_points`.
struct GroundConfig {
  /// Number of innermost rings in which the height and the flatness of a patch are checked.
  static constexpr std::size_t kCheckedRings = 4;

  double sensor_height = 0.0;         ///< m, sensor origin over the ground; 0: estimated from scans
  double ground_min_range = 1.0;      ///< m, inner edge of the first ring
  double ground_max_range = 100.0;    ///< m, outer edge of the last ring
  int ground_iterations = 3;          ///< plane fits per patch
  int ground_lowest_points = 10;      ///< points whose mean height seeds the plane
  int ground_min_points = 11;         ///< patches with fewer points are not ground
  int ground_fit_points = 512;        ///< maximum number of points that a plane is fitted to
  double ground_seed_margin = 0.5;    ///< m above the seed height
  double ground_distance = 0.125;     ///< m, ground points are less than this above the plane
  double ground_uprightness = 0.707;  ///< smallest z of the unit normal
  double ground_below = 0.1;  ///< depth of noise below the ground, as a ratio of sensor_height
  double noise_depth = 0.0;   ///< depth of noise below the sensor, as a ratio of sensor_height
  double ground_step = 0.5;   ///< m, a patch higher above its neighbours is not ground
  /// By inner ring: largest height (m over ground) of a ground patch that is not flat.
  std::array<double, kCheckedRings> ground_elevation = {0.523, 0.7246, 0.872, 1.118};
  /// By inner ring: flatness below which a patch above ground_elevation is ground.
  std::array<double, kCheckedRings> ground_flatness = {0.0, 1.25e-4, 1.85e-4, 1.85e-4};

  /// The values of the paper: no `ground_step`, the sensor height of KITTI, and the `noise_depth`
  /// of Patchwork.
  static GroundConfig paper() {
    GroundConfig config;
    config.sensor_height = 1.723;
    config.noise_depth = 1.8;
    config.ground_step = 0.0;
    return config;
  }

  /// The public implementation of the paper.
  static GroundConfig published() {
    GroundConfig config = paper();
    config.ground_min_points = 6;
    config.ground_fit_points = 1000000;
    return config;
  }

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& visitor) {
    visitor(Parameter{"sensor_height", self.sensor_height, closed(0, 100), "m",
                      "height of the sensor over the ground; 0: estimated from scans"});
    visitor(Parameter{"ground_min_range", self.ground_min_range, closed(0, 100), "m",
                      "inner edge of the first ring of ground patches"});
    visitor(Parameter{"ground_max_range", self.ground_max_range, closed(1, 1000), "m",
                      "outer edge of the last ring of ground patches"});
    visitor(Parameter{"ground_iterations", self.ground_iterations, closed(1, 10), "",
                      "plane fits per patch"});
    visitor(Parameter{"ground_lowest_points", self.ground_lowest_points, closed(1, 64), "",
                      "lowest points of a patch that seed its plane"});
    visitor(Parameter{"ground_min_points", self.ground_min_points, closed(3, 1000), "",
                      "patches with fewer points are not ground"});
    visitor(Parameter{"ground_fit_points", self.ground_fit_points, closed(64, 1000000), "",
                      "maximum number of points that the plane of a patch is fitted to"});
    visitor(Parameter{"ground_seed_margin", self.ground_seed_margin, half_open_below(0, 10), "m",
                      "height over the seeds up to which points enter the first fit"});
    visitor(Parameter{"ground_distance", self.ground_distance, half_open_below(0, 2), "m",
                      "height over the plane up to which points are ground"});
    visitor(Parameter{"ground_uprightness", self.ground_uprightness, closed(0, 1), "",
                      "smallest vertical component of a ground plane's normal"});
    visitor(Parameter{"ground_below", self.ground_below, closed(0, 10), "",
                      "depth under the ground, in sensor heights, from which points of the inner "
                      "zone seed no plane"});
    visitor(Parameter{"noise_depth", self.noise_depth, closed(0, 100), "",
                      "points deeper below the sensor, in sensor heights, are reflections and not "
                      "judged (Patchwork); 0: all are judged"});
    visitor(Parameter{"ground_step", self.ground_step, closed(0, 100), "m",
                      "a patch higher than this above most of its neighbours is not ground, except "
                      "in the outermost zone; 0: no check"});
    visitor(Parameter{"ground_elevation_1", self.ground_elevation[0], closed(-100, 100), "m",
                      "height over ground from which ring 1 must be flat"});
    visitor(Parameter{"ground_elevation_2", self.ground_elevation[1], closed(-100, 100), "m",
                      "height over ground from which ring 2 must be flat"});
    visitor(Parameter{"ground_elevation_3", self.ground_elevation[2], closed(-100, 100), "m",
                      "height over ground from which ring 3 must be flat"});
    visitor(Parameter{"ground_elevation_4", self.ground_elevation[3], closed(-100, 100), "m",
                      "height over ground from which ring 4 must be flat"});
    visitor(Parameter{"ground_flatness_1", self.ground_flatness[0], closed(0, 1), "",
                      "flatness below which high patches of ring 1 are ground"});
    visitor(Parameter{"ground_flatness_2", self.ground_flatness[1], closed(0, 1), "",
                      "flatness below which high patches of ring 2 are ground"});
    visitor(Parameter{"ground_flatness_3", self.ground_flatness[2], closed(0, 1), "",
                      "flatness below which high patches of ring 3 are ground"});
    visitor(Parameter{"ground_flatness_4", self.ground_flatness[3], closed(0, 1), "",
                      "flatness below which high patches of ring 4 are ground"});
  }

  /// Throws ConfigError.
  void validate() const {
    validate_parameters("GroundSegmenter", *this);
    if (!(ground_min_range < ground_max_range)) {
      throw ConfigError(
          "GroundSegmenter.ground_min_range = " + std::to_string(ground_min_range) +
          " must be less than ground_max_range = " + std::to_string(ground_max_range));
    }
  }
};

}  // namespace dynains
