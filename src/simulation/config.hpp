// Parameters of the simulation: scene, sensor and disturbances.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "dynains/parameters.hpp"

namespace dynains::simulation {

/// Type of scene. The seed determines the layout and the traffic.
enum class Scene {
  kUrban,    ///< street with crossings; moving, parked and stopping vehicles; pedestrians
  kHighway,  ///< fast traffic in both directions, guard rails, trucks, a vehicle ahead at ego speed
  kVegetation,  ///< dense trees and porous bushes, few movers
  kCrowd,       ///< pedestrian zone: groups, walkers along walls, standing people that start
  kStopAndGo,   ///< queues ahead, beside and behind the ego vehicle, which stops as well
  kCanopy,      ///< movers below bridges and tree canopies
  kHill,        ///< slopes of up to 10 %, curved ground
  kCarPark,     ///< rows of parked cars, cars leaving and arriving, pedestrians between them
  kStatic,      ///< urban street with parked cars and without moving objects
  kHall,        ///< indoor hall: walls, ceiling, columns, stands, a glass front, people
  kForest,      ///< track through a wood, walkers and cyclists
  kGarage,      ///< one storey of a multi-storey car park: low ceiling, columns, walls
  kMixed,       ///< a street whose every part is drawn from the seed
  kRoom,        ///< one room of 2.2 to 15 m, furniture along its walls, a few people
  kCorridor,    ///< smooth walls at 0.8 to 1.6 m, corners, doors on most of them, a few people
  kTunnel,      ///< smooth walls and ceiling around a road with traffic both ways
};
constexpr std::array<const char*, 16> value_names(Scene) {
  return {"urban", "highway",  "vegetation", "crowd", "stop-and-go", "canopy",
          "hill",  "car-park", "static",     "hall",  "forest",      "garage",
          "mixed", "room",     "corridor",   "tunnel"};
}

/// Beam pattern with a typical mounting height and range.
enum class Sensor {
  kHdl64,     ///< 64 beams in two blocks, +2 to -24.3 deg, 2083 columns
  kVlp16,     ///< 16 beams, +-15 deg, 1800 columns
  kHdl32,     ///< 32 beams, +10.7 to -30.7 deg, 2083 columns
  kOs1_64,    ///< 64 beams, +-22.5 deg, 1024 columns
  kOs0_128,   ///< 128 beams, +-45 deg, 1024 columns
  kPandar64,  ///< 64 beams, dense around the horizon, 1800 columns; forward is -y
  kLivox,     ///< non-repetitive rosette, 70 deg cone forward, 30,000 beams a scan
  kMid360,    ///< non-repetitive, all around from -7 to 52 deg, 20,000 beams a scan
  kRaster,    ///< solid state: 126 rows of 630 beams, 120 by 25 deg forward
  kRings,     ///< 16 to 128 beams around, all numbers drawn from the seed
};
constexpr std::array<const char*, 10> value_names(Sensor) {
  return {"hdl64",    "vlp16", "hdl32",   "os1-64", "os0-128",
          "pandar64", "livox", "mid-360", "raster", "rings"};
}

/// Sensors of one type whose points are one cloud, in the frame of the body on the ground. Each has
/// its own clock. simulator.hpp lists their poses.
enum class Rig {
  kNone,       ///< one sensor; points in its own frame
  kRoofTwo,    ///< in front and behind on a roof
  kRoofThree,  ///< one on top, one on each side
  kCorners,    ///< at the front corners of a vehicle
  kRobot,      ///< in front and behind on a robot, tilted
};
constexpr std::array<const char*, 5> value_names(Rig) {
  return {"none", "roof-two", "roof-three", "corners", "robot"};
}

/// Rule for the moving labels of an object.
enum class Labelling {
  /// All points of an object that, within the sensor's range, exceeds 0.5 m/s or is 0.5 m from its
  /// first position at any time (SemanticKITTI).
  kEver,
  kInstant,  ///< the points in scans at which the object is faster than 0.5 m/s
};
constexpr std::array<const char*, 2> value_names(Labelling) { return {"ever", "instant"}; }

/// How the sensor is carried.
enum class Gait {
  kVehicle,   ///< on a roof, on springs
  kHandHeld,  ///< by a walking person, who looks around with up to 40 deg/s
  kLegged,    ///< on a trotting robot
};
constexpr std::array<const char*, 3> value_names(Gait) {
  return {"vehicle", "hand-held", "legged"};
}

/// Shape of trees, bushes and hedges.
enum class Foliage {
  kSolid,  ///< crowns and hedges without large gaps
  kOpen,   ///< branches with separate clumps of leaves or bare twigs, hedges with gaps
};
constexpr std::array<const char*, 2> value_names(Foliage) { return {"solid", "open"}; }

/// Parameters of one sequence. visit() describes them and gives their units and bounds.
struct Config {
  Scene scene = Scene::kUrban;
  Sensor sensor = Sensor::kHdl64;
  Labelling labelling = Labelling::kEver;
  Rig rig = Rig::kNone;
  Gait gait = Gait::kVehicle;
  Foliage foliage = Foliage::kSolid;
  int scans = 150;
  std::uint64_t seed = 1;
  int day = 0;
  double rate = 10, ego_speed = -1, halt = 0, traffic = 1, clutter = 0;
  double sensor_height = 0, max_range = 0, mounting_pitch = 0, mounting_roll = 0;
  double range_noise = 0.02, direction_noise = 0, beam_bias = 0, divergence = 0;
  double dropout = 1, glass_passes = 0, packet_loss = 0;
  double pose_noise_translation = 0, pose_noise_rotation = 0, pose_drift = 0;
  bool ego_points = false, static_instances = false;
  bool rolling_shutter = false;
  double deskewed = 0;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& visitor) {
    const auto add = [&visitor](const char* name, auto& value, Bounds bounds, const char* unit,
                                const char* description) {
      visitor(Parameter{name, value, bounds, unit, description});
    };
    const Bounds any, share = closed(0, 1);
    add("scene", self.scene, any, "", "place and traffic");
    add("sensor", self.sensor, any, "", "beams, usual height and range");
    add("labelling", self.labelling, any, "",
        "whether objects are labelled moving in all scans if they ever move, or at the instant");
    add("rig", self.rig, any, "", "several sensors in one cloud, in the frame of the body");
    add("gait", self.gait, any, "", "how the sensor is carried");
    add("foliage", self.foliage, any, "", "solid or open crowns, bushes and hedges");
    add("scans", self.scans, closed(1, 1000000), "scans", "length of the sequence");
    add("seed", self.seed, any, "", "seed of the layout and the traffic of the scene");
    add("day", self.day, closed(0, 1000), "",
        "day of a place of scene urban or static: other movers, other parked vehicles, a few real "
        "changes; 0: a place without changes");
    add("rate", self.rate, closed(1, 50), "1/s", "scans per second");
    add("ego_speed", self.ego_speed, closed(-1, 50), "m/s", "negative: usual for the scene");
    add("halt", self.halt, closed(0, 3600), "s", "time of braking and standing, in the middle");
    add("traffic", self.traffic, closed(0, 4), "", "ratio to the usual number of moving objects");
    add("clutter", self.clutter, closed(0, 4), "", "ratio to the usual number of thin things");
    add("sensor_height", self.sensor_height, closed(0, 10), "m", "0: usual for the sensor");
    add("max_range", self.max_range, closed(0, 160), "m", "0: usual for the sensor");
    add("mounting_pitch", self.mounting_pitch, closed(-45, 45), "deg", "positive looks down");
    add("mounting_roll", self.mounting_roll, closed(-45, 45), "deg", "tilt to the side");
    add("range_noise", self.range_noise, share, "m", "standard deviation of measured ranges");
    add("direction_noise", self.direction_noise, closed(0, 5), "deg",
        "standard deviation of the direction of a beam");
    add("beam_bias", self.beam_bias, share, "m",
        "standard deviation of the constant range error of each beam");
    add("divergence", self.divergence, closed(0, 2), "deg",
        "full width of a beam: mixed returns at edges");
    add("dropout", self.dropout, closed(0, 10), "",
        "scale of lost returns (dark, grazing, far); 0 loses none");
    add("glass_passes", self.glass_passes, share, "",
        "share of the beams that pass through the panes of vehicles");
    add("packet_loss", self.packet_loss, share, "", "share of lost packets, each of some columns");
    add("pose_noise_translation", self.pose_noise_translation, closed(0, 10), "m",
        "standard deviation of the written poses, per axis and scan");
    add("pose_noise_rotation", self.pose_noise_rotation, closed(0, 45), "deg",
        "standard deviation of the written poses, per axis and scan");
    add("pose_drift", self.pose_drift, closed(0, 10), "m",
        "standard deviation of the drift of the written poses after 100 m, per axis");
    add("ego_points", self.ego_points, any, "", "whether scans contain the roof below the sensor");
    add("static_instances", self.static_instances, any, "",
        "whether buildings, poles, fences and plants have instance ids, too");
    add("rolling_shutter", self.rolling_shutter, any, "",
        "whether sensor and objects move while a scan is measured; needs deskewed or a --format "
        "with times of points");
    add("deskewed", self.deskewed, share, "",
        "share of the sensor's motion within a scan that is corrected; 0: points stay in the "
        "frames of their times");
  }

  /// Whether the written poses differ from the true ones.
  bool has_pose_errors() const {
    return pose_noise_translation > 0 || pose_noise_rotation > 0 || pose_drift > 0;
  }

  /// Throws ConfigError for a field out of bounds.
  void validate() const {
    validate_parameters("simulation", *this);
    if (day > 0 && scene != Scene::kUrban && scene != Scene::kStatic) {
      throw ConfigError("simulation.day = " + std::to_string(day) +
                        " must be 0 for this scene: only urban and static have days");
    }
    if (rig != Rig::kNone && rolling_shutter) {
      throw ConfigError("simulation.rolling_shutter must be false with a rig");
    }
  }
};

/// A configuration whose scene, sensor, mounting, carrier and disturbances are drawn from `seed`.
/// Static things have instance ids. Poses are exact; length and labelling are the defaults.
/// Recordings of real sensors are meant to lie inside the distribution; random_world.cpp lists the
/// ranges.
Config random_world(std::uint64_t seed);

}  // namespace dynains::simulation
