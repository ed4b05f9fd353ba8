// Height and class of the ground.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

#include "simulation/ground_plan.hpp"
#include "simulation/primitive.hpp"
#include "simulation/random.hpp"

namespace dynains::simulation {

struct TerrainConfig {
  double hill_slope = 0.015;   ///< steepest slope of the large-scale ground, about
  double hill_length = 180.0;  ///< m, distance between crests, about
  double roughness = 0.04;     ///< m, unevenness off the street; a third of it on the street
  double kerb = 0.12;          ///< m, height of the pavement over the street
  std::uint16_t open_label = kClasses.terrain;  ///< class where there is no street
  std::uint16_t street_label = kClasses.road;   ///< class of the carriageway
};

inline constexpr double kFar = 12.0;  // m, where streets do not matter any more

inline double smooth_step(double u) {
  u = std::clamp(u, 0.0, 1.0);
  return u * u * (3 - 2 * u);
}

inline int tile_index(double v, double size) { return static_cast<int>(std::floor(v / size)); }

/// A part of the centre of a street, and what distances to it need.
struct Segment {
  Segment(const Street& whole, Vec2 from, Vec2 to)
      : street(&whole), a(from), ab(to - from), square(std::max(dot(ab, ab), 1e-9)) {}

  double distance(Vec2 p) const {
    const Vec2 ap = p - a;
    const double u = std::clamp(dot(ap, ab) / square, 0.0, 1.0);
    return norm(ap - u * ab);
  }

  const Street* street;
  Vec2 a, ab;
  double square;  // m^2, of the length
};

inline std::vector<Segment> segments_near(const std::vector<Street>& streets, Vec2 centre,
                                          double radius) {
  std::vector<Segment> result;
  for (const Street& street : streets) {
    const auto& points = street.centre.points();
    for (std::size_t i = 1; i < points.size(); ++i) {
      const Segment segment(street, points[i - 1], points[i]);
      if (segment.distance(centre) < radius + kFar + street.half_width) result.push_back(segment);
    }
  }
  return result;
}

struct Ground {
  double edge = kFar;     ///< distance to the edge of the nearest carriageway
  double half_width = 4;  ///< of that street
  double pavement = 0;    ///< how far a pavement reaches beyond the point, positive if on it
};

inline Ground ground_at(const std::vector<Segment>& segments, Vec2 p) {
  Ground result;
  for (const Segment& segment : segments) {
    const double edge = segment.distance(p) - segment.street->half_width;
    if (edge < result.edge) {
      result.edge = edge;
      result.half_width = segment.street->half_width;
    }
    result.pavement = std::max(result.pavement, segment.street->pavement - edge);
  }
  return result;
}

/// The ground is a height field with 0.25 m between samples, made tile by tile where it is asked
/// for, from hills, unevenness, kerbs and the crown of the road.
class Terrain {
 public:
  Terrain(const TerrainConfig& config, std::vector<Street> streets, Random random)
      : config_(config), streets_(std::move(streets)), salt_(random.bits()) {
    double steepness = 0;
    for (int i = 0; i < 5; ++i) {
      const double heading = random.uniform(0, 2 * kPi);
      const double length = config_.hill_length * random.uniform(0.6, 1.7);
      const double phase = random.uniform(0, 2 * kPi);
      // The slopes of the waves add up to the steepest slope only where all agree.
      const double slope = config_.hill_slope * random.uniform(0.3, 0.6);
      const double number = 2 * kPi / length;
      waves_.push_back({number * direction(heading), slope / number, phase});
      steepness += slope;
    }
    steepest_ = static_cast<float>(steepness + 0.03 + config_.roughness);
  }

  const std::vector<Street>& streets() const { return streets_; }
  /// Distance to the edge of the nearest carriageway, negative on it. At most 12 m.
  double distance_to_street(Vec2 p) const {
    return ground_at(segments_near(streets_, p, 0), p).edge;
  }

  double height(Vec2 p) {
    const int ix = tile_index(p.x, kTile), iy = tile_index(p.y, kTile);
    const Tile& t = tile(ix, iy);
    const double u = (p.x - ix * kTile) / kCell, v = (p.y - iy * kTile) / kCell;
    const int column = std::clamp(static_cast<int>(u), 0, kCells - 1);
    const int row = std::clamp(static_cast<int>(v), 0, kCells - 1);
    const double fu = u - column, fv = v - row;
    auto sample = [&](int r, int c) {
      return static_cast<double>(t.heights[grid_index(r, c, kCells + 1)]);
    };
    return (1 - fv) * ((1 - fu) * sample(row, column) + fu * sample(row, column + 1)) +
           fv * ((1 - fu) * sample(row + 1, column) + fu * sample(row + 1, column + 1));
  }

