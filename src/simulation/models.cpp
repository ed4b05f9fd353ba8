#include "simulation/models.hpp"

#include <algorithm>
#include <cmath>

namespace dynains::simulation {
namespace {

constexpr const Materials& of = kMaterials;
constexpr double kSides[] = {-1, 1};

Vec3 vec(double x, double y, double z) {
  return {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
}

/// Classes of a kind at rest and in motion; its smallest size, and how much larger it may be.
struct Traits {
  std::uint16_t resting, moving;
  Size least, more;  // m
};

const Traits& traits_of(Kind kind) {
  using namespace semantic;
  static constexpr Traits kTraits[] = {
      {kCar, kMovingCar, {3.6, 1.65, 1.4}, {1.2, 0.2, 0.3}},
      {kCar, kMovingCar, {4.8, 1.9, 2.0}, {1.4, 0.15, 0.6}},  // van
      {kTruck, kMovingTruck, {7, 2.4, 3.1}, {8, 0.15, 0.7}},
      {kBus, kMovingBus, {10.5, 2.5, 3.0}, {2, 0, 0.2}},
      {kPerson, kMovingPerson, {0.5, 0.5, 1.5}, {0, 0.15, 0.4}},
      {kBicyclist, kMovingBicyclist, {1.75, 0.6, 1.65}, {0, 0, 0.2}},
  };
  return kTraits[static_cast<std::size_t>(kind)];
}

void add_wheels(Model& model, double front, double rear, double width, double radius) {
  for (const double x : {front, rear}) {
    for (const double side : kSides)
      model.wheel(of.tyre, x, side * (width / 2 - 0.12), radius, 0.11);
  }
}

/// `shape` in [0, 1): how far the rear end of the cabin lies from the rear of the car.
void add_car(Model& model, const Size& size, const Material& paint, double shape) {
  const double l = size.length / 2, w = size.width / 2, h = size.height, belt = 0.62 * h;
  model.block(paint, -l, l, -w, w, 0.22, belt, 0.12, 0.05);
  // The cabin leans inwards; estates keep it to the rear.
  const double rear = -l + 0.1 + 0.5 * shape, front = 0.45 * l;
  model.block(of.glass, rear, front, -w + 0.06, w - 0.06, belt, h - 0.06, 0.42, 0.14);
  model.block(paint, rear + 0.42, front - 0.42, -w + 0.2, w - 0.2, h - 0.07, h);
  // Roof pillars stop the glass from being all there is; mirrors.
  const auto strip = [&](double x0, double x1, double y, double half, double z0, double z1) {
    model.block(paint, x0, x1, y - half, y + half, z0, z1);
  };
  for (const double side : kSides) {
    strip(rear + 0.25, rear + 0.55, side * (w - 0.14), 0.04, belt, h - 0.05);
    strip(0.0, 0.1, side * (w - 0.13), 0.04, belt, h - 0.05);
    strip(0.35 * l, 0.35 * l + 0.15, side * (w + 0.07), 0.07, belt - 0.05, belt + 0.1);
  }
  add_wheels(model, 0.62 * l, -0.62 * l, size.width, 0.31);
}

void add_van(Model& model, const Size& size, const Material& paint) {
  const double l = size.length / 2, w = size.width / 2, h = size.height;
  model.block(paint, -l, 0.55 * l, -w, w, 0.3, h);
  model.block(paint, 0.5 * l, l, -w, w, 0.3, 1.2, 0.05, 0.03);
  model.block(of.glass, 0.42 * l, 0.82 * l, -w + 0.03, w - 0.03, 1.2, h, 0.3, 0.08);
  add_wheels(model, 0.6 * l, -0.6 * l, size.width, 0.34);
}

/// `shape` in [0, 1): a box body below 0.75, a loaded platform above.
void add_truck(Model& model, const Size& size, const Material& paint, double shape) {
  const double l = size.length / 2, w = size.width / 2, h = size.height, cab = l - 2.0;
  model.block(paint, cab + 0.2, l, -w, w, 0.6, 0.62 * h);
  model.block(of.glass, l - 0.15, l + 0.01, -w + 0.15, w - 0.15, 0.62 * h, 0.82 * h);
  model.block(paint, cab + 0.2, l - 0.1, -w, w, 0.62 * h, 0.88 * h);
  if (shape < 0.75) {
    model.block(of.bright_paint, -l, cab, -w, w, 1.1, h);
  } else {
    model.block(paint, -l, cab, -w, w, 1.0, 1.25);
    model.block(of.street_furniture, -0.8 * l, 0.4 * l, -w + 0.1, w - 0.1, 1.25, 2.55, 0.5, 0.3);
  }
  model.block(of.tyre, -l + 0.3, cab, -0.45, 0.45, 0.6, 1.0);
  add_wheels(model, l - 1.2, -l + 1.2, size.width, 0.48);
  add_wheels(model, -l + 2.4, -l + 3.6, size.width, 0.48);
}

void add_bus(Model& model, const Size& size, const Material& paint) {
  const double l = size.length / 2, w = size.width / 2, h = size.height;
  model.block(paint, -l, l, -w, w, 0.3, 1.1);
  model.block(of.glass, -l + 0.03, l - 0.03, -w + 0.03, w - 0.03, 1.1, 2.3);
  model.block(paint, -l, l, -w, w, 2.3, h);
  for (int i = 0; i < 6; ++i) {
    const double x = -l + 0.1 + i * (2 * l - 0.3) / 5;
    model.block(paint, x, x + 0.14, -w, w, 1.1, 2.3);
  }
  add_wheels(model, 0.6 * l, -0.55 * l, size.width, 0.48);
}

/// A branch from `from` upwards and outwards; returns its end.
Vec3 add_branch(Model& model, Vec3 from, double heading, double tilt, double length,
                double radius) {
  const Mat3 rotation = rotation_z(heading) * rotation_y(tilt);
  const Vec3 along = rotation * vec(0, 0, length);
  model.rod(of.tree_trunk, from + 0.5F * along, radius, length, rotation);
  return from + along;
}

/// Clumps of leaves, or bare twigs, around the outer part of a branch.
void add_clumps(Model& model, Vec3 from, Vec3 to, bool bare, double size, Random& random) {
  const auto clumps = static_cast<int>(2 + random.index(3));
  for (int i = 0; i < clumps; ++i) {
    const Vec3 at = from + static_cast<float>(random.uniform(0.4, 1.05)) * (to - from);
    const double radius = size * random.uniform(0.6, 1.2), spread = 0.7 * size;
    const double flat = random.uniform(0.5, 0.9);
    const double z = static_cast<double>(at.z) + random.uniform(-spread, spread);
    const double y = static_cast<double>(at.y) + random.uniform(-spread, spread);
    const double x = static_cast<double>(at.x) + random.uniform(-spread, spread);
    model.ball(bare ? of.bare_twigs : of.leaf_clump, x, y, z, radius, radius, radius * flat);
  }
}

Model open_tree(double height, double crown_radius, double clear_height, Random& random) {
  Model model;
  const double trunk = 0.06 + 0.015 * height * random.uniform(0.7, 1.3), top = 0.85 * height;
  model.post(of.tree_trunk, 0, 0, -0.3, top, trunk);
  const bool bare = random.chance(0.3);
  const auto branches = static_cast<int>(6 + random.index(5));
  for (int i = 0; i < branches; ++i) {
    const double share = (i + random.unit()) / branches;  // of the way up the crown
    const double heading = random.uniform(0, 2 * kPi), tilt = random.uniform(0.5, 1.3);
    // Branches are longest in the lower half.
    const double length = crown_radius * random.uniform(0.7, 1.1) * (1.1 - 0.7 * share);
    const Vec3 from = vec(0, 0, clear_height + share * (top - clear_height));
    const Vec3 to = add_branch(model, from, heading, tilt, length, 0.3 * trunk);
    add_clumps(model, from, to, bare, 0.12 * crown_radius + 0.15, random);
  }
  return model;
}

Model open_hedge(double length, double width, double height, Random& random) {
  Model model;
  const double l = length / 2, w = width / 2;
  for (double x = -l; x < l; x += random.uniform(0.4, 0.8)) {
    const double r = w * random.uniform(0.7, 1.1);
    for (double z = 0.3 * height; z < height; z += random.uniform(0.3, 0.6)) {
      if (random.chance(0.2)) continue;  // a gap
      const double half = random.uniform(0.2, 0.4), y = random.uniform(-0.3, 0.3) * w;
      model.ball(of.open_hedge, x, y, z, r, r, half);
    }
  }
  return model;
}

}  // namespace

Model& Model::block(const Material& material, double x0, double x1, double y0, double y1, double z0,
                    double z1, double taper_x, double taper_y) {
  push_back(make_tapered_box(material, vec((x0 + x1) / 2, (y0 + y1) / 2, (z0 + z1) / 2),
                             vec((x1 - x0) / 2, (y1 - y0) / 2, (z1 - z0) / 2),
                             static_cast<float>(taper_x), static_cast<float>(taper_y)));
  return *this;
}

Model& Model::post(const Material& material, double x, double y, double z0, double z1,
                   double radius) {
  return rod(material, vec(x, y, (z0 + z1) / 2), radius, z1 - z0, {});
}

Model& Model::rod(const Material& material, Vec3 centre, double radius, double length,
                  const Mat3& rotation) {
  push_back(make_primitive(Shape::kCylinder, material, centre, vec(radius, radius, length / 2),
                           rotation));
  return *this;
}

Model& Model::wheel(const Material& material, double x, double y, double radius,
                    double half_width) {
  return rod(material, vec(x, y, radius), radius, 2 * half_width, rotation_x(kPi / 2));
}

Model& Model::ball(const Material& material, double x, double y, double z, double rx, double ry,
                   double rz, const Mat3& rotation) {
  push_back(make_primitive(Shape::kEllipsoid, material, vec(x, y, z), vec(rx, ry, rz), rotation));
  return *this;
}

Model& Model::limb(const Material& material, double x, double y, double z, double length,
                   double radius, double swing) {
  return ball(material, x - 0.5 * length * std::sin(swing), y, z - 0.5 * length * std::cos(swing),
              radius, radius, 0.54 * length, rotation_y(swing));
}

std::uint16_t resting_label(Kind kind) { return traits_of(kind).resting; }
std::uint16_t moving_label(Kind kind) { return traits_of(kind).moving; }

Size random_size(Kind kind, Random& random) {
  const auto& [resting, moving, least, more] = traits_of(kind);
  const double a = random.unit(), b = random.unit(), c = random.unit();
  return {least.length + more.length * a, least.width + more.width * b,
          least.height + more.height * c};
}

Model vehicle_model(Kind kind, const Size& size, Random& random) {
  Model model;
  const Material& paint = random.chance(0.35) ? of.dark_paint : of.bright_paint;
  const double shape = random.unit(), rear = -size.length / 2;
  if (kind == Kind::kCar) add_car(model, size, paint, shape);
  if (kind == Kind::kVan) add_van(model, size, paint);
  if (kind == Kind::kTruck) add_truck(model, size, paint, shape);
  if (kind == Kind::kBus) add_bus(model, size, paint);
  return model.block(of.plate, rear - 0.01, rear + 0.02, -0.26, 0.26, 0.5, 0.62);
}

Model door_model(double height) {
  const double belt = 0.62 * height;
  return Model()
      .block(of.bright_paint, -1.05, 0, -0.04, 0.04, 0.28, belt)
      .block(of.glass, -0.95, -0.2, -0.02, 0.02, belt, height - 0.1);
}

Model pedestrian_model(const Size& size, std::uint64_t seed, double phase, double stride,
                       bool pushes_pram) {
  Random random(seed);
  const double h = size.height, w = size.width / 2;
  const Material& top = random.chance(0.4) ? of.dark_cloth : of.bright_cloth;
  const Material& legs = random.chance(0.6) ? of.dark_cloth : of.bright_cloth;
  const bool bag = random.chance(0.25);
  const double swing = 0.5 * stride * std::sin(phase), hip = 0.5 * h;
  Model model;
  for (const double side : {1.0, -1.0})
    model.limb(legs, 0, side * 0.09, hip, hip, 0.085, side * swing);
  model.ball(top, 0, 0, 0.66 * h, 0.13, w * 0.72, 0.2 * h);
  for (const double side : {1.0, -1.0}) {
    model.limb(top, 0, side * w * 0.85, 0.8 * h, 0.36 * h, 0.055, side * -0.8 * swing);
  }
  model.ball(of.skin, 0.02, 0, 0.93 * h, 0.1, 0.085, 0.075 * h);
  if (bag) model.block(of.dark_cloth, -0.3, -0.12, -0.15, 0.15, 0.55 * h, 0.8 * h);
  if (!pushes_pram) return model;
  model.block(of.pram, 0.55, 1.25, -0.22, 0.22, 0.35, 0.75);
  model.block(of.pram, 0.55, 0.85, -0.2, 0.2, 0.75, 1.05);
  model.block(of.pram, 0.35, 0.55, -0.2, 0.2, 0.92, 0.96);
  for (const double x : {0.65, 1.15}) {
    model.block(of.pram, x - 0.1, x + 0.1, -0.25, 0.25, 0.02, 0.22);
  }
  return model;
}

Model cyclist_model(const Size& size, std::uint64_t seed, double phase) {
  const Material& top = Random(seed).chance(0.4) ? of.dark_cloth : of.bright_cloth;
  const double h = size.height, swing = 0.4 * std::sin(phase);
  Model model;
  for (const double x : {-0.52, 0.52}) model.wheel(of.metal, x, 0, 0.34, 0.03);
  model.block(of.dark_cloth, -0.35, 0.45, -0.03, 0.03, 0.5, 0.62);
  model.block(of.dark_cloth, 0.38, 0.46, -0.28, 0.28, 0.95, 1.0);
  model.limb(of.dark_cloth, -0.12, 0.11, 0.95, 0.7, 0.08, -0.35 + swing);
  model.limb(of.dark_cloth, -0.12, -0.11, 0.95, 0.7, 0.08, -0.35 - swing);
  model.ball(top, -0.02, 0, 0.7 * h + 0.05, 0.14, 0.2, 0.22 * h, rotation_y(0.45));
  for (const double y : {0.22, -0.22}) model.limb(top, 0.12, y, 0.8 * h + 0.05, 0.55, 0.05, -0.9);
  return model.ball(of.skin, 0.22, 0, h - 0.11, 0.11, 0.09, 0.12);
}

Model tree_model(bool open, double height, double crown_radius, double clear_height,
                 Random& random) {
  if (open) return open_tree(height, crown_radius, clear_height, random);
  Model model;
  const double trunk = 0.08 + 0.018 * height * random.uniform(0.7, 1.3);
  const double lean = random.uniform(-0.04, 0.04);
  model.rod(of.tree_trunk, vec(0, 0, 0.5 * (clear_height + 1) - 0.3), trunk,
            2 * (0.5 * (clear_height + 1) + 0.3), rotation_y(lean));
  const double middle = 0.5 * (clear_height + height), half = 0.5 * (height - clear_height);
  // Limbs inside the crown.
  for (int i = 0; i < 3; ++i) {
    const double heading = random.uniform(0, 2 * kPi), tilt = random.uniform(0.3, 0.9);
    add_branch(model, vec(0, 0, clear_height + 0.3), heading, tilt, 0.8 * half, 0.45 * trunk);
  }
  // One thin ball as the whole, dense ones as boughs.
  const Material& leaves = random.chance(0.3) ? of.thin_leaves : of.leaves;
  model.ball(of.thin_leaves, 0, 0, middle, crown_radius, crown_radius, half);
  const auto boughs = static_cast<int>(5 + random.index(6));
  for (int i = 0; i < boughs; ++i) {
    const double heading = random.uniform(0, 2 * kPi);
    const double out = crown_radius * random.uniform(0.2, 0.75);
    const double up = half * random.uniform(-0.7, 0.75);
    const double radius = crown_radius * random.uniform(0.3, 0.5);
    const double flat = random.uniform(0.6, 1.0);
    const double z = std::max(middle + up, clear_height + 0.7 * radius);
    model.ball(leaves, out * std::cos(heading), out * std::sin(heading), z, radius, radius,
               radius * flat);
  }
  return model;
}

Model bush_model(bool open, double radius, double height, Random& random) {
  Model model;
  const auto parts = static_cast<int>(open ? 4 + random.index(4) : 2 + random.index(3));
  for (int i = 0; i < parts; ++i) {
    const double heading = random.uniform(0, 2 * kPi);
    const double out = radius * (open ? random.uniform(0.2, 0.8) : random.uniform(0.1, 0.5));
    const double r = radius * (open ? random.uniform(0.25, 0.4) : random.uniform(0.5, 0.8));
    const double z = height * (open ? random.uniform(0.3, 0.85) : random.uniform(0.35, 0.55));
    model.ball(open ? of.leaf_clump : of.bush, out * std::cos(heading), out * std::sin(heading), z,
               r, r, open ? r * random.uniform(0.6, 1.2) : z);
  }
  return model;
}

Model hedge_model(bool open, double length, double width, double height, Random& random) {
  if (open) return open_hedge(length, width, height, random);
  Model model;
  const double l = length / 2, w = width / 2;
  for (double x = -l; x < l - 0.1; x += 1.5) {
    const double wide = w * random.uniform(0.85, 1.1), high = height * random.uniform(0.9, 1.08);
    model.block(of.hedge, x, std::min(x + 1.55, l), -wide, wide, -0.2, high);
  }
  return model;
}

Model pole_model(double height, bool lamp, bool sign, Random& random) {
  Model model;
  model.post(of.steel_pole, 0, 0, -0.3, height, random.uniform(0.04, 0.1));
  if (lamp) {
    model.block(of.steel_pole, -0.05, 0.05, -1.8, 0, height - 0.1, height);
    model.block(of.steel_pole, -0.12, 0.12, -2.3, -1.6, height - 0.15, height);
  }
  if (sign) {
    const double half = random.uniform(0.25, 0.4);
    model.block(of.sign_plate, -0.08, -0.05, -half, half, height - 2 * half, height);
  }
  return model;
}

Model building_model(double length, double depth, double height, Random& random) {
  Model model;
  const double l = length / 2;
  model.block(random.chance(0.85) ? of.facade : of.wall, -l, l, 0, depth, -1.0, height);
  if (random.chance(0.5)) {
    model.block(of.roof, -l - 0.2, l + 0.2, -0.3, depth + 0.3, height, height + 3, 0.3, depth / 2);
  }
  // Bays, balconies and entrances break the plane.
  const auto somewhere = [&](double inset) {
    return random.uniform(-l + inset, std::max(l - inset, -l + inset + 0.1));
  };
  if (random.chance(0.4)) {
    const double x = somewhere(2);
    model.block(of.wall, x - 1.2, x + 1.2, -0.6, 0.1, 2.8, height - 1);
  }
  if (random.chance(0.35)) {
    const double x = somewhere(1.5);
    for (double z = 3; z < 3.0 * static_cast<int>(height / 3); z += 3) {
      model.block(of.concrete, x - 1.3, x + 1.3, -1.0, 0, z, z + 0.2);
      model.block(of.wire_fence, x - 1.3, x + 1.3, -1.0, -0.95, z + 0.2, z + 1.1);
    }
  }
  if (random.chance(0.4)) {
    const double x = somewhere(1.5);
    model.block(of.concrete, x - 0.9, x + 0.9, -0.7, 0, -0.5, 0.3);
    model.block(of.wall, x - 1.1, x + 1.1, -0.8, 0, 2.5, 2.65);
  }
  return model;
}

Model fence_model(double length, double height, bool wire) {
  Model model;
  const double l = length / 2, half = wire ? 0.02 : 0.03;
  model.block(wire ? of.wire_fence : of.wood_fence, -l, l, -half, half, -0.2, height);
  for (double x = -l; x <= l; x += 2.5) model.post(of.wood_fence, x, 0, -0.3, height + 0.1, 0.05);
  return model;
}

Model guard_rail_model(double length) {
  Model model;
  const double l = length / 2;
  model.block(of.guard_rail, -l, l, -0.05, 0.05, 0.45, 0.78);
  for (double x = -l; x < l; x += 2) {
    model.block(of.guard_rail, x - 0.06, x + 0.06, -0.06, 0.06, -0.3, 0.6);
  }
  return model;
}

Model bridge_model(double span, double width, double clearance) {
  Model model;
  const double s = span / 2, w = width / 2, end = s + 12;
  model.block(of.concrete, -w, w, -end, end, clearance, clearance + 1);
  for (const double side : kSides) {
    const double x = side * w, y = side * (s + 6);
    model.block(of.concrete, x - 0.15, x + 0.15, -end, end, clearance + 1, clearance + 2);
    model.block(of.concrete, -w, w, y - 6, y + 6, -1, clearance);
  }
  return model;
}

Model gantry_model(double half_width) {
  const double y = half_width + 1;
  return Model()
      .block(of.steel_pole, -0.15, 0.15, -y, y, 6.05, 6.35)
      .block(of.sign_plate, 0.15, 0.25, -8.5, -3.5, 5.4, 7.8)
      .post(of.steel_pole, 0, -y, -0.3, 6.3, 0.15)
      .post(of.steel_pole, 0, y, -0.3, 6.3, 0.15);
}

Model shelter_model(double length, double width, double height) {
  Model model;
  const double l = length / 2, w = width / 2;
  model.block(of.concrete, -l, l, -w, w, height, height + 0.25);
  for (double x = -l + 0.3; x <= l - 0.2; x += std::max(3.0, length / 4)) {
    for (const double side : kSides) {
      model.post(of.steel_pole, x, side * (w - 0.2), -0.3, height, 0.1);
    }
  }
  return model;
}

Model furniture_model(Random& random) {
  Model model;
  const double which = random.unit();
  if (which < 0.35) return model.post(of.street_furniture, 0, 0, -0.2, 1.0, 0.25);
  if (which < 0.6) {
    model.block(of.street_furniture, -0.8, 0.8, -0.2, 0.25, 0.35, 0.5);
    return model.block(of.street_furniture, -0.8, 0.8, 0.2, 0.27, 0.45, 0.9);
  }
  if (which < 0.8) return model.block(of.street_furniture, -0.6, 0.6, -0.2, 0.2, -0.2, 1.25);
  return model.post(of.steel_pole, 0, 0, -0.2, 0.9, 0.08);
}

Model bicycle_model() {
  Model model;
  for (const double x : {-0.52, 0.52}) model.wheel(of.metal, x, 0, 0.34, 0.03);
  constexpr double kFrame[][6] = {{-0.35, 0.4, -0.02, 0.02, 0.58, 0.62},
                                  {-0.02, 0.02, -0.02, 0.02, 0.3, 0.9},
                                  {-0.15, 0.1, -0.08, 0.08, 0.88, 0.95},
                                  {0.4, 0.44, -0.28, 0.28, 0.98, 1.02},
                                  {0.4, 0.44, -0.02, 0.02, 0.34, 1.0}};
  for (const auto& f : kFrame) model.block(of.bicycle_frame, f[0], f[1], f[2], f[3], f[4], f[5]);
  return model;
}

Model railing_model(double length, double height, Random& random) {
  const double radius = random.uniform(0.015, 0.035), l = length / 2;
  Model model;
  for (const double z : {0.35 * height, 0.67 * height, height}) {
    model.rod(of.railing, vec(0, 0, z), radius, length, rotation_y(kPi / 2));
  }
  const double gap = random.uniform(1.2, 2.2);
  for (double x = -l; x <= l; x += gap) model.post(of.railing, x, 0, -0.3, height, 1.3 * radius);
  return model;
}

Model paling_model(double length, double height, Random& random) {
  const double pale = random.uniform(0.04, 0.09), pitch = pale + random.uniform(0.04, 0.12);
  const double l = length / 2;
  Model model;
  for (double x = -l; x < l; x += pitch) {
    model.block(of.wood_fence, x, x + pale, -0.012, 0.012, -0.1, height);
  }
  for (const double z : {0.25 * height, 0.8 * height}) {
    model.block(of.wood_fence, -l, l, 0.012, 0.05, z - 0.04, z + 0.04);
  }
  return model;
}

Model wire_model(double length, double height, Random& random) {
  const double radius = random.uniform(0.005, 0.02), sag = 0.02 * length;
  constexpr int kPieces = 4;
  const auto height_at = [&](double u) { return height - sag * 4 * u * (1 - u); };
  Model model;
  for (int i = 0; i < kPieces; ++i) {
    const double u0 = static_cast<double>(i) / kPieces, u1 = static_cast<double>(i + 1) / kPieces;
    const double rise = height_at(u1) - height_at(u0), run = length / kPieces;
    const Vec3 middle =
        vec((0.5 * (u0 + u1) - 0.5) * length, 0, 0.5 * (height_at(u0) + height_at(u1)));
    model.rod(of.wire, middle, radius, std::sqrt(rise * rise + run * run),
              rotation_y(kPi / 2 - std::atan2(rise, run)));
  }
  return model;
}

Model sign_model(Random& random) {
  const double height = random.uniform(1.8, 3.2), radius = random.uniform(0.025, 0.05);
  const double w = random.uniform(0.2, 0.9), h = random.uniform(0.2, 0.5);
  Model model;
  model.post(of.steel_pole, 0, 0, -0.3, height, radius);
  if (w > 0.6) model.post(of.steel_pole, 0, 0.5, -0.3, height, radius);
  return model.block(of.sign_plate, -0.06, -0.04, -w, w, height - 2 * h, height);
}

Model trolley_model(Random& random) {
  const double l = random.uniform(0.8, 1.1) / 2;
  return Model()
      .block(of.mesh, -l, l, -0.28, 0.28, 0.45, 1.0)
      .block(of.mesh, -l, l, -0.25, 0.25, 0.12, 0.22)
      .block(of.street_furniture, -l - 0.08, -l, -0.28, 0.28, 0.98, 1.03);
}

Model slab_model(double length, double width, double bottom, double top) {
  return Model().block(of.concrete, -length / 2, length / 2, -width / 2, width / 2, bottom, top);
}

Model column_model(double width, double height) { return slab_model(width, width, -0.2, height); }

Model wall_model(double length, double height) {
  return Model().block(of.wall, -length / 2, length / 2, 0, 0.2, -0.2, height);
}

Model glass_front_model(double length, double height) {
  Model model;
  const double l = length / 2;
  model.block(of.glass_pane, -l, l, 0, 0.02, 0.1, height - 0.1);
  for (double x = -l; x <= l; x += 1.5) {
    model.block(of.steel_pole, x - 0.03, x + 0.03, -0.03, 0.05, -0.2, height);
  }
  return model;
}

Model stall_model(double length, double depth, Random& random) {
  const double l = length / 2, d = depth / 2, counter = random.uniform(0.9, 1.2);
  Model model;
  model.block(of.wood_fence, -l, l, -d, -d + 0.4, -0.1, counter);
  model.block(of.wood_fence, -l, l, d - 0.05, d, -0.1, random.uniform(1.8, 2.6));
  if (!random.chance(0.5)) return model;
  model.block(of.street_furniture, -l, l, -d, d, 2.3, 2.4);
  for (const double x : {-l, l}) model.post(of.steel_pole, x, -d, -0.1, 2.3, 0.04);
  return model;
}

}  // namespace dynains::simulation
