#include "simulation/ground_plan.hpp"
#include "simulation/primitive.hpp"
#include "simulation/terrain.hpp"
#include "support/catch.hpp"

namespace dynains::simulation {

namespace {

const Material kSolid{50, 0.3F, 0, 0, 0, 0, 0};

void require_interval(const Interval& interval, double enter, double leave) {
  REQUIRE(!interval.empty());
  CHECK(static_cast<double>(interval.enter) == Approx(enter).epsilon(1e-5));
  CHECK(static_cast<double>(interval.leave) == Approx(leave).epsilon(1e-5));
}

}  // namespace

TEST_CASE("a ray meets a box at its faces") {
  // Half extents 2 x 1 x 0.5 around (10, 0, 0): the faces across x lie at 8 and 12.
  const Primitive box = make_primitive(Shape::kBox, kSolid, {10, 0, 0}, {2, 1, 0.5F});
  require_interval(intersect(box, {0, 0, 0}, {1, 0, 0}), 8, 12);
  // Just inside and just outside of the side face y = 1.
  require_interval(intersect(box, {0, 0.99F, 0}, {1, 0, 0}), 8, 12);
  CHECK(intersect(box, {0, 1.01F, 0}, {1, 0, 0}).empty());
  // In the opposite direction, the interval is behind the origin.
  CHECK(intersect(box, {0, 0, 0}, {-1, 0, 0}).leave < 0);
}

TEST_CASE("a turned box is met at its edge") {
  // A square of half extent 1 turned by 45 degrees shows its edge at distance sqrt(2).
  const Primitive box =
      make_primitive(Shape::kBox, kSolid, {5, 0, 0}, {1, 1, 1}, rotation_z(kPi / 4));
  require_interval(intersect(box, {0, 0, 0}, {1, 0, 0}), 5 - std::sqrt(2.0), 5 + std::sqrt(2.0));
}

TEST_CASE("a tapered box leans inwards") {
  // Half extent 2 at the bottom (z = 0) and 1 at the top (z = 2): 1.5 in the middle.
  const Primitive box = make_primitive(Shape::kBox, kSolid, {0, 0, 1}, {2, 2, 1}, {}, 1, 1);
  require_interval(intersect(box, {-10, 0, 1}, {1, 0, 0}), 8.5, 11.5);
  require_interval(intersect(box, {-10, 0, 0.0001F}, {1, 0, 0}), 8.00005, 11.99995);
  require_interval(intersect(box, {-10, 0, 1.9999F}, {1, 0, 0}), 8.99995, 11.00005);
}

TEST_CASE("a ray meets a cylinder at its mantle and at its lid") {
  const Primitive post = make_primitive(Shape::kCylinder, kSolid, {0, 0, 1}, {0.5F, 0.5F, 1});
  require_interval(intersect(post, {-3, 0, 1}, {1, 0, 0}), 2.5, 3.5);
  // Off the axis by 0.3 the chord is half as long as 2 sqrt(0.25 - 0.09) = 0.8.
  require_interval(intersect(post, {-3, 0.3F, 1}, {1, 0, 0}), 2.6, 3.4);
  require_interval(intersect(post, {0.1F, 0, 5}, {0, 0, -1}), 3, 5);
  CHECK(intersect(post, {-3, 0, 2.01F}, {1, 0, 0}).empty());
}

TEST_CASE("a ray meets an ellipsoid") {
  // Half axes 1, 2, 3.
  const Primitive ball = make_primitive(Shape::kEllipsoid, kSolid, {0, 0, 0}, {1, 2, 3});
  require_interval(intersect(ball, {-4, 0, 0}, {1, 0, 0}), 3, 5);
  require_interval(intersect(ball, {0, -4, 0}, {0, 1, 0}), 2, 6);
  require_interval(intersect(ball, {0, 0, -4}, {0, 0, 1}), 1, 7);
  // At y = 1 the section has half axis sqrt(1 - 1/4) along x.
  require_interval(intersect(ball, {-4, 1, 0}, {1, 0, 0}), 4 - std::sqrt(0.75),
                   4 + std::sqrt(0.75));
  CHECK(intersect(ball, {-4, 2.01F, 0}, {1, 0, 0}).empty());
}

TEST_CASE("a moved primitive gives the intersection of a ray that is moved back") {
  const Primitive ball = make_primitive(Shape::kEllipsoid, kSolid, {0, 0, 0}, {1, 2, 3});
  // After a quarter turn the half axis of 2 points along -x.
  const Primitive moved = transformed({rotation_z(kPi / 2), {10, 0, 0}}, ball);
  require_interval(intersect(moved, {0, 0, 0}, {1, 0, 0}), 8, 12);
}

TEST_CASE("normals point outwards") {
  const Primitive box = make_primitive(Shape::kBox, kSolid, {10, 0, 0}, {2, 1, 0.5F});
  CHECK(surface_normal(box, {8, 0.2F, 0.1F}).x == Approx(-1));
  CHECK(surface_normal(box, {10, 1, 0}).y == Approx(1));
  const Primitive post = make_primitive(Shape::kCylinder, kSolid, {0, 0, 0}, {1, 1, 1});
  CHECK(surface_normal(post, {0, -1, 0}).y == Approx(-1));
  CHECK(surface_normal(post, {0.1F, 0, 1}).z == Approx(1));
}

TEST_CASE("footprints overlap exactly when no axis separates them") {
  const Footprint a{{0, 0}, 0, 2, 1};
  CHECK(overlap(a, {{3.9, 0}, 0, 2, 1}));
  CHECK_FALSE(overlap(a, {{4.1, 0}, 0, 2, 1}));
  // A square of half extent 1, turned by 45 degrees, reaches sqrt(2) = 1.414 along x.
  CHECK(overlap(a, {{3.40, 0}, kPi / 4, 1, 1}));
  CHECK_FALSE(overlap(a, {{3.43, 0}, kPi / 4, 1, 1}));
  CHECK(distance(a, {5, 5}) == Approx(5.0));  // 3 along x, 4 along y
  CHECK(distance(a, {1, 0.5}) == 0.0);
  FootprintSet set;
  set.add(a);
  CHECK_FALSE(set.is_free({{3.9, 0}, 0, 2, 1}, 0));
  CHECK(set.is_free({{4.1, 0}, 0, 2, 1}, 0));
  CHECK_FALSE(set.is_free({{4.1, 0}, 0, 2, 1}, 0.2));
}

TEST_CASE("a route has arc length, headings and parallels") {
  const Route route({{0, 0}, {10, 0}, {20, 0}});
  CHECK(route.length() == Approx(20));
  CHECK(route.at(7.5).position.x == Approx(7.5));
  CHECK(route.at(7.5).heading == Approx(0).margin(1e-9));
  CHECK(route.beside(5, 2).position.y == Approx(2));
  CHECK(route.at(-1).position.x == Approx(0));
  CHECK(route.at(30).position.x == Approx(20));
  const Route back = route.shifted(20, 0, [](double) { return 3.0; });
  CHECK(back.at(0).position.x == Approx(20));
  CHECK(back.at(0).position.y == Approx(3));
  CHECK(std::abs(back.at(5).heading) == Approx(kPi));
}

TEST_CASE("rays end where they cross the ground") {
  TerrainConfig config;
  config.hill_slope = 0.05;
  Terrain terrain(config, {{Route({{-100, 0}, {0, 0}, {100, 0}}), 4, 2}}, Random(5));
  terrain.prepare({0, 0}, 100);
  const Vec3 eye{0, 0, static_cast<float>(terrain.height({0, 0})) + 2};
  int hits = 0;
  for (int i = 0; i < 200; ++i) {
    const double azimuth = 0.1 * i, elevation = -0.02 - 0.002 * i;
    const Vec3 ray{static_cast<float>(std::cos(elevation) * std::cos(azimuth)),
                   static_cast<float>(std::cos(elevation) * std::sin(azimuth)),
                   static_cast<float>(std::sin(elevation))};
    const float t = terrain.cast(eye, ray, 100);
    // Reference: the first of many small steps that is below the ground.
    float expected = -1;
    for (float s = 0; s < 100; s += 0.01F) {
      const Vec3 p = eye + s * ray;
      if (static_cast<double>(p.z) <
          terrain.height({static_cast<double>(p.x), static_cast<double>(p.y)})) {
        expected = s;
        break;
      }
    }
    CHECK((t > 0) == (expected > 0));
    if (t > 0 && expected > 0) CHECK(std::abs(t - expected) < 0.1F);
    hits += t > 0;
  }
  CHECK(hits > 100);
  // A point above is not hit, and the search ends.
  CHECK(terrain.cast(eye, {0, 0, 1}, 100) < 0);
  CHECK(terrain.cast(eye, {0, 0, -1}, 1.9F) < 0);
  CHECK(terrain.cast(eye, {0, 0, -1}, 2.1F) == Approx(2).epsilon(1e-3));
}

TEST_CASE("streets, pavements and open ground have different classes") {
  Terrain terrain({}, {{Route({{-100, 0}, {0, 0}, {100, 0}}), 4, 2}}, Random(5));
  terrain.prepare({0, 0}, 10);
  CHECK(terrain.label_near(0, 3.5F) == 40);
  CHECK(terrain.label_near(0, 4.6F) == 48);
  CHECK(terrain.label_near(0, -7) == 72);
  CHECK(terrain.distance_to_street({3, 6}) == Approx(2).epsilon(1e-6));
  // The pavement is higher than the edge of the street by a kerb.
  CHECK(terrain.height({0.6, 4.8}) - terrain.height({0.6, 3.9}) > 0.08);
}

}  // namespace dynains::simulation
