// A map that counts inserted points and cannot remove any.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "dynains/points.hpp"

namespace dynains::test {

class CountingMap {
 public:
  struct Config {
    template <class Self, class Visitor>
    static void visit(Self&, Visitor&&) {}
    void validate() const {}
  };
  explicit CountingMap(const Config&) {}
  void insert(PointsView points, Span<const std::uint8_t> keep, const Eigen::Isometry3d&) {
    count += keep.empty() ? points.size()
                          : static_cast<std::size_t>(std::count_if(
                                keep.begin(), keep.end(), [](std::uint8_t k) { return k != 0; }));
  }
  void clear() { count = 0; }

  std::size_t count = 0;
};

}  // namespace dynains::test
