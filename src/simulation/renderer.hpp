// Nearest surface along every beam of a scan.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "simulation/beams.hpp"
#include "simulation/primitive.hpp"

namespace dynains::simulation {

/// All beams start in one point, so the scan is drawn like a picture: every primitive meets only
/// the beams within its solid angle and keeps those that it shortens.
class Renderer {
 public:
  struct Drawn {
    Primitive primitive;      ///< sensor frame
    std::uint32_t label = 0;  ///< as of a point; without a class: that of the material
    std::uint64_t salt = 0;   ///< lasting identity, for gaps in leaves and rooms behind windows
  };

  struct Hit {
    float range = 0;
    const Drawn* drawn = nullptr;  ///< valid until start(); null: nothing
    float extra_loss = 0;          ///< chance of no return at all: glass
  };

  /// Forgets the last scan; every beam can see as far as `max_range`. A share of the beams passes
  /// through the panes of vehicles.
  void start(const BeamTable& beams, float max_range, std::uint64_t seed, float glass_passes = 0);
  /// Takes note of a primitive, unless it is out of reach.
  void add(const Primitive& primitive, std::uint32_t label, std::uint64_t salt);
  /// Finds the nearest primitive of every beam; random numbers depend on seed, beam and salt only.
  void draw();

  const std::vector<Hit>& hits() const { return hits_; }

 private:
  struct Bounds {
    double azimuth = 0, half_azimuth = 0, low = 0, high = 0;
  };
  static Bounds bounds_of(const Primitive& primitive);
  /// `near`: m, no part of it lies nearer.
  void draw_slots(const Drawn& drawn, float near, std::size_t begin, std::size_t end);

  const BeamTable* beams_ = nullptr;
  float max_range_ = 0;
  std::uint64_t seed_ = 0;
  float glass_passes_ = 0;
  std::vector<Drawn> drawn_;
  std::vector<std::pair<float, std::uint32_t>> order_;
  std::vector<Hit> hits_;
};

}  // namespace dynains::simulation
