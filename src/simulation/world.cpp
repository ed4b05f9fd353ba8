#include "simulation/world.hpp"

#include "simulation/scenes/scenes.hpp"

namespace dynains::simulation {

namespace {

World build_scene(const Config& config) {
  static constexpr World (*kScenes[])(const Config&, Random) = {
      urban, highway, vegetation, crowd,  stop_and_go, canopy, hill,     car_park,
      urban, hall,    forest,     garage, mixed,       room,   corridor, tunnel};
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
