// One place on several days.
#include <algorithm>
#include <limits>
#include <utility>

#include "simulation/materials.hpp"
#include "simulation/random.hpp"
#include "simulation/scenes/layout.hpp"
#include "simulation/simulator.hpp"
#include "simulation/world.hpp"

namespace dynains::simulation {
namespace {

enum class ChangeKind { kContainer, kFence, kTree };

/// Something that stands on the pavement from one day to another.
struct Change {
  ChangeKind kind;
  int first_day;
  int last_day = std::numeric_limits<int>::max();
};

constexpr Change kChanges[] = {
    {ChangeKind::kContainer, 2, 3}, {ChangeKind::kFence, 3},    {ChangeKind::kTree, 1, 1},
    {ChangeKind::kContainer, 3},    {ChangeKind::kFence, 1, 2}, {ChangeKind::kTree, 1, 3},
};

/// Class, size and shape of a change.
Object object_of(ChangeKind kind, Random& random) {
  Object object;
  switch (kind) {
    case ChangeKind::kFence:
      object.label = semantic::kFence;
      object.size = {6.0, 0.1, 1.8};
      object.model = fence_model(6.0, 1.8, false);
      break;
    case ChangeKind::kTree:
      object.label = semantic::kVegetation;
      object.size = {0.4, 0.4, 7.0};
      object.model = tree_model(false, 7.0, 1.8, 2.4, random);
      break;
    case ChangeKind::kContainer:
      object.label = semantic::kOtherObject;
      object.size = {4.0, 1.6, 1.7};
      object.model = Model().block(kMaterials.street_furniture, -2, 2, -0.8, 0.8, 0, 1.7);
      break;
  }
  return object;
}

/// Puts the changes of all days on the pavements beside the way of the sensor, and those of this
/// day into `traffic`. The places depend on the layout and the seed only.
void add_changes(const World& layout, const Config& config, Traffic& traffic) {
  const Street& street = layout.terrain.streets()[0];
  FootprintSet taken = layout.traffic.fixed;
  Random random(mix(config.seed, 4242));
  std::uint32_t instance = kFirstChange;
  const double way = travel(config, 8.5);
  for (const Change& change : kChanges) {
    Random model_random = random.fork(random.bits());
    Object object = object_of(change.kind, model_random);
    object.instance = instance++;
    const Size size = object.size;
    for (int attempt = 0; attempt < 200; ++attempt) {
      const double s = kBefore + random.uniform(0.1, 0.9) * way;
      const int side = random.chance(0.5) ? 1 : -1;
      const Waypoint at =
          street.centre.beside(s, side * (street.half_width + 0.5 * street.pavement));
      const Footprint place{at.position, at.heading, size.length / 2, size.width / 2};
      const Vec2 along = (size.length / 2) * direction(at.heading);
      const bool is_on_street = layout.terrain.distance_to_street(at.position) < 0.3 ||
                                layout.terrain.distance_to_street(at.position + along) < 0.3 ||
                                layout.terrain.distance_to_street(at.position - along) < 0.3;
      if (is_on_street || !taken.is_free(place, 0.3)) continue;
      taken.add(place);
      if (config.day < change.first_day || config.day > change.last_day) break;
      traffic.objects.push_back(std::move(object));
      traffic.fixed.add(place);
      traffic.parked.push_back({static_cast<std::uint32_t>(traffic.objects.size() - 1), at, 0, 0});
      break;
    }
  }
}

}  // namespace

World on_day(World layout, World day, const Config& config) {
  Traffic traffic = std::move(day.traffic);
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
  return {std::move(layout.terrain), std::move(layout.statics), std::move(traffic)};
}

}  // namespace dynains::simulation
