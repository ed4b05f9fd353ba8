// Everything that a scene consists of.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "simulation/config.hpp"
#include "simulation/terrain.hpp"
#include "simulation/traffic.hpp"

namespace dynains::simulation {

/// Primitives that never move. World frame.
class StaticGeometry {
 public:
  void add(const Rigid& T_world_model, const Model& model) {
    for (const Primitive& part : model) {
      primitives_.push_back({transformed(T_world_model, part), models_});
    }
    ++models_;
  }
  /// Calls `visitor(primitive, salt, model)` for the primitives within `radius` of `centre`, and
  /// some beyond; `model` counts the calls of add().
  template <class Visitor>
  void visit_near(Vec2 centre, double radius, Visitor&& visitor) const {
    for (std::size_t i = 0; i < primitives_.size(); ++i) {
      const auto& [primitive, model] = primitives_[i];
      const Vec2 middle{static_cast<double>(primitive.centre.x),
                        static_cast<double>(primitive.centre.y)};
      // No primitive reaches farther than 40 m from its middle.
      if (norm(middle - centre) <= radius + 40) visitor(primitive, std::uint64_t{i}, model);
    }
  }

 private:
  std::vector<std::pair<Primitive, std::uint32_t>> primitives_;  // and the numbers of their models
  std::uint32_t models_ = 0;
};

struct World {
  Terrain terrain;
  StaticGeometry statics;
  Traffic traffic;
};

/// The scene at its start time.
World build_scene(const Config& config);
/// The scene with the changes up to the day of the configuration.
World build_world(const Config& config);

}  // namespace dynains::simulation
