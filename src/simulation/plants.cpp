#include <algorithm>
#include <cmath>

#include "simulation/materials.hpp"
#include "simulation/model_parts.hpp"
#include "simulation/models.hpp"

namespace dynains::simulation {
namespace {

/// A branch from `from` upwards and outwards; returns its end.
Vec3 add_branch(Model& model, Vec3 from, double heading, double tilt, double length,
                double radius) {
  const Mat3 rotation = rotation_z(heading) * rotation_y(tilt);
  const Vec3 along = rotation * vec(0, 0, length);
  model.push_back(rod(kMaterials.tree_trunk, from + 0.5F * along, radius, length, rotation));
  return from + along;
}

/// Clumps of leaves, or bare twigs, around the outer part of a branch.
void add_clumps(Model& model, Vec3 from, Vec3 to, bool bare, double size, Random& random) {
  const auto clumps = static_cast<int>(2 + random.index(3));
  for (int i = 0; i < clumps; ++i) {
    const Vec3 at = from + static_cast<float>(random.uniform(0.4, 1.05)) * (to - from);
    const double radius = size * random.uniform(0.6, 1.2), spread = 0.7 * size;
    model.push_back(ball(bare ? kMaterials.bare_twigs : kMaterials.leaf_clump,
                         static_cast<double>(at.x) + random.uniform(-spread, spread),
                         static_cast<double>(at.y) + random.uniform(-spread, spread),
                         static_cast<double>(at.z) + random.uniform(-spread, spread), radius,
                         radius, radius * random.uniform(0.5, 0.9)));
  }
}

}  // namespace

Model tree_model(double height, double crown_radius, double clear_height, Random& random) {
  Model model;
  const double trunk = 0.08 + 0.018 * height * random.uniform(0.7, 1.3);
  const double lean = random.uniform(-0.04, 0.04);
  model.push_back(rod(kMaterials.tree_trunk, vec(0, 0, 0.5 * (clear_height + 1) - 0.3), trunk,
                      2 * (0.5 * (clear_height + 1) + 0.3), rotation_y(lean)));
  const double middle = 0.5 * (clear_height + height);
  const double half = 0.5 * (height - clear_height);
  // Limbs inside the crown.
  for (int i = 0; i < 3; ++i) {
    const double heading = random.uniform(0, 2 * kPi), tilt = random.uniform(0.3, 0.9);
    add_branch(model, vec(0, 0, clear_height + 0.3), heading, tilt, 0.8 * half, 0.45 * trunk);
  }
  // One thin ball as the whole, dense ones as boughs.
  const bool thin = random.chance(0.3);
  model.push_back(ball(kMaterials.thin_leaves, 0, 0, middle, crown_radius, crown_radius, half));
  const auto boughs = static_cast<int>(5 + random.index(6));
  for (int i = 0; i < boughs; ++i) {
    const double heading = random.uniform(0, 2 * kPi);
    const double out = crown_radius * random.uniform(0.2, 0.75);
    const double up = half * random.uniform(-0.7, 0.75);
    const double radius = crown_radius * random.uniform(0.3, 0.5);
    const double flat = random.uniform(0.6, 1.0);
    const double z = std::max(middle + up, clear_height + 0.7 * radius);
    model.push_back(ball(thin ? kMaterials.thin_leaves : kMaterials.leaves, out * std::cos(heading),
                         out * std::sin(heading), z, radius, radius, radius * flat));
  }
  return model;
}

Model bush_model(double radius, double height, Random& random) {
  Model model;
  const auto parts = static_cast<int>(2 + random.index(3));
  for (int i = 0; i < parts; ++i) {
    const double heading = random.uniform(0, 2 * kPi), out = radius * random.uniform(0.1, 0.5);
    const double r = radius * random.uniform(0.5, 0.8), h = height * random.uniform(0.35, 0.55);
    model.push_back(
        ball(kMaterials.bush, out * std::cos(heading), out * std::sin(heading), h, r, r, h));
  }
  return model;
}

Model open_tree_model(double height, double crown_radius, double clear_height, Random& random) {
  Model model;
  const double trunk = 0.06 + 0.015 * height * random.uniform(0.7, 1.3);
  const double top = 0.85 * height;
  model.push_back(post(kMaterials.tree_trunk, 0, 0, -0.3, top, trunk));
  const bool bare = random.chance(0.3);
  const auto branches = static_cast<int>(6 + random.index(5));
  for (int i = 0; i < branches; ++i) {
    const double share = (i + random.unit()) / branches;  // of the way up the crown
    const double z = clear_height + share * (top - clear_height);
    const double heading = random.uniform(0, 2 * kPi), tilt = random.uniform(0.5, 1.3);
    // Branches are longest in the lower half.
    const double length = crown_radius * random.uniform(0.7, 1.1) * (1.1 - 0.7 * share);
    const Vec3 from = vec(0, 0, z);
    const Vec3 to = add_branch(model, from, heading, tilt, length, 0.3 * trunk);
    add_clumps(model, from, to, bare, 0.12 * crown_radius + 0.15, random);
  }
  return model;
}

Model open_bush_model(double radius, double height, Random& random) {
  Model model;
  const auto stems = static_cast<int>(4 + random.index(4));
  for (int i = 0; i < stems; ++i) {
    const double heading = random.uniform(0, 2 * kPi), out = radius * random.uniform(0.2, 0.8);
    const double r = radius * random.uniform(0.25, 0.4), z = height * random.uniform(0.3, 0.85);
    model.push_back(ball(kMaterials.leaf_clump, out * std::cos(heading), out * std::sin(heading), z,
                         r, r, r * random.uniform(0.6, 1.2)));
  }
  return model;
}

Model hedge_model(double length, double width, double height, Random& random) {
  Model model;
  const double l = length / 2, w = width / 2;
  for (double x = -l; x < l - 0.1; x += 1.5) {
    const double end = std::min(x + 1.55, l), wide = w * random.uniform(0.85, 1.1);
    const double high = height * random.uniform(0.9, 1.08);
    model.push_back(block(kMaterials.hedge, x, end, -wide, wide, -0.2, high));
  }
  return model;
}

Model open_hedge_model(double length, double width, double height, Random& random) {
  Model model;
  const double l = length / 2, w = width / 2;
  for (double x = -l; x < l; x += random.uniform(0.4, 0.8)) {
    const double r = w * random.uniform(0.7, 1.1);
    for (double z = 0.3 * height; z < height; z += random.uniform(0.3, 0.6)) {
      if (random.chance(0.2)) continue;  // a gap
      model.push_back(ball(kMaterials.open_hedge, x, random.uniform(-0.3, 0.3) * w, z, r, r,
                           random.uniform(0.2, 0.4)));
    }
  }
  return model;
}

}  // namespace dynains::simulation
