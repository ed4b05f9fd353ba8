// Small vectors, angles and grids of the ray caster. Written out so that every compiler does the
// same additions.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

namespace dynains::simulation {

inline constexpr double kPi = 3.14159265358979323846;
/// The angle, moved to [-pi, pi).
inline double wrap(double angle) { return angle - 2 * kPi * std::floor((angle + kPi) / (2 * kPi)); }

struct Vec2 {
  double x = 0, y = 0;
};
inline Vec2 operator+(Vec2 a, Vec2 b) { return {a.x + b.x, a.y + b.y}; }
inline Vec2 operator-(Vec2 a, Vec2 b) { return {a.x - b.x, a.y - b.y}; }
inline Vec2 operator*(double s, Vec2 a) { return {s * a.x, s * a.y}; }
inline double dot(Vec2 a, Vec2 b) { return a.x * b.x + a.y * b.y; }
inline double norm(Vec2 a) { return std::sqrt(dot(a, a)); }
inline Vec2 direction(double heading) { return {std::cos(heading), std::sin(heading)}; }
/// A quarter turn to the left.
inline Vec2 left_of(Vec2 a) { return {-a.y, a.x}; }

struct Vec3 {
  float x = 0, y = 0, z = 0;
};
inline Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec3 operator*(float s, Vec3 a) { return {s * a.x, s * a.y, s * a.z}; }
inline float dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline float norm(Vec3 a) { return std::sqrt(dot(a, a)); }

/// Three rows.
struct Mat3 {
  Vec3 x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
};
inline Vec3 operator*(const Mat3& m, Vec3 v) { return {dot(m.x, v), dot(m.y, v), dot(m.z, v)}; }
inline Mat3 transposed(const Mat3& m) {
  return {{m.x.x, m.y.x, m.z.x}, {m.x.y, m.y.y, m.z.y}, {m.x.z, m.y.z, m.z.z}};
}
inline Mat3 operator*(const Mat3& a, const Mat3& b) {
  const Mat3 t = transposed(b);
  return {{dot(a.x, t.x), dot(a.x, t.y), dot(a.x, t.z)},
          {dot(a.y, t.x), dot(a.y, t.y), dot(a.y, t.z)},
          {dot(a.z, t.x), dot(a.z, t.y), dot(a.z, t.z)}};
}

inline Mat3 rotation_x(double angle) {
  const auto c = static_cast<float>(std::cos(angle)), s = static_cast<float>(std::sin(angle));
  return {{1, 0, 0}, {0, c, -s}, {0, s, c}};
}
inline Mat3 rotation_y(double angle) {
  const auto c = static_cast<float>(std::cos(angle)), s = static_cast<float>(std::sin(angle));
  return {{c, 0, s}, {0, 1, 0}, {-s, 0, c}};
}
inline Mat3 rotation_z(double angle) {
  const auto c = static_cast<float>(std::cos(angle)), s = static_cast<float>(std::sin(angle));
  return {{c, -s, 0}, {s, c, 0}, {0, 0, 1}};
}

/// Rotation and translation, target from source.
struct Rigid {
  Mat3 rotation;
  Vec3 translation;
};
inline Vec3 operator*(const Rigid& t, Vec3 p) { return t.rotation * p + t.translation; }
inline Rigid operator*(const Rigid& a, const Rigid& b) {
  return {a.rotation * b.rotation, a * b.translation};
}

/// Place of a cell in a grid of rows of `width` cells; neither `row` nor `column` is negative.
constexpr std::size_t grid_index(int row, int column, int width) {
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
         static_cast<std::size_t>(column);
}

/// Key of a cell of an unbounded grid.
constexpr std::uint64_t cell_key(int x, int y) {
  return static_cast<std::uint64_t>(static_cast<std::uint32_t>(x)) << 32 |
         static_cast<std::uint32_t>(y);
}

}  // namespace dynains::simulation
