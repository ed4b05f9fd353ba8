// Height and class of the ground.
#pragma once

#include <array>
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

/// The ground is a height field with 0.25 m between samples, made tile by tile where it is asked
/// for, from hills, unevenness, kerbs and the crown of the road.
class Terrain {
 public:
  Terrain(const TerrainConfig& config, std::vector<Street> streets, Random random);

  const std::vector<Street>& streets() const { return streets_; }
  /// Distance to the edge of the nearest carriageway, negative on it. At most 12 m.
  double distance_to_street(Vec2 p) const;
  double height(Vec2 p);

  /// Prepares rays from around `centre`.
  void prepare(Vec2 centre, double radius);
  /// Distance to the ground along a ray in world axes (origin relative to world), or a negative
  /// number if nothing is hit before `t_max`. Only within the radius of `prepare()`.
  float cast(Vec3 origin, Vec3 direction, float t_max) const;
  /// Upward unit normal and class at a point within the prepared region.
  Vec3 normal_near(float x, float y) const;
  std::uint16_t label_near(float x, float y) const;

 private:
  static constexpr int kCells = 128;
  static constexpr double kCell = 0.25;
  static constexpr double kTile = kCells * kCell;
  static constexpr int kSide = 13;  ///< prepared tiles along each axis

  struct Tile {
    std::array<float, grid_index(kCells + 1, 0, kCells + 1)> heights;
    std::array<std::uint8_t, grid_index(kCells, 0, kCells)> labels;
  };

  const Tile& tile(int ix, int iy);
  void build(int ix, int iy, Tile& tile) const;
  double hills(Vec2 p) const;
  /// Random heights in [-1, 1] with this wavelength (m).
  double bumps(Vec2 p, double wavelength, std::uint64_t salt) const;
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
  float height_near(float x, float y) const;

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
