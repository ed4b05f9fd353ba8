#include <utility>

#include "simulation/config.hpp"
#include "simulation/random.hpp"

namespace dynains::simulation {
namespace {

template <class Value>
using Choice = std::pair<Value, double>;  // and its weight

constexpr Choice<Scene> kScenes[] = {
    {Scene::kMixed, 0.4},    {Scene::kRoom, 0.02},   {Scene::kCorridor, 0.015},
    {Scene::kTunnel, 0.015}, {Scene::kUrban, 0.06},  {Scene::kStopAndGo, 0.08},
    {Scene::kHill, 0.06},    {Scene::kCarPark, 0.1}, {Scene::kCrowd, 0.08},
    {Scene::kHighway, 0.04}, {Scene::kCanopy, 0.04}, {Scene::kVegetation, 0.03},
    {Scene::kHall, 0.02},    {Scene::kForest, 0.02}, {Scene::kGarage, 0.02}};

constexpr Choice<Sensor> kVehicleSensors[] = {
    {Sensor::kRings, 0.45},   {Sensor::kHdl64, 0.15},  {Sensor::kPandar64, 0.08},
    {Sensor::kOs1_64, 0.05},  {Sensor::kHdl32, 0.05},  {Sensor::kVlp16, 0.05},
    {Sensor::kOs0_128, 0.04}, {Sensor::kRaster, 0.06}, {Sensor::kLivox, 0.07}};

constexpr Choice<Sensor> kCarriedSensors[] = {{Sensor::kMid360, 0.4},
                                              {Sensor::kRings, 0.3},
                                              {Sensor::kVlp16, 0.1},
                                              {Sensor::kOs0_128, 0.1},
                                              {Sensor::kLivox, 0.1}};

bool has_walking_pace(Scene scene) {
  return scene == Scene::kCrowd || scene == Scene::kHall || scene == Scene::kForest ||
         scene == Scene::kRoom || scene == Scene::kCorridor;
}

/// How the sensor is carried, how high, how level, and how fast.
void draw_carrier(Config& config, Random& random) {
  const bool walks = has_walking_pace(config.scene) ||
                     (config.scene == Scene::kMixed && random.chance(0.3)) ||
                     (config.scene == Scene::kCarPark && random.chance(0.3));
  const bool by_hand = random.chance(0.4), on_legs = random.chance(0.5);
  const double height = random.unit(), speed = random.unit();
  const bool tilted = random.chance(walks ? 0.35 : 0.1);
  const double pitch = random.normal(), roll = random.normal();
  const double tilt = tilted ? 12 : 1;  // deg
  config.mounting_pitch = tilt * pitch;
  config.mounting_roll = 0.6 * tilt * roll;
  if (!walks) {
    config.sensor = random.draw(kVehicleSensors);
    config.sensor_height = 1.4 + 1.2 * height;
    if (config.scene == Scene::kHighway) {
      config.ego_speed = 15 + 15 * speed;
    } else if (config.scene != Scene::kCarPark && config.scene != Scene::kGarage) {
      config.ego_speed = 2 + 12 * speed;
    }
    return;
  }
  config.sensor = random.draw(kCarriedSensors);
  config.gait = by_hand ? Gait::kHandHeld : on_legs ? Gait::kLegged : Gait::kVehicle;
  config.sensor_height = by_hand ? 1.1 + 0.8 * height : 0.35 + 0.7 * height;
  config.ego_speed = 0.4 + 1.3 * speed;
}

void draw_disturbances(Config& config, Random& random) {
  const double noise = random.unit(), width = random.unit();
  config.range_noise = 0.005 + 0.03 * noise + (random.chance(0.1) ? 0.05 : 0);
  config.beam_bias = random.uniform(0.01, 0.04);
  config.divergence = 0.04 + 0.3 * width * width;
  config.direction_noise = random.chance(0.5) ? random.uniform(0.005, 0.05) : 0;
  config.dropout = random.uniform(0.5, 2.5);
  config.glass_passes = random.uniform(0, 0.7);
  config.packet_loss = random.chance(0.4) ? 0.03 * random.unit() : 0;
  config.rolling_shutter = random.chance(0.5);
  const double left_over = random.unit();
  if (config.rolling_shutter) config.deskewed = 1 - 0.1 * left_over * left_over;
}

}  // namespace

Config random_world(std::uint64_t seed) {
  Random random(mix(seed, 8100));
  Config config;
  config.seed = seed;
  config.scene = random.draw(kScenes);
  draw_carrier(config, random);
  draw_disturbances(config, random);
  const Choice<double> rates[] = {{10, 0.8}, {20, 0.07}, {5, 0.08}, {2, 0.05}};
  config.rate = random.draw(rates);
  config.traffic = random.uniform(0.4, 1.8);
  config.clutter = random.uniform(0.2, 1.6);
  config.foliage = random.chance(0.5) ? Foliage::kOpen : Foliage::kSolid;
  if (random.chance(0.2)) config.halt = random.uniform(1, 4);
  // Not every recording has the far points, or the ground that the vehicle hides.
  if (random.chance(0.3)) config.max_range = random.uniform(40, 90);
  config.ego_points = random.chance(0.5) && config.sensor_height > 1.5;
  config.static_instances = true;
  return config;
}

}  // namespace dynains::simulation
