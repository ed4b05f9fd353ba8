// Convex shapes that make up the world, each an affine image of a unit shape.
#pragma once

#include <cstdint>

#include "simulation/vector.hpp"

namespace dynains::simulation {

/// Unit shapes, all within [-1, 1]^3.
enum class Shape : std::uint8_t {
  kBox,        ///< the cube, whose sides may lean inwards towards the top
  kCylinder,   ///< x^2 + y^2 <= 1, |z| <= 1
  kEllipsoid,  ///< the unit ball
};

/// How a surface answers to light. materials.hpp lists all.
struct Material {
  std::uint16_t label = 0;      ///< SemanticKITTI class, unless the object has one
  float reflectivity = 0.3F;    ///< intensity at perpendicular incidence, [0, 1]
  float loss = 0.0F;            ///< share of beams without a return
  float density = 0.0F;         ///< 1/m; above 0 the shape is porous: beams end inside at random
  float clump = 0.0F;           ///< m; size of lasting gaps in a porous shape, 0 for none
  float roughness = 0.0F;       ///< m; extra range noise
  float window_spacing = 0.0F;  ///< m; above 0 the vertical faces carry recessed windows
};

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
Primitive make_primitive(Shape shape, const Material& material, Vec3 centre, Vec3 half,
                         const Mat3& rotation = {}, float taper_x = 0, float taper_y = 0);

/// The primitive in another frame.
Primitive transformed(const Rigid& T_target_source, const Primitive& source);

/// The part of the line `origin + t * direction` that lies inside, if any.
struct Interval {
  float enter = 0.0F;
  float leave = -1.0F;
  bool empty() const { return !(enter <= leave); }
};
Interval intersect(const Primitive& primitive, Vec3 origin, Vec3 direction);

/// Unit normal of the surface nearest to `point`, outwards.
Vec3 surface_normal(const Primitive& primitive, Vec3 point);

}  // namespace dynains::simulation
