#include "simulation/primitive.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace dynains::simulation {
namespace {

/// Cuts the interval of t to a + t * b <= 0. An empty one stays empty.
void clip(float a, float b, Interval& interval) {
  if (b > 0) {
    interval.leave = std::min(interval.leave, -a / b);
  } else if (b < 0) {
    interval.enter = std::max(interval.enter, -a / b);
  } else if (a > 0) {
    interval = {};
  }
}

/// Cuts the interval of t to c + 2 b t + a t^2 <= 0, for a >= 0.
void clip_quadratic(float a, float b, float c, Interval& interval) {
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

}  // namespace

Primitive make_primitive(Shape shape, const Material& material, Vec3 centre, Vec3 half,
                         const Mat3& rotation, float taper_x, float taper_y) {
  Primitive result;
  result.shape = shape;
  result.material = &material;
  result.centre = centre;
  const Mat3 inverse = transposed(rotation);
  result.to_unit = {(1 / half.x) * inverse.x, (1 / half.y) * inverse.y, (1 / half.z) * inverse.z};
  result.from_unit = transposed({half.x * inverse.x, half.y * inverse.y, half.z * inverse.z});
  result.taper_x = taper_x / half.x;
  result.taper_y = taper_y / half.y;
  return result;
}

Primitive transformed(const Rigid& T_target_source, const Primitive& source) {
  Primitive result = source;
  result.centre = T_target_source * source.centre;
  result.to_unit = source.to_unit * transposed(T_target_source.rotation);
  result.from_unit = T_target_source.rotation * source.from_unit;
  return result;
}

Interval intersect(const Primitive& primitive, Vec3 origin, Vec3 direction) {
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

Vec3 surface_normal(const Primitive& primitive, Vec3 point) {
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