  /// Prepares rays from around `centre`.
  void prepare(Vec2 centre, double radius) {
    if (tiles_.size() > 1500) tiles_.clear();  // most are left behind; others are made again
    near_x_ = tile_index(centre.x, kTile) - kSide / 2;
    near_y_ = tile_index(centre.y, kTile) - kSide / 2;
    near_.fill(nullptr);
    low_ = 1e9F;
    high_ = -1e9F;
    for (int iy = 0; iy < kSide; ++iy) {
      for (int ix = 0; ix < kSide; ++ix) {
        const double dx = (near_x_ + ix + 0.5) * kTile - centre.x;
        const double dy = (near_y_ + iy + 0.5) * kTile - centre.y;
        if (std::sqrt(dx * dx + dy * dy) > radius + 0.71 * kTile) continue;
        const Tile& t = tile(near_x_ + ix, near_y_ + iy);
        near_[grid_index(iy, ix, kSide)] = &t;
        for (std::size_t i = 0; i < t.heights.size(); i += 64) {
          low_ = std::min(low_, t.heights[i]);
          high_ = std::max(high_, t.heights[i]);
        }
      }
    }
    low_ -= 1;
    high_ += 1;
  }

  /// Distance to the ground along a ray in world axes (origin relative to world), or a negative
  /// number if nothing is hit before `t_max`. Only within the radius of `prepare()`.
  float cast(Vec3 origin, Vec3 direction, float t_max) const {
    // Sphere tracing: below the steepest slope no crossing can be missed. Kerbs are steeper, so a
    // step may end below the ground; the crossing is then found by halving.
    const float horizontal = std::sqrt(direction.x * direction.x + direction.y * direction.y);
    const float closing = steepest_ * horizontal - direction.z;
    if (closing <= 0.002F) return -1;
    float before = 0, t = 0;
    if (direction.z < 0 && origin.z > high_) t = (high_ - origin.z) / direction.z;
    for (int i = 0; i < 256; ++i) {
      if (t > t_max) t = t_max;
      const float z = origin.z + t * direction.z;
      if (direction.z > 0 && z > high_) return -1;
      const float clearance =
          z - height_near(origin.x + t * direction.x, origin.y + t * direction.y);
      if (clearance <= 0) {
        float above = before, below = t;
        for (int j = 0; j < 12; ++j) {
          const float middle = 0.5F * (above + below);
          const float h =
              height_near(origin.x + middle * direction.x, origin.y + middle * direction.y);
          (origin.z + middle * direction.z > h ? above : below) = middle;
        }
        return 0.5F * (above + below);
      }
      if (t >= t_max) return -1;
      before = t;
      // A little farther than safe, so that the last metres do not take for ever.
      t += std::max(clearance / closing * 1.02F, 0.01F + 0.0005F * t);
    }
    return -1;
  }

  /// Upward unit normal and class at a point within the prepared region.
  Vec3 normal_near(float x, float y) const {
    const float step = 0.3F;
    const float dx = height_near(x + step, y) - height_near(x - step, y);
    const float dy = height_near(x, y + step) - height_near(x, y - step);
    const Vec3 normal{-dx, -dy, 2 * step};
    return (1 / norm(normal)) * normal;
  }

  std::uint16_t label_near(float x, float y) const {
    const float u = samples(x, near_x_), v = samples(y, near_y_);
    const Tile* t = near_tile(u, v);
    if (t == nullptr) return 0;
    return t
        ->labels[grid_index(static_cast<int>(v) % kCells, static_cast<int>(u) % kCells, kCells)];
  }

 private:
  static constexpr int kCells = 128;
  static constexpr double kCell = 0.25;
  static constexpr double kTile = kCells * kCell;
  static constexpr int kSide = 13;  ///< prepared tiles along each axis

  struct Tile {
    std::array<float, grid_index(kCells + 1, 0, kCells + 1)> heights;
    std::array<std::uint8_t, grid_index(kCells, 0, kCells)> labels;
  };

  const Tile& tile(int ix, int iy) {
    std::unique_ptr<Tile>& slot = tiles_[cell_key(ix, iy)];
    if (!slot) {
      slot = std::make_unique<Tile>();
      build(ix, iy, *slot);
    }
    return *slot;
  }

