#include "simulation/world.hpp"

#include <cmath>

#include "simulation/scenes/scenes.hpp"

namespace dynains::simulation {

void StaticGeometry::add(const Rigid& T_world_model, const Model& model) {
  for (const Primitive& primitive : model) {
    const auto index = static_cast<std::uint32_t>(primitives_.size());
    primitives_.push_back(transformed(T_world_model, primitive));
    model_of_.push_back(models_);
    const Vec3 c = primitives_.back().centre;
    const double ix = std::floor(static_cast<double>(c.x) / kCell);
    const double iy = std::floor(static_cast<double>(c.y) / kCell);
    const auto found =
        cell_of_.emplace(cell_key(static_cast<int>(ix), static_cast<int>(iy)), cells_.size());
    if (found.second) cells_.push_back({{(ix + 0.5) * kCell, (iy + 0.5) * kCell}, {}});
    cells_[found.first->second].members.push_back(index);
  }
  ++models_;
}

namespace {

World build_scene(const Config& config) {
  static constexpr World (*kScenes[])(const Config&, Random) = {
      urban,    highway, vegetation, crowd,  stop_and_go, canopy, hill,
      car_park, urban,   hall,       forest, garage,      mixed};
  return kScenes[static_cast<std::size_t>(config.scene)](config, Random(mix(config.seed, 77)));
}

}  // namespace

World build_world(const Config& config) {
  if (config.day == 0) return build_scene(config);
  Config layout = config;
  layout.day = 0;
  return on_day(build_scene(layout), build_scene(config), config);
}

}  // namespace dynains::simulation
