// Convex shapes that make up the world, each an affine image of a unit shape, and their surfaces.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "simulation/vector.hpp"

namespace dynains::simulation {

/// Unit shapes, all within [-1, 1]^3.
enum class Shape : std::uint8_t {
  kBox,        ///< the cube, whose sides may lean inwards towards the top
  kCylinder,   ///< x^2 + y^2 <= 1, |z| <= 1
  kEllipsoid,  ///< the unit ball
};

/// How a surface answers to light.
struct Material {
  std::uint16_t label = 0;      ///< SemanticKITTI class, unless the object has one
  float reflectivity = 0.3F;    ///< intensity at perpendicular incidence, [0, 1]
  float loss = 0.0F;            ///< share of beams without a return
  float density = 0.0F;         ///< 1/m; above 0 the shape is porous: beams end inside at random
  float clump = 0.0F;           ///< m; size of lasting gaps in a porous shape, 0 for none
  float roughness = 0.0F;       ///< m; extra range noise
  float window_spacing = 0.0F;  ///< m; above 0 the vertical faces carry recessed windows
};

/// Classes of SemanticKITTI, at rest; models.hpp has those in motion.
struct Classes {
  std::uint16_t outlier = 1;
  std::uint16_t car = 10, bicycle = 11, bus = 13, truck = 18, person = 30, bicyclist = 31;
  std::uint16_t road = 40, parking = 44, sidewalk = 48, terrain = 72;
  std::uint16_t building = 50, fence = 51, other_structure = 52, pole = 80, sign = 81;
  std::uint16_t vegetation = 70, trunk = 71, other_object = 99;
};
inline constexpr Classes kClasses;

/// All surfaces of the simulated world.
struct Materials {
  //                  label                 refl   loss  density clump rough window
  Material facade{kClasses.building, 0.35F, 0.02F, 0, 0, 0.01F, 3.0F};
  Material wall{kClasses.building, 0.4F, 0.02F, 0, 0, 0.01F, 0};
  Material roof{kClasses.building, 0.25F, 0.05F, 0, 0, 0.02F, 0};
  Material concrete{kClasses.other_structure, 0.4F, 0.02F, 0, 0, 0.01F, 0};
  Material tree_trunk{kClasses.trunk, 0.3F, 0.03F, 0, 0, 0.015F, 0};
  Material leaves{kClasses.vegetation, 0.35F, 0.10F, 1.6F, 0.45F, 0, 0};
  Material thin_leaves{kClasses.vegetation, 0.35F, 0.15F, 0.6F, 0.6F, 0, 0};
  Material bush{kClasses.vegetation, 0.35F, 0.08F, 5.0F, 0.2F, 0, 0};
  Material hedge{kClasses.vegetation, 0.35F, 0.06F, 9.0F, 0.15F, 0, 0};
  Material leaf_clump{kClasses.vegetation, 0.35F, 0.10F, 3.0F, 0.12F, 0, 0};
  Material bare_twigs{kClasses.vegetation, 0.25F, 0.15F, 0.5F, 0.15F, 0, 0};
  Material open_hedge{kClasses.vegetation, 0.35F, 0.08F, 3.5F, 0.15F, 0, 0};
  Material glass_pane{kClasses.building, 0.1F, 0.3F, 12.0F, 0, 0, 0};
  Material wire_fence{kClasses.fence, 0.3F, 0.10F, 5.0F, 0, 0, 0};
  Material wood_fence{kClasses.fence, 0.4F, 0.03F, 0, 0, 0.01F, 0};
  Material guard_rail{kClasses.fence, 0.6F, 0.05F, 0, 0, 0, 0};
  Material steel_pole{kClasses.pole, 0.5F, 0.02F, 0, 0, 0, 0};
  Material sign_plate{kClasses.sign, 0.95F, 0.0F, 0, 0, 0, 0};
  Material street_furniture{kClasses.other_object, 0.4F, 0.02F, 0, 0, 0, 0};
  Material bright_paint{kClasses.car, 0.6F, 0.06F, 0, 0, 0, 0};
  Material dark_paint{kClasses.car, 0.12F, 0.14F, 0, 0, 0, 0};
  Material glass{kClasses.car, 0.1F, 0.5F, 0, 0, 0.01F, 0};
  Material tyre{kClasses.car, 0.08F, 0.15F, 0, 0, 0, 0};
  Material plate{kClasses.car, 0.95F, 0, 0, 0, 0, 0};
  Material bright_cloth{kClasses.person, 0.5F, 0.01F, 0, 0, 0.01F, 0};
  Material dark_cloth{kClasses.person, 0.2F, 0.05F, 0, 0, 0.01F, 0};
  Material skin{kClasses.person, 0.4F, 0.02F, 0, 0, 0.005F, 0};
  Material metal{kClasses.bicycle, 0.3F, 0.2F, 3.0F, 0, 0, 0};
  Material bicycle_frame{kClasses.bicycle, 0.3F, 0.05F, 0, 0, 0, 0};
  Material railing{kClasses.fence, 0.5F, 0.03F, 0, 0, 0, 0};
  Material wire{kClasses.other_object, 0.3F, 0.1F, 0, 0, 0, 0};
  Material mesh{kClasses.other_object, 0.4F, 0.1F, 4.0F, 0, 0, 0};
  Material ego_roof{kClasses.outlier, 0.3F, 0.1F, 0, 0, 0, 0};
};
inline constexpr Materials kMaterials;

struct Primitive {
  Shape shape = Shape::kBox;
  const Material* material = nullptr;
  Vec3 centre;
  Mat3 to_unit;                          ///< p_unit = to_unit * (p - centre)
  Mat3 from_unit;                        ///< inverse of to_unit; columns are the half axes
  float taper_x = 0.0F, taper_y = 0.0F;  ///< of a box: how far each side has moved at the top
};

/// `half` are the half extents along the axes of `rotation`. `taper_x`, `taper_y`: m, how far the
/// sides of a box have moved inwards at the top.
inline Primitive make_primitive(Shape shape, const Material& material, Vec3 centre, Vec3 half,
                                const Mat3& rotation = {}, float taper_x = 0, float taper_y = 0) {
  const Mat3 axes = transposed(rotation);
  return {shape,
          &material,
          centre,
          {(1 / half.x) * axes.x, (1 / half.y) * axes.y, (1 / half.z) * axes.z},
          transposed({half.x * axes.x, half.y * axes.y, half.z * axes.z}),
          taper_x / half.x,
          taper_y / half.y};
}

/// The primitive in another frame.
inline Primitive transformed(const Rigid& T_target_source, const Primitive& source) {
  Primitive result = source;
  result.centre = T_target_source * source.centre;
  result.to_unit = source.to_unit * transposed(T_target_source.rotation);
  result.from_unit = T_target_source.rotation * source.from_unit;
  return result;
}

/// The part of the line `origin + t * direction` that lies inside, if any.
struct Interval {
  float enter = 0.0F;
  float leave = -1.0F;
  bool empty() const { return !(enter <= leave); }
};

/// Cuts the interval of t to a + t * b <= 0. An empty one stays empty.
inline void clip(float a, float b, Interval& interval) {
  if (b > 0) {
    interval.leave = std::min(interval.leave, -a / b);
  } else if (b < 0) {
    interval.enter = std::max(interval.enter, -a / b);
  } else if (a > 0) {
    interval = {};
  }
}

/// Cuts the interval of t to c + 2 b t + a t^2 <= 0, for a >= 0.
inline void clip_quadratic(float a, float b, float c, Interval& interval) {
  if (a < 1e-12F) {
    if (c > 0) interval = {};
    return;
  }
  const float discriminant = b * b - a * c;
  if (discriminant < 0) {
    interval = {};
    return;
  }
  const float root = std::sqrt(discriminant);
  interval.enter = std::max(interval.enter, (-b - root) / a);
  interval.leave = std::min(interval.leave, (-b + root) / a);
}

inline Interval intersect(const Primitive& primitive, Vec3 origin, Vec3 direction) {
  const Vec3 o = primitive.to_unit * (origin - primitive.centre);
  const Vec3 d = primitive.to_unit * direction;
  const float far = std::numeric_limits<float>::infinity();
  Interval interval{-far, far};
  switch (primitive.shape) {
    case Shape::kBox: {
      // At height z the half extent is 1 - lean * (z + 1).
      const float lean_x = 0.5F * primitive.taper_x, lean_y = 0.5F * primitive.taper_y;
      clip(o.z - 1, d.z, interval);
      clip(-o.z - 1, -d.z, interval);
      clip(o.x + lean_x * (o.z + 1) - 1, d.x + lean_x * d.z, interval);
      clip(-o.x + lean_x * (o.z + 1) - 1, -d.x + lean_x * d.z, interval);
      clip(o.y + lean_y * (o.z + 1) - 1, d.y + lean_y * d.z, interval);
      clip(-o.y + lean_y * (o.z + 1) - 1, -d.y + lean_y * d.z, interval);
      break;
    }
    case Shape::kCylinder:
      clip_quadratic(d.x * d.x + d.y * d.y, o.x * d.x + o.y * d.y, o.x * o.x + o.y * o.y - 1,
                     interval);
      clip(o.z - 1, d.z, interval);
      clip(-o.z - 1, -d.z, interval);
      break;
    case Shape::kEllipsoid:
      clip_quadratic(dot(d, d), dot(o, d), dot(o, o) - 1, interval);
      break;
  }
  return interval;
}

/// Unit normal of the surface nearest to `point`, outwards.
inline Vec3 surface_normal(const Primitive& primitive, Vec3 point) {
  const Vec3 p = primitive.to_unit * (point - primitive.centre);
  const float ax = std::abs(p.x), ay = std::abs(p.y), az = std::abs(p.z);
  Vec3 unit;
  switch (primitive.shape) {
    case Shape::kBox: {
      const float lean_x = 0.5F * primitive.taper_x, lean_y = 0.5F * primitive.taper_y;
      const float x = ax + lean_x * (p.z + 1), y = ay + lean_y * (p.z + 1);
      if (az >= x && az >= y) {
        unit = {0, 0, std::copysign(1.0F, p.z)};
      } else if (x >= y) {
        unit = {std::copysign(1.0F, p.x), 0, lean_x};
      } else {
        unit = {0, std::copysign(1.0F, p.y), lean_y};
      }
      break;
    }
    case Shape::kCylinder:
      unit = az >= std::sqrt(p.x * p.x + p.y * p.y) ? Vec3{0, 0, std::copysign(1.0F, p.z)}
                                                    : Vec3{p.x, p.y, 0};
      break;
    case Shape::kEllipsoid:
      unit = p;
      break;
  }
  const Vec3 normal = transposed(primitive.to_unit) * unit;
  return (1 / std::max(norm(normal), 1e-12F)) * normal;
}

}  // namespace dynains::simulation
