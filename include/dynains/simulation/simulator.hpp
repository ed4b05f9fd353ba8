// A labelled world that is measured by ray casting.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "dynains/simulation/config.hpp"

namespace dynains::simulation {

/// True state of an object at the time of a scan.
struct ObjectState {
  std::uint32_t instance;            ///< upper 16 bits of its labels, from 1
  std::uint32_t label;               ///< lower 16 bits of its labels in this scan
  Eigen::Isometry3d T_world_object;  ///< centre of the footprint on the ground, x forward
  double speed;                      ///< m/s
  double length, width, height;      ///< m
};

/// One scan and all that is true about it.
struct SimulatedScan {
  double time = 0.0;        ///< s, 0 for the first scan
  std::vector<float> xyzi;  ///< interleaved, sensor frame; metres and reflectivity in [0, 1]
  std::vector<std::uint32_t> labels;  ///< per point: SemanticKITTI class | instance << 16
  Eigen::Isometry3d T_world_sensor = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d T_world_sensor_noisy = Eigen::Isometry3d::Identity();
  std::vector<ObjectState> objects;  ///< vehicles and people around the sensor, parked included
};

/// Makes the scans of one sequence. The world frame has z up; it is not the first sensor frame.
///
/// All points of a scan are measured at one instant from one pose, as if motion within a scan had
/// been compensated. Beams without a return are absent. The same Config gives the same bits.
class Simulator {
 public:
  /// Builds the place and moves everybody through the whole sequence. Throws ConfigError.
  explicit Simulator(const Config& config);
  ~Simulator();
  Simulator(Simulator&&) noexcept;
  Simulator& operator=(Simulator&&) noexcept;

  const Config& config() const;
  std::size_t size() const;

  /// Scan `i` < size(), in any order. Not const: scratch memory is reused.
  SimulatedScan scan(std::size_t i);

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace dynains::simulation
