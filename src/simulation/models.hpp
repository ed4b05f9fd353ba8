// Compound objects. Frame of every model: z = 0 on the ground, x forward, origin in the middle.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "simulation/primitive.hpp"
#include "simulation/random.hpp"

namespace dynains::simulation {

inline constexpr const Materials& of = kMaterials;

inline Vec3 vec(double x, double y, double z) {
  return {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
}

/// Primitives in the axes of the model. Each function adds one; lengths in m.
struct Model : std::vector<Primitive> {
  /// Corner-to-corner box, whose sides at the top have moved inwards by `taper_x`, `taper_y`.
  Model& block(const Material& material, double x0, double x1, double y0, double y1, double z0,
               double z1, double taper_x = 0, double taper_y = 0) {
    push_back(make_primitive(Shape::kBox, material,
                             vec((x0 + x1) / 2, (y0 + y1) / 2, (z0 + z1) / 2),
                             vec((x1 - x0) / 2, (y1 - y0) / 2, (z1 - z0) / 2), {},
                             static_cast<float>(taper_x), static_cast<float>(taper_y)));
    return *this;
  }

  Model& post(const Material& material, double x, double y, double z0, double z1, double radius) {
    return rod(material, vec(x, y, (z0 + z1) / 2), radius, z1 - z0, {});
  }

  /// A cylinder along `rotation` times z.
  Model& rod(const Material& material, Vec3 centre, double radius, double length,
             const Mat3& rotation) {
    push_back(make_primitive(Shape::kCylinder, material, centre, vec(radius, radius, length / 2),
                             rotation));
    return *this;
  }

  Model& ball(const Material& material, double x, double y, double z, double rx, double ry,
              double rz, const Mat3& rotation = {}) {
    push_back(make_primitive(Shape::kEllipsoid, material, vec(x, y, z), vec(rx, ry, rz), rotation));
    return *this;
  }

  /// Wheels that stand on the ground, across the x axis, at `front` and `rear`, and at both
  /// `side`s.
  Model& wheels(const Material& material, double front, double rear, double side, double radius,
                double half_width) {
    for (const double x : {front, rear}) {
      for (double y = -side; y <= side; y += std::max(2 * side, 1.0)) {
        rod(material, vec(x, y, radius), radius, 2 * half_width, rotation_x(kPi / 2));
      }
    }
    return *this;
  }

  /// A limb that hangs from (x, y, z), turned by `swing` (rad) about the y axis.
  Model& limb(const Material& material, double x, double y, double z, double length, double radius,
              double swing) {
    return ball(material, x - 0.5 * length * std::sin(swing), y, z - 0.5 * length * std::cos(swing),
                radius, radius, 0.54 * length, rotation_y(swing));
  }
};

enum class Kind { kCar, kVan, kTruck, kBus, kPedestrian, kCyclist };

struct Size {
  double length = 0, width = 0, height = 0;
};

/// Classes of SemanticKITTI of a kind at rest and in motion; its smallest size (m), and how much
/// larger it may be.
struct KindTraits {
  std::uint16_t resting, moving;
  Size least, more;
};
inline const KindTraits& traits_of(Kind kind) {
  static constexpr KindTraits kTraits[] = {
      {kClasses.car, 252, {3.6, 1.65, 1.4}, {1.2, 0.2, 0.3}},
      {kClasses.car, 252, {4.8, 1.9, 2.0}, {1.4, 0.15, 0.6}},  // van
      {kClasses.truck, 258, {7, 2.4, 3.1}, {8, 0.15, 0.7}},
      {kClasses.bus, 257, {10.5, 2.5, 3.0}, {2, 0, 0.2}},
      {kClasses.person, 254, {0.5, 0.5, 1.5}, {0, 0.15, 0.4}},
      {kClasses.bicyclist, 253, {1.75, 0.6, 1.65}, {0, 0, 0.2}},
  };
  return kTraits[static_cast<std::size_t>(kind)];
}

inline Size random_size(Kind kind, Random& random) {
  const auto& [resting, moving, least, more] = traits_of(kind);
  const double a = random.unit(), b = random.unit(), c = random.unit();
  return {least.length + more.length * a, least.width + more.width * b,
          least.height + more.height * c};
}

/// A box by its corners in ratios to half the length, half the width, and the height of the whole.
struct Part {
  const Material* material;  ///< null: the paint of a vehicle
  double x0, x1, y0, y1, z0, z1;
  double taper_x = 0, taper_y = 0;  ///< m
};

using Parts = std::vector<Part>;

inline const Parts& parts_of(Kind kind) {
  static const Material *const glass = &of.glass, *const box = &of.bright_paint, *const paint = {};
  static const Parts kParts[] = {
      {{paint, -1, 1, -1, 1, 0.14, 0.62, 0.12, 0.05},
       {glass, -0.9, 0.45, -0.93, 0.93, 0.62, 0.97, 0.42, 0.14},
       {paint, -0.7, 0.25, -0.78, 0.78, 0.95, 1},
       {paint, -0.78, -0.64, -0.88, -0.8, 0.62, 0.97},  // pillars, then mirrors
       {paint, -0.78, -0.64, 0.8, 0.88, 0.62, 0.97},
       {paint, 0, 0.05, -0.9, -0.81, 0.62, 0.97},
       {paint, 0, 0.05, 0.81, 0.9, 0.62, 0.97},
       {paint, 0.35, 0.42, -1.15, -1, 0.58, 0.69},
       {paint, 0.35, 0.42, 1, 1.15, 0.58, 0.69}},
      {{paint, -1, 0.55, -1, 1, 0.13, 1},
       {paint, 0.5, 1, -1, 1, 0.13, 0.52, 0.05, 0.03},
       {glass, 0.42, 0.82, -0.97, 0.97, 0.52, 1, 0.3, 0.08}},
      {{paint, 0.65, 1, -1, 1, 0.17, 0.62},
       {glass, 0.97, 1, -0.88, 0.88, 0.62, 0.82},
       {paint, 0.65, 0.98, -1, 1, 0.62, 0.88},
       {box, -1, 0.6, -1, 1, 0.3, 1},
       {&of.tyre, -0.95, 0.65, -0.37, 0.37, 0.17, 0.3}},
      {{paint, -1, 1, -1, 1, 0.1, 0.36},
       {glass, -0.99, 0.99, -0.98, 0.98, 0.36, 0.75},
       {paint, -1, 1, -1, 1, 0.75, 1},
       {paint, -1, -0.97, -1, 1, 0.36, 0.75},
       {paint, -0.35, -0.32, -1, 1, 0.36, 0.75},
       {paint, 0.32, 0.35, -1, 1, 0.36, 0.75},
       {paint, 0.97, 1, -1, 1, 0.36, 0.75}}};
  return kParts[static_cast<std::size_t>(kind)];
}

/// `size` is that of the whole; 2, 2 and 1 m if the parts are in metres.
inline Model assembled(const Parts& parts, const Size& size, const Material& paint) {
  Model model;
  const double l = size.length / 2, w = size.width / 2, h = size.height;
  for (const Part& p : parts) {
    model.block(p.material != nullptr ? *p.material : paint, l * p.x0, l * p.x1, w * p.y0, w * p.y1,
                h * p.z0, h * p.z1, p.taper_x, p.taper_y);
  }
  return model;
}

/// Vehicles do not change their shape.
inline Model vehicle_model(Kind kind, const Size& size, Random& random) {
  const bool large = kind == Kind::kTruck || kind == Kind::kBus;
  const double radius = large ? 0.48 : 0.32, axle = 0.31 * size.length, rear = -size.length / 2;
  return assembled(parts_of(kind), size, random.chance(0.35) ? of.dark_paint : of.bright_paint)
      .wheels(of.tyre, axle, -axle, size.width / 2 - 0.12, radius, 0.11)
      .block(of.plate, rear - 0.01, rear + 0.02, -0.26, 0.26, 0.5, 0.62);
}

/// People do: `phase` is the angle of the gait or of the pedals, `stride` its amplitude, 0 to 1.
inline Model pedestrian_model(const Size& size, std::uint64_t seed, double phase, double stride) {
  Random random(seed);
  const double h = size.height, w = size.width / 2;
  const Material& top = random.chance(0.4) ? of.dark_cloth : of.bright_cloth;
  const Material& legs = random.chance(0.6) ? of.dark_cloth : of.bright_cloth;
  const bool bag = random.chance(0.25);
  const double swing = 0.5 * stride * std::sin(phase), hip = 0.5 * h;
  Model model;
  for (const double side : {1.0, -1.0}) {
    model.limb(legs, 0, side * 0.09, hip, hip, 0.085, side * swing);
    model.limb(top, 0, side * w * 0.85, 0.8 * h, 0.36 * h, 0.055, side * -0.8 * swing);
  }
  model.ball(top, 0, 0, 0.66 * h, 0.13, w * 0.72, 0.2 * h);
  if (bag) model.block(of.dark_cloth, -0.3, -0.12, -0.15, 0.15, 0.55 * h, 0.8 * h);
  return model.ball(of.skin, 0.02, 0, 0.93 * h, 0.1, 0.085, 0.075 * h);
}

inline Model cyclist_model(const Size& size, std::uint64_t seed, double phase) {
  const Material& top = Random(seed).chance(0.4) ? of.dark_cloth : of.bright_cloth;
  const double h = size.height, swing = 0.4 * std::sin(phase);
  Model model;
  model.wheels(of.metal, 0.52, -0.52, 0, 0.34, 0.03);
  model.block(of.dark_cloth, -0.35, 0.45, -0.03, 0.03, 0.5, 0.62);
  model.block(of.dark_cloth, 0.38, 0.46, -0.28, 0.28, 0.95, 1.0);
  for (const double side : {1.0, -1.0}) {
    model.limb(of.dark_cloth, -0.12, side * 0.11, 0.95, 0.7, 0.08, -0.35 + side * swing);
    model.limb(top, 0.12, side * 0.22, 0.8 * h + 0.05, 0.55, 0.05, -0.9);
  }
  model.ball(top, -0.02, 0, 0.7 * h + 0.05, 0.14, 0.2, 0.22 * h, rotation_y(0.45));
  return model.ball(of.skin, 0.22, 0, h - 0.11, 0.11, 0.09, 0.12);
}

/// Plants. `open`: with gaps between separate clumps of leaves; a third of the trees are bare.
inline Model tree_model(bool open, double height, double crown, double clear, Random& random) {
  Model model;
  const double trunk = 0.07 + 0.017 * height * random.uniform(0.7, 1.3), top = 0.85 * height;
  model.post(of.tree_trunk, 0, 0, -0.3, open ? top : 0.5 * (clear + top), trunk);
  const bool odd = random.chance(0.3);  // bare, or thin
  const Material& leaves =
      open ? (odd ? of.bare_twigs : of.leaf_clump) : (odd ? of.thin_leaves : of.leaves);
  // One thin ball is the whole of a closed crown, dense ones are its boughs.
  const double half = 0.5 * (height - clear);
  if (!open) model.ball(of.thin_leaves, 0, 0, height - half, crown, crown, half);
  const auto boughs = static_cast<int>(6 + random.index(5));
  for (int i = 0; i < boughs; ++i) {
    const double share = (i + random.unit()) / boughs;  // of the way up the crown
    const double heading = random.uniform(0, 2 * kPi), tilt = random.uniform(0.5, 1.3);
    // Branches are longest in the lower half.
    const double length = crown * random.uniform(0.7, 1.1) * (1.1 - 0.7 * share);
    const Mat3 rotation = rotation_z(heading) * rotation_y(tilt);
    const Vec3 from = vec(0, 0, clear + share * (top - clear)), way = rotation * vec(0, 0, length);
    model.rod(of.tree_trunk, from + 0.5F * way, 0.3 * trunk, length, rotation);
    const auto clumps = static_cast<int>(open ? 2 + random.index(3) : 1);
    for (int k = 0; k < clumps; ++k) {
      const Vec3 at = from + static_cast<float>(random.uniform(0.4, open ? 1.05 : 0.7)) * way;
      const double size = open ? 0.12 * crown + 0.15 : 0.45 * crown;
      const double radius = size * random.uniform(0.6, 1.2), spread = open ? 0.7 * size : 0;
      const double dx = random.uniform(-spread, spread), dy = random.uniform(-spread, spread);
      const double z = static_cast<double>(at.z) + random.uniform(-spread, spread);
      model.ball(leaves, static_cast<double>(at.x) + dx, static_cast<double>(at.y) + dy,
                 std::max(z, clear + 0.7 * radius), radius, radius,
                 radius * random.uniform(0.5, 0.9));
    }
  }
  return model;
}

inline Model bush_model(bool open, double radius, double height, Random& random) {
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

inline Model hedge_model(bool open, double length, double width, double height, Random& random) {
  Model model;
  const double l = length / 2, w = width / 2;
  for (double x = -l; x < l - 0.1; x += open ? random.uniform(0.4, 0.8) : 1.5) {
    const double wide = w * random.uniform(0.8, 1.1), high = height * random.uniform(0.9, 1.08);
    if (!open) model.block(of.hedge, x, std::min(x + 1.55, l), -wide, wide, -0.2, high);
    for (double z = 0.3 * height; open && z < height; z += random.uniform(0.3, 0.6)) {
      if (random.chance(0.2)) continue;  // a gap
      const double half = random.uniform(0.2, 0.4), y = random.uniform(-0.3, 0.3) * w;
      model.ball(of.open_hedge, x, y, z, wide, wide, half);
    }
  }
  return model;
}

/// A pole, some thinner than the step between beams, with a lamp over the street, or with signs.
inline Model pole_model(double height, bool lamp, bool sign, Random& random) {
  Model model;
  model.post(of.steel_pole, 0, 0, -0.3, height, random.uniform(0.02, 0.1));
  if (lamp) {
    model.block(of.steel_pole, -0.05, 0.05, -1.8, 0, height - 0.1, height);
    model.block(of.steel_pole, -0.12, 0.12, -2.3, -1.6, height - 0.15, height);
  }
  if (sign) {
    const double w = random.uniform(0.2, 0.6), h = random.uniform(0.2, 0.5);
    model.block(of.sign_plate, -0.12, -0.1, -w, w, height - 2 * h, height);
  }
  return model;
}

/// Front along x, `depth` to the left (y from 0 to depth), base below the ground.
inline Model building_model(double length, double depth, double height, Random& random) {
  Model model;
  const double l = length / 2, inset = std::min(2.0, 0.9 * l);
  model.block(random.chance(0.85) ? of.facade : of.wall, -l, l, 0, depth, -1.0, height);
  if (random.chance(0.5)) {
    model.block(of.roof, -l - 0.2, l + 0.2, -0.3, depth + 0.3, height, height + 3, 0.3, depth / 2);
  }
  // Bays, balconies and entrances break the plane.
  const double x = random.uniform(-l + inset, l - inset), kind = random.unit();
  if (kind < 0.35) model.block(of.wall, x - 1.2, x + 1.2, -0.6, 0.1, 2.8, height - 1);
  for (double z = 3; kind >= 0.65 && z < height - 3; z += 3) {
    model.block(of.concrete, x - 1.3, x + 1.3, -1.0, 0, z, z + 0.2);
    model.block(of.wire_fence, x - 1.3, x + 1.3, -1.0, -0.95, z + 0.2, z + 1.1);
  }
  if (random.chance(0.4)) model.block(of.concrete, -x - 0.9, -x + 0.9, -0.7, 0, -0.5, 0.3);
  return model;
}

enum class Fence { kWood, kWire, kRailing, kPales, kGuardRail };
inline Model fence_model(Fence fence, double length, double height, Random& random) {
  Model model;
  const double l = length / 2, thin = random.uniform(0.015, 0.035);
  const bool wire = fence == Fence::kWire;
  double pitch = 2.4, radius = 0.05;  // of the posts
  if (wire || fence == Fence::kWood) {
    model.block(wire ? of.wire_fence : of.wood_fence, -l, l, -0.025, 0.025, -0.2, height);
  } else if (fence == Fence::kRailing) {
    for (const double z : {0.35 * height, 0.67 * height, height}) {
      model.rod(of.railing, vec(0, 0, z), thin, length, rotation_y(kPi / 2));
    }
    pitch = random.uniform(1.2, 2.2);
    radius = 1.3 * thin;
  } else if (fence == Fence::kPales) {
    const double pale = 2.5 * thin, step = pale + random.uniform(0.04, 0.12);
    for (double x = -l; x < l; x += step) {
      model.block(of.wood_fence, x, x + pale, -0.012, 0.012, -0.1, height);
    }
    model.block(of.wood_fence, -l, l, 0.012, 0.05, 0.8 * height - 0.04, 0.8 * height + 0.04);
  } else {
    model.block(of.guard_rail, -l, l, -0.05, 0.05, height - 0.33, height);
  }
  const Material& post =
      fence == Fence::kRailing || fence == Fence::kGuardRail ? of.railing : of.wood_fence;
  for (double x = -l; x <= l; x += pitch) model.post(post, x, 0, -0.3, height, radius);
  return model;
}

/// Deck across the x axis with pillars `span / 2` to both sides.
inline Model bridge_model(double span, double width, double clearance) {
  Model model;
  const double s = span / 2, w = width / 2, end = s + 12;
  model.block(of.concrete, -w, w, -end, end, clearance, clearance + 1);
  for (const double side : {-1.0, 1.0}) {
    const double x = side * w, y = side * (s + 6);
    model.block(of.concrete, x - 0.15, x + 0.15, -end, end, clearance + 1, clearance + 2);
    model.block(of.concrete, -w, w, y - 6, y + 6, -1, clearance);
  }
  return model;
}

/// A wire along x between two poles at its ends; they are not part of it.
inline Model wire_model(double length, double height, Random& random) {
  const double radius = random.uniform(0.005, 0.02), sag = 0.02 * length, pieces = 4;
  const auto height_at = [&](double u) { return height - sag * 4 * u * (1 - u); };
  Model model;
  for (double u = 0; u < 1; u += 1 / pieces) {
    const double low = height_at(u), high = height_at(u + 1 / pieces), run = length / pieces;
    model.rod(of.wire, vec((u + 0.5 / pieces - 0.5) * length, 0, 0.5 * (low + high)), radius,
              std::sqrt((high - low) * (high - low) + run * run),
              rotation_y(kPi / 2 - std::atan2(high - low, run)));
  }
  return model;
}

inline Model bicycle_model() {
  static const Material* const frame = &of.bicycle_frame;
  static const Parts kFrame = {{frame, -0.35, 0.4, -0.02, 0.02, 0.58, 0.62},
                               {frame, -0.02, 0.02, -0.02, 0.02, 0.3, 0.9},
                               {frame, -0.15, 0.1, -0.08, 0.08, 0.88, 0.95},
                               {frame, 0.4, 0.44, -0.28, 0.28, 0.98, 1.02},
                               {frame, 0.4, 0.44, -0.02, 0.02, 0.34, 1.0}};
  return assembled(kFrame, {2, 2, 1}, *frame).wheels(of.metal, 0.52, -0.52, 0, 0.34, 0.03);
}

/// A bin, a bench, a box, a trolley, or a stall.
inline Model furniture_model(Random& random) {
  static const Material *const grey = &of.street_furniture, *const mesh = &of.mesh;
  static const Parts kThings[] = {
      {{grey, -0.25, 0.25, -0.25, 0.25, -0.2, 1.0}},
      {{grey, -0.8, 0.8, -0.2, 0.25, 0.35, 0.5}, {grey, -0.8, 0.8, 0.2, 0.27, 0.45, 0.9}},
      {{grey, -0.6, 0.6, -0.2, 0.2, -0.2, 1.25}},
      {{mesh, -0.5, 0.5, -0.28, 0.28, 0.45, 1.0},
       {mesh, -0.5, 0.5, -0.25, 0.25, 0.12, 0.22},
       {grey, -0.58, -0.5, -0.28, 0.28, 0.98, 1.03}},
      {{&of.wood_fence, -0.8, 0.8, -0.35, -0.05, -0.1, 1.1},
       {&of.wood_fence, -0.8, 0.8, 0.3, 0.35, -0.1, 2.2},
       {grey, -0.8, 0.8, -0.35, 0.35, 2.3, 2.4}}};
  return assembled(kThings[random.index(5)], {2, 2, 1}, *grey);
}

/// A ceiling, a floor or a column between two heights (m).
inline Model slab_model(double length, double width, double bottom, double top) {
  return Model().block(of.concrete, -length / 2, length / 2, -width / 2, width / 2, bottom, top);
}

/// Walls along x; their inner faces are in the plane y = 0.
inline Model wall_model(double length, double height) {
  return Model().block(of.wall, -length / 2, length / 2, 0, 0.2, -0.2, height);
}

inline Model glass_front_model(double length, double height) {
  Model model;
  const double l = length / 2;
  model.block(of.glass_pane, -l, l, 0, 0.02, 0.1, height - 0.1);
  for (double x = -l; x <= l; x += 1.5) {
    model.block(of.steel_pole, x - 0.03, x + 0.03, -0.03, 0.05, -0.2, height);
  }
  return model;
}

}  // namespace dynains::simulation
