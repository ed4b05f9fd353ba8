#include "tile_point.hpp"

#include <algorithm>
#include <cmath>

#include "dynains/errors.hpp"

namespace dynains::viewer {
namespace {

constexpr double kMargin = 1.0;  // m, around the box

}  // namespace

TileCube::TileCube(const Eigen::Vector3d& lowest, const Eigen::Vector3d& highest)
    : corner_((lowest.array() - kMargin).floor()) {
  if (!lowest.allFinite() || !highest.allFinite()) {
    throw ConfigError("TileCube: expected finite bounds");
  }
  const double needed = ((highest - corner_).array() + kMargin).maxCoeff();
  edge_ = std::exp2(std::ceil(std::log2(std::max(needed, 1.0))));
}

std::array<std::uint32_t, 3> TileCube::place_of(const Eigen::Vector3d& world) const {
  std::array<std::uint32_t, 3> place{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<Eigen::Index>(axis);
    const double steps = std::floor((world[i] - corner_[i]) / step());
    // The comparison is false for NaN.
    if (!(steps >= 0.0 && steps < 0x1p32)) {
      throw ConfigError("TileCube: a point lies outside of the announced bounds");
    }
    place[axis] = static_cast<std::uint32_t>(steps);
  }
  return place;
}

Eigen::Vector3d TileCube::to_world(const std::array<std::uint32_t, 3>& place) const {
  return corner_ + step() * Eigen::Vector3d(place[0], place[1], place[2]);
}

TileNode TileNode::child(unsigned octant) const {
  TileNode node = *this;
  node.name_ += static_cast<char>('0' + octant);
  ++node.depth_;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    node.corner_[axis] |= (octant >> axis & 1U) << static_cast<unsigned>(32 - node.depth_);
  }
  return node;
}

unsigned TileNode::octant_of(const TilePoint& point) const {
  const auto shift = static_cast<unsigned>(31 - depth_);
  return (point.place[0] >> shift & 1U) | (point.place[1] >> shift & 1U) << 1U |
         (point.place[2] >> shift & 1U) << 2U;
}

std::uint32_t TileNode::cell_of(const TilePoint& point) const {
  const auto shift = static_cast<unsigned>(32 - depth_ - kGridBits);
  constexpr std::uint32_t kMask = (1U << kGridBits) - 1U;
  return (point.place[0] >> shift & kMask) | (point.place[1] >> shift & kMask) << kGridBits |
         (point.place[2] >> shift & kMask) << (2U * kGridBits);
}

bool is_tile_node_name(const std::string& name) {
  return !name.empty() && name.size() <= 1 + TileNode::kMostDepth && name[0] == 'r' &&
         name.find_first_not_of("01234567", 1) == name.npos;
}

}  // namespace dynains::viewer
