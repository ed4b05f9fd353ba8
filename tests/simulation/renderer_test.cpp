#include "simulation/renderer.hpp"

#include "simulation/primitive.hpp"
#include "simulation/random.hpp"
#include "support/catch.hpp"

namespace dynains::simulation {

namespace {

const Material kSurface{50, 0.3F, 0, 0, 0, 0, 0};

/// Tests every beam against every primitive, without any bounds.
float nearest_by_force(const std::vector<Primitive>& primitives, Vec3 direction, float max_range) {
  float best = max_range;
  for (const Primitive& primitive : primitives) {
    const Interval interval = intersect(primitive, {}, direction);
    if (!interval.empty() && interval.enter > 0) best = std::min(best, interval.enter);
  }
  return best;
}

}  // namespace

TEST_CASE("rendering by solid angle gives the result of testing all pairs") {
  for (const Sensor sensor : {Sensor::kHdl64, Sensor::kOs0_128, Sensor::kLivox}) {
    BeamTable beams;
    beams.fill(sensor_model(sensor), 3, 7);
    std::vector<Primitive> primitives;
    Random random(17);
    for (int i = 0; i < 60; ++i) {
      const auto shape = static_cast<Shape>(random.index(3));
      const double azimuth = random.uniform(-3.2, 3.2), far = random.uniform(3, 40);
      const double turn = random.uniform(0, 6), tilt = random.uniform(-1, 1);
      const auto up = static_cast<float>(random.uniform(-3, 8));
      const auto a = static_cast<float>(random.uniform(0.05, 3));
      const auto b = static_cast<float>(random.uniform(0.05, 3));
      const auto c = static_cast<float>(random.uniform(0.05, 3));
      primitives.push_back(make_primitive(shape, kSurface,
                                          {static_cast<float>(far * std::cos(azimuth)),
                                           static_cast<float>(far * std::sin(azimuth)), up},
                                          {a, b, c}, rotation_z(turn) * rotation_x(tilt)));
    }
    // One primitive straight above, and one across the seam at +-pi.
    primitives.push_back(make_primitive(Shape::kBox, kSurface, {0, 0, 6}, {8, 8, 0.2F}));
    primitives.push_back(make_primitive(Shape::kBox, kSurface, {-9, 0, 0}, {0.3F, 4, 2}));
    Renderer renderer;
    renderer.start(beams, 50, 1);
    for (const Primitive& primitive : primitives) renderer.add(primitive, 0, 0);
    renderer.draw();
    std::size_t hits = 0, differ = 0;
    for (std::size_t slot = 0; slot < beams.size(); slot += 7) {
      const float expected = nearest_by_force(primitives, beams.direction(slot), 50);
      const float found = renderer.hits()[slot].range;
      hits += found < 50;
      differ += std::abs(found - expected) > 1e-3F;
    }
    CHECK(hits > 300);
    CHECK(differ == 0);
  }
}

TEST_CASE("porous shapes let the expected share of beams through") {
  // A ball of radius 2 and density 0.5 / m, met in the middle over 4 m: exp(-2) = 13.5 % pass.
  const Material leaves{70, 0.3F, 0, 0.5F, 0, 0, 0};
  BeamTable beams;
  beams.fill(sensor_model(Sensor::kOs0_128), 1, 0);
  std::size_t met = 0, passed = 0;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    Renderer renderer;
    renderer.start(beams, 100, seed);
    renderer.add(make_primitive(Shape::kEllipsoid, leaves, {10, 0, 0}, {2, 2, 2}), 1, 5);
    renderer.draw();
    for (std::size_t slot = 0; slot < beams.size(); ++slot) {
      if (beams.direction(slot).x < 0.9997F) continue;  // within 1.4 deg of the middle
      ++met;
      passed += renderer.hits()[slot].drawn == nullptr;
    }
  }
  REQUIRE(met >= 1000);
  CHECK(static_cast<double>(passed) / static_cast<double>(met) ==
        Approx(std::exp(-2.0)).margin(0.02));
}

TEST_CASE("a share of the beams passes through panes of vehicles, none through other things") {
  BeamTable beams;
  beams.fill(sensor_model(Sensor::kOs0_128), 1, 0);
  const auto met = [&beams](const Material& material, float passes) {
    Renderer renderer;
    renderer.start(beams, 100, 1, passes);
    renderer.add(make_primitive(Shape::kBox, material, {10, 0, 0}, {0.5F, 5, 5}), 1, 5);
    renderer.draw();
    return std::count_if(renderer.hits().begin(), renderer.hits().end(),
                         [](const auto& hit) { return hit.drawn != nullptr; });
  };
  const auto all = static_cast<double>(met(kMaterials.glass, 0));
  REQUIRE(all > 5000);
  CHECK(static_cast<double>(met(kMaterials.glass, 0.4F)) / all == Approx(0.6).margin(0.03));
  CHECK(met(kMaterials.glass, 1) == 0);
  CHECK(static_cast<double>(met(kMaterials.bright_paint, 1)) == all);
}

TEST_CASE("beam patterns have the right size and never repeat") {
  for (const Sensor sensor :
       {Sensor::kHdl64, Sensor::kVlp16, Sensor::kHdl32, Sensor::kOs1_64, Sensor::kOs0_128,
        Sensor::kPandar64, Sensor::kLivox, Sensor::kMid360, Sensor::kRaster, Sensor::kRings}) {
    const SensorModel model = sensor_model(sensor);
    BeamTable first, second;
    first.fill(model, 1, 0);
    second.fill(model, 1, 1);
    const std::size_t rings = model.elevations.empty() ? 1 : model.elevations.size();
    CHECK(first.size() == rings * static_cast<std::size_t>(model.columns));
    std::size_t same = 0;
    for (std::size_t i = 0; i < first.size(); ++i) {
      const Vec3 a = first.direction(first.measured_order()[i]);
      const Vec3 b = second.direction(second.measured_order()[i]);
      CHECK_FALSE(std::abs(norm(a) - 1) > 1e-5F);
      same += norm(a - b) < 1e-6F;
    }
    CHECK(same < first.size() / 100);
  }
  CHECK(sensor_model(Sensor::kPandar64).elevations.size() == 64);
}

}  // namespace dynains::simulation
