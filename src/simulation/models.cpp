#include "simulation/models.hpp"

#include <algorithm>
#include <cmath>

#include "simulation/materials.hpp"
#include "simulation/model_parts.hpp"

namespace dynains::simulation {
namespace {

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

/// A limb that hangs from (x, y, z), turned by `swing` about the y axis.
Primitive limb(const Material& material, double x, double y, double z, double length, double radius,
               double swing) {
  return ball(material, x - 0.5 * length * std::sin(swing), y, z - 0.5 * length * std::cos(swing),
              radius, radius, 0.54 * length, rotation_y(swing));
}

void add_wheels(Model& model, double front, double rear, double width, double radius) {
  for (const double x : {front, rear}) {
    for (const double side : {-1.0, 1.0}) {
      model.push_back(wheel(kMaterials.tyre, x, side * (width / 2 - 0.12), radius, 0.11));
    }
  }
}

/// `shape` in [0, 1): how far the rear end of the cabin lies from the rear of the car.
void add_car(Model& model, const Size& size, const Material& paint, double shape) {
  const double l = size.length / 2, w = size.width / 2, h = size.height;
  const double belt = 0.62 * h, floor = 0.22;
  model.push_back(make_tapered_box(paint, vec(0, 0, (floor + belt) / 2),
                                   vec(l, w, (belt - floor) / 2), 0.12F, 0.05F));
  // The cabin leans inwards; estates keep it to the rear.
  const double cabin_rear = -l + 0.1 + 0.5 * shape, cabin_front = 0.45 * l;
  model.push_back(make_tapered_box(
      kMaterials.glass, vec((cabin_rear + cabin_front) / 2, 0, (belt + h - 0.06) / 2),
      vec((cabin_front - cabin_rear) / 2, w - 0.06, (h - 0.06 - belt) / 2), 0.42F, 0.14F));
  model.push_back(
      block(paint, cabin_rear + 0.42, cabin_front - 0.42, -w + 0.2, w - 0.2, h - 0.07, h));
  // Roof pillars stop the glass from being all there is.
  for (const double side : {-1.0, 1.0}) {
    model.push_back(block(paint, cabin_rear + 0.25, cabin_rear + 0.55, side * (w - 0.14) - 0.04,
                          side * (w - 0.14) + 0.04, belt, h - 0.05));
    model.push_back(
        block(paint, 0.0, 0.1, side * (w - 0.13) - 0.04, side * (w - 0.13) + 0.04, belt, h - 0.05));
    model.push_back(block(paint, 0.35 * l, 0.35 * l + 0.15, side * (w + 0.07) - 0.07,
                          side * (w + 0.07) + 0.07, belt - 0.05, belt + 0.1));
  }
  add_wheels(model, 0.62 * l, -0.62 * l, size.width, 0.31);
}

void add_van(Model& model, const Size& size, const Material& paint) {
  const double l = size.length / 2, w = size.width / 2, h = size.height;
  model.push_back(block(paint, -l, 0.55 * l, -w, w, 0.3, h));
  model.push_back(
      make_tapered_box(paint, vec(0.75 * l, 0, 0.75), vec(0.25 * l, w, 0.45), 0.05F, 0.03F));
  model.push_back(make_tapered_box(kMaterials.glass, vec(0.62 * l, 0, (1.2 + h) / 2),
                                   vec(0.2 * l, w - 0.03, (h - 1.2) / 2), 0.3F, 0.08F));
  add_wheels(model, 0.6 * l, -0.6 * l, size.width, 0.34);
}

/// `shape` in [0, 1): a box body below 0.75, a loaded platform above.
void add_truck(Model& model, const Size& size, const Material& paint, double shape) {
  const double l = size.length / 2, w = size.width / 2, h = size.height;
  const double cab = l - 2.0;
  model.push_back(block(paint, cab + 0.2, l, -w, w, 0.6, 0.62 * h));
  model.push_back(
      block(kMaterials.glass, l - 0.15, l + 0.01, -w + 0.15, w - 0.15, 0.62 * h, 0.82 * h));
  model.push_back(block(paint, cab + 0.2, l - 0.1, -w, w, 0.62 * h, 0.88 * h));
  if (shape < 0.75) {
    model.push_back(block(kMaterials.bright_paint, -l, cab, -w, w, 1.1, h));
  } else {
    model.push_back(block(paint, -l, cab, -w, w, 1.0, 1.25));
    model.push_back(make_tapered_box(kMaterials.street_furniture, vec(-0.2 * l, 0, 1.9),
                                     vec(0.6 * l, w - 0.1, 0.65), 0.5F, 0.3F));
  }
  model.push_back(block(kMaterials.tyre, -l + 0.3, cab, -0.45, 0.45, 0.6, 1.0));
  add_wheels(model, l - 1.2, -l + 1.2, size.width, 0.48);
  add_wheels(model, -l + 2.4, -l + 3.6, size.width, 0.48);
}

void add_bus(Model& model, const Size& size, const Material& paint) {
  const double l = size.length / 2, w = size.width / 2, h = size.height;
  model.push_back(block(paint, -l, l, -w, w, 0.3, 1.1));
  model.push_back(block(kMaterials.glass, -l + 0.03, l - 0.03, -w + 0.03, w - 0.03, 1.1, 2.3));
  model.push_back(block(paint, -l, l, -w, w, 2.3, h));
  for (int i = 0; i < 6; ++i) {
    const double x = -l + 0.1 + i * (2 * l - 0.3) / 5;
    model.push_back(block(paint, x, x + 0.14, -w, w, 1.1, 2.3));
  }
  add_wheels(model, 0.6 * l, -0.55 * l, size.width, 0.48);
}

}  // namespace

std::uint16_t resting_label(Kind kind) { return traits_of(kind).resting; }
std::uint16_t moving_label(Kind kind) { return traits_of(kind).moving; }

Size random_size(Kind kind, Random& random) {
  const Size& least = traits_of(kind).least;
  const Size& more = traits_of(kind).more;
  const double a = random.unit(), b = random.unit(), c = random.unit();
  return {least.length + more.length * a, least.width + more.width * b,
          least.height + more.height * c};
}

Model vehicle_model(Kind kind, const Size& size, Random& random) {
  Model model;
  const Material& paint = random.chance(0.35) ? kMaterials.dark_paint : kMaterials.bright_paint;
  const double shape = random.unit();
  if (kind == Kind::kCar) {
    add_car(model, size, paint, shape);
  } else if (kind == Kind::kVan) {
    add_van(model, size, paint);
  } else if (kind == Kind::kTruck) {
    add_truck(model, size, paint, shape);
  } else {
    add_bus(model, size, paint);
  }
  const double rear = -size.length / 2;
  model.push_back(block(kMaterials.plate, rear - 0.01, rear + 0.02, -0.26, 0.26, 0.5, 0.62));
  return model;
}

Model door_model(double height) {
  const double belt = 0.62 * height;
  return {block(kMaterials.bright_paint, -1.05, 0, -0.04, 0.04, 0.28, belt),
          block(kMaterials.glass, -0.95, -0.2, -0.02, 0.02, belt, height - 0.1)};
}

Model pedestrian_model(const Size& size, std::uint64_t seed, double phase, double stride,
                       bool pushes_pram) {
  Random random(seed);
  const double h = size.height, w = size.width / 2;
  const Material& top = random.chance(0.4) ? kMaterials.dark_cloth : kMaterials.bright_cloth;
  const Material& legs = random.chance(0.6) ? kMaterials.dark_cloth : kMaterials.bright_cloth;
  const bool bag = random.chance(0.25);
  const double swing = 0.5 * stride * std::sin(phase);
  const double hip = 0.5 * h, shoulder = 0.8 * h;
  Model model{limb(legs, 0, 0.09, hip, hip, 0.085, swing),
              limb(legs, 0, -0.09, hip, hip, 0.085, -swing),
              ball(top, 0, 0, 0.66 * h, 0.13, w * 0.72, 0.2 * h),
              limb(top, 0, w * 0.85, shoulder, 0.36 * h, 0.055, -0.8 * swing),
              limb(top, 0, -w * 0.85, shoulder, 0.36 * h, 0.055, 0.8 * swing),
              ball(kMaterials.skin, 0.02, 0, 0.93 * h, 0.1, 0.085, 0.075 * h)};
  if (bag)
    model.push_back(block(kMaterials.dark_cloth, -0.3, -0.12, -0.15, 0.15, 0.55 * h, 0.8 * h));
  if (pushes_pram) {
    model.push_back(block(kMaterials.pram, 0.55, 1.25, -0.22, 0.22, 0.35, 0.75));
    model.push_back(block(kMaterials.pram, 0.55, 0.85, -0.2, 0.2, 0.75, 1.05));
    model.push_back(block(kMaterials.pram, 0.35, 0.55, -0.2, 0.2, 0.92, 0.96));
    for (const double x : {0.65, 1.15}) {
      model.push_back(block(kMaterials.pram, x - 0.1, x + 0.1, -0.25, 0.25, 0.02, 0.22));
    }
  }
  return model;
}

Model cyclist_model(const Size& size, std::uint64_t seed, double phase) {
  Random random(seed);
  const Material& top = random.chance(0.4) ? kMaterials.dark_cloth : kMaterials.bright_cloth;
  const double h = size.height, swing = 0.4 * std::sin(phase);
  Model model;
  for (const double x : {-0.52, 0.52}) {
    model.push_back(wheel(kMaterials.metal, x, 0, 0.34, 0.03));
  }
  model.push_back(block(kMaterials.dark_cloth, -0.35, 0.45, -0.03, 0.03, 0.5, 0.62));
  model.push_back(block(kMaterials.dark_cloth, 0.38, 0.46, -0.28, 0.28, 0.95, 1.0));
  model.push_back(limb(kMaterials.dark_cloth, -0.12, 0.11, 0.95, 0.7, 0.08, -0.35 + swing));
  model.push_back(limb(kMaterials.dark_cloth, -0.12, -0.11, 0.95, 0.7, 0.08, -0.35 - swing));
  model.push_back(ball(top, -0.02, 0, 0.7 * h + 0.05, 0.14, 0.2, 0.22 * h, rotation_y(0.45)));
  model.push_back(limb(top, 0.12, 0.22, 0.8 * h + 0.05, 0.55, 0.05, -0.9));
  model.push_back(limb(top, 0.12, -0.22, 0.8 * h + 0.05, 0.55, 0.05, -0.9));
  model.push_back(ball(kMaterials.skin, 0.22, 0, h - 0.11, 0.11, 0.09, 0.12));
  return model;
}

Model pole_model(double height, bool lamp, bool sign, Random& random) {
  Model model;
  const double radius = random.uniform(0.04, 0.1);
  model.push_back(post(kMaterials.steel_pole, 0, 0, -0.3, height, radius));
  if (lamp) {
    model.push_back(block(kMaterials.steel_pole, -0.05, 0.05, -1.8, 0, height - 0.1, height));
    model.push_back(block(kMaterials.steel_pole, -0.12, 0.12, -2.3, -1.6, height - 0.15, height));
  }
  if (sign) {
    const double half = random.uniform(0.25, 0.4);
    model.push_back(
        block(kMaterials.sign_plate, -0.08, -0.05, -half, half, height - 2 * half, height));
  }
  return model;
}

Model building_model(double length, double depth, double height, Random& random) {
  Model model;
  const double l = length / 2;
  const bool windows = random.chance(0.85);
  model.push_back(
      block(windows ? kMaterials.facade : kMaterials.wall, -l, l, 0, depth, -1.0, height));
  if (random.chance(0.5)) {
    model.push_back(make_tapered_box(kMaterials.roof, vec(0, depth / 2, height + 1.5),
                                     vec(l + 0.2, depth / 2 + 0.3, 1.5), 0.3F,
                                     static_cast<float>(depth / 2)));
  }
  // Bays, balconies and entrances break the plane.
  if (random.chance(0.4)) {
    const double x = random.uniform(-l + 2, std::max(l - 2, -l + 2.1));
    model.push_back(block(kMaterials.wall, x - 1.2, x + 1.2, -0.6, 0.1, 2.8, height - 1));
  }
  const auto floors = static_cast<int>(height / 3);
  if (random.chance(0.35)) {
    const double x = random.uniform(-l + 1.5, std::max(l - 1.5, -l + 1.6));
    for (int i = 1; i < floors; ++i) {
      model.push_back(
          block(kMaterials.concrete, x - 1.3, x + 1.3, -1.0, 0, 3.0 * i, 3.0 * i + 0.2));
      model.push_back(block(kMaterials.wire_fence, x - 1.3, x + 1.3, -1.0, -0.95, 3.0 * i + 0.2,
                            3.0 * i + 1.1));
    }
  }
  if (random.chance(0.4)) {
    const double x = random.uniform(-l + 1.5, std::max(l - 1.5, -l + 1.6));
    model.push_back(block(kMaterials.concrete, x - 0.9, x + 0.9, -0.7, 0, -0.5, 0.3));
    model.push_back(block(kMaterials.wall, x - 1.1, x + 1.1, -0.8, 0, 2.5, 2.65));
  }
  return model;
}

Model fence_model(double length, double height, bool wire) {
  Model model;
  const Material& material = wire ? kMaterials.wire_fence : kMaterials.wood_fence;
  const double half_width = wire ? 0.02 : 0.03;
  model.push_back(block(material, -length / 2, length / 2, -half_width, half_width, -0.2, height));
  for (double x = -length / 2; x <= length / 2; x += 2.5) {
    model.push_back(post(kMaterials.wood_fence, x, 0, -0.3, height + 0.1, 0.05));
  }
  return model;
}

Model guard_rail_model(double length) {
  Model model{block(kMaterials.guard_rail, -length / 2, length / 2, -0.05, 0.05, 0.45, 0.78)};
  for (double x = -length / 2; x < length / 2; x += 2) {
    model.push_back(block(kMaterials.guard_rail, x - 0.06, x + 0.06, -0.06, 0.06, -0.3, 0.6));
  }
  return model;
}

Model bridge_model(double span, double width, double clearance) {
  Model model;
  const double s = span / 2, w = width / 2;
  model.push_back(block(kMaterials.concrete, -w, w, -s - 12, s + 12, clearance, clearance + 1));
  for (const double side : {-1.0, 1.0}) {
    model.push_back(block(kMaterials.concrete, side * w - 0.15, side * w + 0.15, -s - 12, s + 12,
                          clearance + 1, clearance + 2));
    model.push_back(
        block(kMaterials.concrete, -w, w, side * (s + 6) - 6, side * (s + 6) + 6, -1, clearance));
  }
  return model;
}

Model shelter_model(double length, double width, double height) {
  Model model;
  const double l = length / 2, w = width / 2;
  model.push_back(block(kMaterials.concrete, -l, l, -w, w, height, height + 0.25));
  for (double x = -l + 0.3; x <= l - 0.2; x += std::max(3.0, length / 4)) {
    for (const double side : {-1.0, 1.0}) {
      model.push_back(post(kMaterials.steel_pole, x, side * (w - 0.2), -0.3, height, 0.1));
    }
  }
  return model;
}

Model furniture_model(Random& random) {
  Model model;
  const double which = random.unit();
  if (which < 0.35) {
    model.push_back(post(kMaterials.street_furniture, 0, 0, -0.2, 1.0, 0.25));
  } else if (which < 0.6) {
    model.push_back(block(kMaterials.street_furniture, -0.8, 0.8, -0.2, 0.25, 0.35, 0.5));
    model.push_back(block(kMaterials.street_furniture, -0.8, 0.8, 0.2, 0.27, 0.45, 0.9));
  } else if (which < 0.8) {
    model.push_back(block(kMaterials.street_furniture, -0.6, 0.6, -0.2, 0.2, -0.2, 1.25));
  } else {
    model.push_back(post(kMaterials.steel_pole, 0, 0, -0.2, 0.9, 0.08));
  }
  return model;
}

Model slab_model(double length, double width, double bottom, double top) {
  return {block(kMaterials.concrete, -length / 2, length / 2, -width / 2, width / 2, bottom, top)};
}

Model column_model(double width, double height) {
  const double w = width / 2;
  return {block(kMaterials.concrete, -w, w, -w, w, -0.2, height)};
}

Model wall_model(double length, double height) {
  return {block(kMaterials.wall, -length / 2, length / 2, 0, 0.2, -0.2, height)};
}

Model glass_front_model(double length, double height) {
  Model model{block(kMaterials.glass_pane, -length / 2, length / 2, 0, 0.02, 0.1, height - 0.1)};
  for (double x = -length / 2; x <= length / 2; x += 1.5) {
    model.push_back(block(kMaterials.steel_pole, x - 0.03, x + 0.03, -0.03, 0.05, -0.2, height));
  }
  return model;
}

Model stall_model(double length, double depth, Random& random) {
  const double l = length / 2, d = depth / 2, counter = random.uniform(0.9, 1.2);
  Model model{block(kMaterials.wood_fence, -l, l, -d, -d + 0.4, -0.1, counter),
              block(kMaterials.wood_fence, -l, l, d - 0.05, d, -0.1, random.uniform(1.8, 2.6))};
  if (random.chance(0.5)) {
    model.push_back(block(kMaterials.street_furniture, -l, l, -d, d, 2.3, 2.4));
    for (const double x : {-l, l}) {
      model.push_back(post(kMaterials.steel_pole, x, -d, -0.1, 2.3, 0.04));
    }
  }
  return model;
}

}  // namespace dynains::simulation
