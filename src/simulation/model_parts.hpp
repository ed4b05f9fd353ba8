// Primitives from which models are made, in the axes of the model.
#pragma once

#include "simulation/primitive.hpp"

namespace dynains::simulation {

inline Vec3 vec(double x, double y, double z) {
  return {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
}

/// Corner-to-corner box in the axes of the model.
inline Primitive block(const Material& material, double x0, double x1, double y0, double y1,
                       double z0, double z1) {
  return make_primitive(Shape::kBox, material, vec((x0 + x1) / 2, (y0 + y1) / 2, (z0 + z1) / 2),
                        vec((x1 - x0) / 2, (y1 - y0) / 2, (z1 - z0) / 2));
}

inline Primitive post(const Material& material, double x, double y, double z0, double z1,
                      double radius) {
  return make_primitive(Shape::kCylinder, material, vec(x, y, (z0 + z1) / 2),
                        vec(radius, radius, (z1 - z0) / 2));
}

/// A cylinder along `rotation` times z.
inline Primitive rod(const Material& material, Vec3 centre, double radius, double length,
                     const Mat3& rotation) {
  return make_primitive(Shape::kCylinder, material, centre, vec(radius, radius, length / 2),
                        rotation);
}

/// A wheel that stands on the ground, across the x axis.
inline Primitive wheel(const Material& material, double x, double y, double radius,
                       double half_width) {
  return rod(material, vec(x, y, radius), radius, 2 * half_width, rotation_x(kPi / 2));
}

inline Primitive ball(const Material& material, double x, double y, double z, double rx, double ry,
                      double rz, const Mat3& rotation = {}) {
  return make_primitive(Shape::kEllipsoid, material, vec(x, y, z), vec(rx, ry, rz), rotation);
}

}  // namespace dynains::simulation
