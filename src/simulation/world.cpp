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
    const auto key =
        (static_cast<std::uint64_t>(static_cast<std::uint32_t>(static_cast<std::int32_t>(ix)))
         << 32) |
        static_cast<std::uint32_t>(static_cast<std::int32_t>(iy));
    const auto found = cell_of_.emplace(key, cells_.size());
    if (found.second) cells_.push_back({{(ix + 0.5) * kCell, (iy + 0.5) * kCell}, {}});
    cells_[found.first->second].members.push_back(index);
  }
  ++models_;
}

namespace {

World build_scene(const Config& config) {
  switch (config.scene) {
    case Scene::kHighway:
      return highway(config);
    case Scene::kVegetation:
      return vegetation(config);
    case Scene::kCrowd:
      return crowd(config);
    case Scene::kStopAndGo:
      return stop_and_go(config);
    case Scene::kCanopy:
      return canopy(config);
    case Scene::kHill:
      return hill(config);
    case Scene::kCarPark:
      return car_park(config);
    case Scene::kHall:
      return hall(config);
    case Scene::kForest:
      return forest(config);
    case Scene::kGarage:
      return garage(config);
    case Scene::kMixed:
      return mixed(config);
    case Scene::kUrban:
    case Scene::kStatic:
      break;
  }
  return urban(config);
}

}  // namespace

World build_world(const Config& config) {
  if (config.day == 0) return build_scene(config);
  Config layout = config;
  layout.day = 0;
  return on_day(build_scene(layout), build_scene(config), config);
}

}  // namespace dynains::simulation
