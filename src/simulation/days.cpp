// One place on several days.
#include <algorithm>

#include "simulation/simulator.hpp"
#include "simulation/world.hpp"

namespace dynains::simulation {
namespace {

/// Something that stands on the pavement from one day to another.
struct Change {
  std::uint16_t label;
  Size size;  // m
  int first_day, last_day;
};

constexpr Change kChanges[] = {
    {kClasses.other_object, {4.0, 1.6, 1.7}, 2, 3}, {kClasses.fence, {6.0, 0.1, 1.8}, 3, 9999},
    {kClasses.vegetation, {0.4, 0.4, 7.0}, 1, 1},   {kClasses.other_object, {4, 1.6, 1.7}, 3, 9999},
    {kClasses.fence, {6.0, 0.1, 1.8}, 1, 2},        {kClasses.vegetation, {0.4, 0.4, 7.0}, 1, 3}};

Model model_of(const Change& change, Random& random) {
  const auto& [length, width, height] = change.size;
  if (change.label == kClasses.fence) return fence_model(Fence::kWood, length, height, random);
  if (change.label == kClasses.vegetation) return tree_model(false, height, 1.8, 2.4, random);
  return Model().block(kMaterials.street_furniture, -length / 2, length / 2, -width / 2, width / 2,
                       0, height);
}

/// Puts the changes of all days on the pavements beside the way of the sensor, and those of this
/// day into `traffic`. The places depend on the layout and the seed only.
void add_changes(const World& layout, const Config& config, Traffic& traffic) {
  const Street& street = layout.terrain.streets()[0];
  const Traffic::Driver& ego = layout.traffic.drivers[0];
  FootprintSet taken = layout.traffic.fixed;
  Random random(mix(config.seed, 4242));
  std::uint32_t instance = kFirstChange;
  for (const Change& change : kChanges) {
    Object object{{}, change.size, 0, model_of(change, random), change.label, instance++};
    for (int attempt = 0; attempt < 200; ++attempt) {
      const double s = ego.s + random.uniform(0.1, 0.9) * ego.cruise * config.scans / config.rate;
      const double side = random.chance(0.5) ? 1 : -1;
      const Waypoint at =
          street.centre.beside(s, side * (street.half_width + 0.5 * street.pavement));
      const Footprint place{at.position, at.heading, change.size.length / 2, change.size.width / 2};
      bool is_free = taken.is_free(place, 0.3);
      for (const double along : {-0.5, 0.0, 0.5}) {
        const Vec2 p = at.position + (along * change.size.length) * direction(at.heading);
        is_free = is_free && layout.terrain.distance_to_street(p) >= 0.3;
      }
      if (!is_free) continue;
      taken.add(place);
      if (config.day < change.first_day || config.day > change.last_day) break;
      traffic.objects.push_back(std::move(object));
      traffic.fixed.add(place);
      traffic.parked.push_back({traffic.objects.size() - 1, at, 0, 0});
      break;
    }
  }
}

}  // namespace

World build_world(const Config& config) {
  if (config.day == 0) return build_scene(config);
  Config everyday = config;
  everyday.day = 0;
  World layout = build_scene(everyday);
  Traffic traffic = build_scene(config).traffic;
  traffic.fixed = layout.traffic.fixed;
  for (const ObjectPose& pose : traffic.parked) {
    traffic.fixed.add(traffic.footprint_of(pose.object, pose.at));
  }
  add_changes(layout, config, traffic);
  // Nobody starts inside something of the place.
  const auto is_inside = [&](const Traffic::Walker& walker) {
    return !traffic.fixed.is_free({walker.position, 0, 0.4, 0.4}, 0);
  };
  traffic.walkers.erase(std::remove_if(traffic.walkers.begin(), traffic.walkers.end(), is_inside),
                        traffic.walkers.end());
  layout.traffic = std::move(traffic);
  return layout;
}

}  // namespace dynains::simulation
