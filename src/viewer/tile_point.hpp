// Points in the integer coordinates of an octree.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>

namespace dynains::viewer {

/// A point and its attributes; those that a tileset lacks are 0.
struct TilePoint {
  double time = 0.0;
  std::array<std::uint32_t, 3> place{};  ///< x, y, z in steps of its TileCube
  float intensity = 0.0F;
  std::uint32_t label = 0;
  std::uint16_t session = 0;
};

/// The cube that an octree halves on each axis, level by level.
class TileCube {
 public:
  /// The smallest cube with an edge of 2^k m, k >= 0, around the box; m, world frame.
  TileCube(const Eigen::Vector3d& lowest, const Eigen::Vector3d& highest);

  double edge() const { return edge_; }            ///< m
  double step() const { return edge_ * 0x1p-32; }  ///< m, of TilePoint::place

  /// Throws ConfigError for a point outside of the cube.
  std::array<std::uint32_t, 3> place_of(const Eigen::Vector3d& world) const;

  /// World position of a place, m.
  Eigen::Vector3d to_world(const std::array<std::uint32_t, 3>& place) const;

 private:
  Eigen::Vector3d corner_;  // m
  double edge_;
};

/// A node of the octree: the cube that is reached by choosing one of eight parts, again and again.
class TileNode {
 public:
  static constexpr int kGridBits = 7;                ///< of the cells of a node, by axis
  static constexpr int kMostDepth = 32 - kGridBits;  ///< then a cell is one step wide

  TileNode() = default;
  TileNode child(unsigned octant) const;

  int depth() const { return depth_; }
  /// "r" for the root, then the octant on each level: x + 2 * y + 4 * z.
  const std::string& name() const { return name_; }
  /// Lowest corner, in steps.
  const std::array<std::uint32_t, 3>& corner() const { return corner_; }

  /// Octant of a point of this node.
  unsigned octant_of(const TilePoint& point) const;
  /// Number of a point's cell among the 2^(3 * kGridBits) cells of this node.
  std::uint32_t cell_of(const TilePoint& point) const;

 private:
  std::string name_ = "r";
  std::array<std::uint32_t, 3> corner_{};
  int depth_ = 0;
};

/// Whether `name` has the form of TileNode::name().
bool is_tile_node_name(const std::string& name);

}  // namespace dynains::viewer
