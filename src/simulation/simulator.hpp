// Simulation of labelled scans by ray casting.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "dynains/pose.hpp"
#include "simulation/config.hpp"

namespace dynains::simulation {

/// Least instance id of the changes of a place from day to day.
inline constexpr std::uint32_t kFirstChange = 0xF000;
/// Least instance id of static things, with Config::static_instances.
inline constexpr std::uint32_t kFirstStatic = 0x4000;

/// True state of an object at the time of a scan.
struct ObjectState {
  /// Instance id from 1, the upper 16 bits of its labels; from kFirstChange on for a change of the
  /// place, which has its id on all days
  std::uint32_t instance;
  std::uint32_t label;           ///< SemanticKITTI class, the lower 16 bits in this scan
  Pose T_world_object;           ///< origin: centre of the footprint on the ground; x forward
  double speed;                  ///< m/s
  double length, width, height;  ///< m
};

/// One scan with its ground truth.
struct SimulatedScan {
  /// s, of the first beam; 0 for the first scan of a place without days and of day 1, 86400 for
  /// that of day 2
  double time = 0.0;
  std::vector<float> xyzi;            ///< interleaved; m, sensor frame; reflectivity in [0, 1]
  std::vector<std::uint32_t> labels;  ///< by point: SemanticKITTI class | instance << 16
  std::vector<float> times;           ///< by point: s after `time`; empty without a rolling shutter
  std::vector<std::uint8_t> sensors;  ///< by point: number of its sensor; empty without a rig
  Pose T_world_sensor = Pose::Identity();  ///< of the body, with a rig; so is the next
  Pose T_world_sensor_noisy = Pose::Identity();
  std::vector<ObjectState> objects;  ///< vehicles and people near the sensor, also parked ones
};

/// Generates the scans of one sequence. The world frame has z up and differs from the first sensor
/// frame.
///
/// All points of a scan are measured at one time from one pose, as after motion compensation. With
/// Config::rolling_shutter, points are measured over 1 / rate seconds, in the frame of the sensor
/// at the time of the point. Beams without a return give no point. Equal Configs give bit-identical
/// scans.
class Simulator {
 public:
  /// Generates the scene and the motion of all objects for the whole sequence. Throws ConfigError.
  explicit Simulator(const Config& config);
  ~Simulator();
  Simulator(Simulator&&) noexcept;
  Simulator& operator=(Simulator&&) noexcept;

  const Config& config() const;
  /// Number of scans.
  std::size_t size() const;

  /// Poses T_body_sensor of the sensors of a rig; empty without one.
  std::vector<Pose> mounts() const;

  /// Scan i < size(), in any order. Not const, because scratch memory is reused.
  SimulatedScan scan(std::size_t i);

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace dynains::simulation
