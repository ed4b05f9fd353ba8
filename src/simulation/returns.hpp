// Returns of a sensor from the surfaces that its beams meet.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "simulation/beams.hpp"
#include "simulation/config.hpp"

namespace dynains::simulation {

/// Place where a beam meets the ground or an object.
struct Surface {
  float range = 0;   ///< m
  float cosine = 1;  ///< of the angle of incidence
  float loss = 0;    ///< probability of no return, besides that of weak returns
  float reflectivity = 0;
  float roughness = 0;  ///< m, added to the noise of the range
  std::uint32_t label = 0;
};

/// Surfaces in the order of measurement.
using Surfaces = std::vector<std::optional<Surface>>;

/// Effects of the width of beams, of their calibration, and of lost packets.
class Returns {
 public:
  Returns(const Config& config, const SensorModel& model) : config_(config), model_(model) {}

  /// The surface that beam number `i` reports, of beams that are measured over `columns` columns.
  /// `seed` differs from part to part of all scans.
  std::optional<Surface> at(const Surfaces& surfaces, const BeamTable& beams, std::size_t i,
                            BeamTable::Columns columns, std::uint64_t seed) const;

 private:
  bool is_lost(std::size_t column, std::uint64_t seed) const;
  /// The surface beside, if it lies within the width of the beam as well, is seen with it.
  Surface mixed(const Surfaces& surfaces, const BeamTable& beams, std::size_t i,
                std::size_t columns, std::uint64_t random) const;
  float bias_of(int laser) const;

  const Config& config_;
  const SensorModel& model_;
};

}  // namespace dynains::simulation
