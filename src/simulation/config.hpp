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
  kCanopy,      ///< movers below bridges, roofs and tree canopies
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
/// its own clock. simulator.cpp lists their poses.
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

/// Parameters of one sequence. visit() gives their bounds.
struct Config {
  Scene scene = Scene::kUrban;
  Sensor sensor = Sensor::kHdl64;
  Labelling labelling = Labelling::kEver;
  Rig rig = Rig::kNone;

  int scans = 150;
  std::uint64_t seed = 1;
  /// 0: a place without days. From 1 on: the same static place with the movers and parked vehicles
  /// of this day, and a few changes from day to day. Scenes kUrban and kStatic only.
  int day = 0;
  double rate = 10.0;                   ///< scans per second
  double ego_speed = -1.0;              ///< m/s; negative: default of the scene
  double traffic = 1.0;                 ///< ratio to the default number of moving objects
  double sensor_height = 0.0;           ///< m above ground; 0: default of the sensor
  double max_range = 0.0;               ///< m; 0: default of the sensor
  double mounting_pitch = 0.0;          ///< deg, positive is nose down
  double mounting_roll = 0.0;           ///< deg
  double range_noise = 0.02;            ///< m, standard deviation
  double dropout = 1.0;                 ///< factor on the loss of returns; 0: no loss
  double pose_noise_translation = 0.0;  ///< m, standard deviation per axis and scan
  double pose_noise_rotation = 0.0;     ///< deg, standard deviation per axis and scan
  Gait gait = Gait::kVehicle;
  Foliage foliage = Foliage::kSolid;
  double halt = 0.0;             ///< s of braking and standing, in the middle
  double direction_noise = 0.0;  ///< deg, standard deviation of the direction of a beam
  bool ego_points = false;       ///< whether scans contain the roof below the sensor
  bool rolling_shutter = false;  ///< whether the beams of a scan are spread over 1 / rate seconds
  double deskewed = 0.0;         ///< share of the motion within a scan that is corrected
  double beam_bias = 0.0;        ///< m, standard deviation of the constant error of each beam
  double divergence = 0.0;       ///< deg, full width of a beam
  double glass_passes = 0.0;     ///< share of the beams that pass through panes of vehicles
  double packet_loss = 0.0;      ///< share of lost packets, each of some columns
  double pose_drift = 0.0;  ///< m after 100 m, standard deviation per axis of the written poses
  double clutter = 0.0;     ///< ratio of thin things and furniture to the usual number
  bool static_instances = false;  ///< whether static things have instance ids, too

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& visitor) {
    visitor(Parameter{"scene", self.scene, Bounds{}, "", "place and traffic"});
    visitor(Parameter{"sensor", self.sensor, Bounds{}, "", "beams, usual height and range"});
    visitor(Parameter{"labelling", self.labelling, Bounds{}, "",
                      "whether objects are labelled moving in all scans if they ever move, or at "
                      "the instant"});
    visitor(Parameter{"rig", self.rig, Bounds{}, "",
                      "several sensors in one cloud, in the frame of the body"});
    visitor(Parameter{"scans", self.scans, closed(1, 1000000), "scans", "length of the sequence"});
    visitor(Parameter{"seed", self.seed, Bounds{}, "",
                      "seed of the layout and the traffic of the scene"});
    visitor(Parameter{"day", self.day, closed(0, 1000), "",
                      "day of a place of scene urban or static: other movers, other parked "
                      "vehicles, a few real changes; 0: a place without changes"});
    visitor(Parameter{"rate", self.rate, closed(1, 50), "1/s", "scans per second"});
    visitor(Parameter{"ego_speed", self.ego_speed, closed(-1, 50), "m/s",
                      "cruising speed; negative: usual for the scene"});
    visitor(Parameter{"traffic", self.traffic, closed(0, 4), "",
                      "ratio of the number of moving objects to the default of the scene"});
    visitor(Parameter{"sensor_height", self.sensor_height, closed(0, 10), "m",
                      "height of the sensor over ground; 0: usual for the sensor"});
    visitor(Parameter{"max_range", self.max_range, closed(0, 160), "m",
                      "longest measured range; 0: usual for the sensor"});
    visitor(Parameter{"mounting_pitch", self.mounting_pitch, closed(-45, 45), "deg",
                      "tilt of the sensor, positive looks down"});
    visitor(Parameter{"mounting_roll", self.mounting_roll, closed(-45, 45), "deg",
                      "tilt of the sensor to the side"});
    visitor(Parameter{"range_noise", self.range_noise, closed(0, 1), "m",
                      "standard deviation of measured ranges"});
    visitor(Parameter{"dropout", self.dropout, closed(0, 10), "",
                      "scale of lost returns (dark, grazing, far); 0 loses none"});
    visitor(Parameter{"pose_noise_translation", self.pose_noise_translation, closed(0, 10), "m",
                      "standard deviation of the written poses, per axis"});
    visitor(Parameter{"pose_noise_rotation", self.pose_noise_rotation, closed(0, 45), "deg",
                      "standard deviation of the written poses, per axis"});
    visitor(Parameter{"gait", self.gait, Bounds{}, "",
                      "how the sensor is carried: on a vehicle, by a walking person, or on a robot "
                      "with legs"});
    visitor(Parameter{"foliage", self.foliage, Bounds{}, "",
                      "solid or open crowns, bushes and hedges"});
    visitor(
        Parameter{"halt", self.halt, closed(0, 3600), "s",
                  "time in the middle of the sequence in which the ego vehicle brakes and stands"});
    visitor(Parameter{"direction_noise", self.direction_noise, closed(0, 5), "deg",
                      "standard deviation of the direction of a beam: its width"});
    visitor(Parameter{"ego_points", self.ego_points, Bounds{}, "",
                      "whether scans contain points on the roof of the ego vehicle"});
    visitor(Parameter{"rolling_shutter", self.rolling_shutter, Bounds{}, "",
                      "whether sensor and objects move while a scan is measured; needs deskewed or "
                      "a --format with times of points"});
    visitor(
        Parameter{"deskewed", self.deskewed, closed(0, 1), "",
                  "share of the sensor's motion within a scan that is corrected; 0: points stay "
                  "in the frames of their times"});
    visitor(Parameter{"beam_bias", self.beam_bias, closed(0, 1), "m",
                      "standard deviation of the constant range error of each beam"});
    visitor(Parameter{"divergence", self.divergence, closed(0, 2), "deg",
                      "full width of a beam: mixed returns at edges"});
    visitor(Parameter{"glass_passes", self.glass_passes, closed(0, 1), "",
                      "share of the beams that pass through the panes of vehicles"});
    visitor(Parameter{"packet_loss", self.packet_loss, closed(0, 1), "",
                      "share of the packets of some columns that are lost"});
    visitor(
        Parameter{"pose_drift", self.pose_drift, closed(0, 10), "m",
                  "standard deviation of the drift of the written poses after 100 m, per axis"});
    visitor(Parameter{"clutter", self.clutter, closed(0, 4), "",
                      "ratio of thin things (wires, railings, signs, bicycles, trolleys) to their "
                      "usual number in a street"});
    visitor(Parameter{"static_instances", self.static_instances, Bounds{}, "",
                      "whether buildings, poles, fences and plants have instance ids, too"});
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
