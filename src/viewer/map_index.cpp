#include "map_index.hpp"

#include <cmath>
#include <cstddef>

namespace dynains::viewer {
namespace {

using Cell = Eigen::Vector3i;

constexpr float kCell = 0.1F;  // m

Cell cell_of(const Eigen::Vector3f& local) {
  return (local / kCell).array().floor().matrix().cast<int>();
}

std::size_t hash(const Cell& cell) {
  std::uint64_t value = 0;
  for (int axis = 0; axis < 3; ++axis) {
    value = (value + static_cast<std::uint32_t>(cell[axis])) * 0x9E3779B97F4A7C15U;
    value ^= value >> 32U;
  }
  return static_cast<std::size_t>(value);
}

std::size_t power_of_two_above(std::size_t count) {
  std::size_t size = 16;
  while (size < count) size *= 2;
  return size;
}

}  // namespace

MapIndex::MapIndex(const std::vector<ViewPoint>& points)
    : points_(points), first_(power_of_two_above(2 * points.size()), kNone) {
  entries_.reserve(points.size() + points.size() / 4);
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3f margin = Eigen::Vector3f::Constant(kRounding);
    const Cell low = cell_of(points[i].local - margin);
    const Cell high = cell_of(points[i].local + margin);
    // Near a border, a point is listed in all cells in which it may be searched.
    for (int x = low.x(); x <= high.x(); ++x) {
      for (int y = low.y(); y <= high.y(); ++y) {
        for (int z = low.z(); z <= high.z(); ++z) {
          std::uint32_t& first = first_[hash({x, y, z}) & (first_.size() - 1)];
          entries_.push_back({i, first});
          first = static_cast<std::uint32_t>(entries_.size() - 1);
        }
      }
    }
  }
}

std::uint32_t MapIndex::find(const Eigen::Vector3f& local) const {
  std::uint32_t entry = first_[hash(cell_of(local)) & (first_.size() - 1)];
  for (; entry != kNone; entry = entries_[entry].next) {
    const std::uint32_t point = entries_[entry].point;
    if ((points_[point].local - local).cwiseAbs().maxCoeff() < kRounding) return point;
  }
  return kNone;
}

}  // namespace dynains::viewer