  void build(int ix, int iy, Tile& tile) const {
    const Vec2 corner{ix * kTile, iy * kTile};
    const double half = kTile / 2;
    const auto segments = segments_near(streets_, corner + Vec2{half, half}, 1.42 * half);
    for (int row = 0; row <= kCells; ++row) {
      for (int column = 0; column <= kCells; ++column) {
        const Vec2 p = corner + Vec2{column * kCell, row * kCell};
        const Ground ground = ground_at(segments, p);
        const double off_street = smooth_step(ground.edge / 0.2);
        const double on_pavement = smooth_step(ground.pavement / 0.4);
        const double across = std::clamp(1 + ground.edge / ground.half_width, 0.0, 1.0);
        const double wild = off_street * (1 - on_pavement);
        const double uneven = config_.roughness * (0.3 + 0.7 * wild);
        const auto sample = grid_index(row, column, kCells + 1);
        double height = hills(p) + uneven * (0.6 * bumps(p, 4.0, 1) + 0.4 * bumps(p, 1.1, 2));
        height += config_.kerb * off_street * (0.5 + 0.5 * on_pavement);
        height -= 0.02 * ground.half_width * across * across * (1 - off_street);
        tile.heights[sample] = static_cast<float>(height);
        if (row < kCells && column < kCells) {
          const std::uint16_t label = ground.edge < 0       ? config_.street_label
                                      : ground.pavement > 0 ? kClasses.sidewalk
                                                            : config_.open_label;
          tile.labels[grid_index(row, column, kCells)] = static_cast<std::uint8_t>(label);
        }
      }
    }
  }

  double hills(Vec2 p) const {
    double height = 0;
    for (const Wave& wave : waves_) {
      height += wave.amplitude * std::sin(dot(wave.number, p) + wave.phase);
    }
    return height;
  }

  /// Random heights in [-1, 1] with this wavelength (m).
  double bumps(Vec2 p, double wavelength, std::uint64_t salt) const {
    const double u = p.x / wavelength, v = p.y / wavelength;
    const double iu = std::floor(u), iv = std::floor(v);
    const auto corner = [&](double du, double dv) {
      const auto a = static_cast<std::uint64_t>(static_cast<std::int64_t>(iu + du));
      const auto b = static_cast<std::uint64_t>(static_cast<std::int64_t>(iv + dv));
      return 2 * static_cast<double>(unit_float(mix(mix(salt_ + salt, a), b))) - 1;
    };
    const double fu = smooth_step(u - iu), fv = smooth_step(v - iv);
    const double low = corner(0, 0) * (1 - fu) + corner(1, 0) * fu;
    const double high = corner(0, 1) * (1 - fu) + corner(1, 1) * fu;
    return low * (1 - fv) + high * fv;
  }

  /// Samples from the first prepared tile, which has this index, to coordinate `v` (m).
  static float samples(float v, int first_tile) {
    return v * static_cast<float>(1 / kCell) - static_cast<float>(first_tile * kCells);
  }
  /// The prepared tile at these samples, or null.
  const Tile* near_tile(float u, float v) const {
    if (u <= -1 || v <= -1 || u >= kSide * kCells || v >= kSide * kCells) return nullptr;
    const int row = static_cast<int>(v) / kCells, column = static_cast<int>(u) / kCells;
    const Tile* const tile = near_[grid_index(row, column, kSide)];
    return tile;
  }

  float height_near(float x, float y) const {
    const float u = samples(x, near_x_), v = samples(y, near_y_);
    const Tile* t = u < 0 || v < 0 ? nullptr : near_tile(u, v);
    if (t == nullptr) return -1e9F;
    const int column = static_cast<int>(u), row = static_cast<int>(v);
    const float fu = u - static_cast<float>(column), fv = v - static_cast<float>(row);
    const float* s = &t->heights[grid_index(row % kCells, column % kCells, kCells + 1)];
    const float low = s[0] + fu * (s[1] - s[0]);
    const float high = s[kCells + 1] + fu * (s[kCells + 2] - s[kCells + 1]);
    return low + fv * (high - low);
  }

  TerrainConfig config_;
  std::vector<Street> streets_;
  std::uint64_t salt_;
  struct Wave {
    Vec2 number;
    double amplitude, phase;
  };
  std::vector<Wave> waves_;
  float steepest_;
  std::unordered_map<std::uint64_t, std::unique_ptr<Tile>> tiles_;
  std::array<const Tile*, grid_index(kSide, 0, kSide)> near_{};
  int near_x_ = 0, near_y_ = 0;  ///< indices of the first prepared tile
  float low_ = 0, high_ = 0;
};

}  // namespace dynains::simulation
