// Everything that a scene consists of.
#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "dynains/simulation/config.hpp"
#include "simulation/terrain.hpp"
#include "simulation/traffic.hpp"

namespace dynains::simulation {

/// Primitives that never move, found by place. World frame.
class StaticGeometry {
 public:
  void add(const Rigid& T_world_model, const Model& model);
  /// Calls `visitor(primitive, salt, model)` for the cells within `radius` of `centre`; `model`
  /// counts the calls of add().
  template <class Visitor>
  void visit_near(Vec2 centre, double radius, Visitor&& visitor) const {
    for (const Cell& cell : cells_) {
      const Vec2 d = cell.centre - centre;
      if (norm(d) > radius + kCell) continue;
      for (const std::uint32_t i : cell.members)
        visitor(primitives_[i], std::uint64_t{i}, model_of_[i]);
    }
  }

 private:
  static constexpr double kCell = 40.0;
  struct Cell {
    Vec2 centre;
    std::vector<std::uint32_t> members;
  };
  std::vector<Primitive> primitives_;
  std::vector<std::uint32_t> model_of_;
  std::uint32_t models_ = 0;
  std::vector<Cell> cells_;
  std::unordered_map<std::uint64_t, std::size_t> cell_of_;
};

struct World {
  Terrain terrain;
  StaticGeometry statics;
  Traffic traffic;
};

/// Builds the scene at its start time.
World build_world(const Config& config);

/// The place of `layout` with the traffic and the parked vehicles of `day`, and the changes of the
/// day. Both are of one seed and scene.
World on_day(World layout, World day, const Config& config);

}  // namespace dynains::simulation
