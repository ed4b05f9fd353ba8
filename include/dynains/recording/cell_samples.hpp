// Samples that represent the points of a cell in tests of free space.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/evidence/visibility.hpp"
#include "dynains/points.hpp"
#include "dynains/recording/world_cells.hpp"
#include "dynains/simd/pack_loops.hpp"

namespace dynains {

/// The first point of each octant of a cube, in 1/256 of its edge.
struct CellSamples {
  std::uint8_t octants = 0;  ///< bits of those that have a sample
  std::array<std::array<std::uint8_t, 3>, 8> samples;

  bool has(unsigned octant) const { return (octants >> octant & 1U) != 0; }
  /// Bits of octants, from bits of samples in the order of their octants.
  std::uint32_t octants_of(std::uint64_t of_samples) const {
    std::uint32_t result = 0;
    for (unsigned octant = 0; octant < samples.size(); ++octant) {
      if (!has(octant)) continue;
      result |= static_cast<std::uint32_t>(of_samples & 1U) << octant;
      of_samples >>= 1U;
    }
    return result;
  }
  /// Adds the sample of an octant without one. `within`: place of the point in the cube, [0, 1]
  /// along each axis.
  void add(unsigned octant, const Eigen::Array3d& within) {
    octants = static_cast<std::uint8_t>(octants | 1U << octant);
    for (int axis = 0; axis < 3; ++axis) {
      const double step = std::min(255.0, std::max(0.0, 256.0 * within[axis]));
      samples[octant][static_cast<std::size_t>(axis)] = static_cast<std::uint8_t>(step);
    }
  }
};

/// The samples of cells, for tests by references.
class TestedCells {
 public:
  /// Takes cells with all of their samples at the first call; none may be added afterwards. `edge`:
  /// of the cells, m. `samples_of(i)`: CellSamples of cell number i.
  template <class SamplesOf>
  void take(const std::vector<VoxelKey>& cells, double edge, SamplesOf&& samples_of) {
    if (size() == cells.size()) return;
    origin_ = corner_of(cells.front(), edge);
    points_.resize(8 * cells.size() + detail::kPackWidth);
    begin_.assign(1, 0);
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const CellSamples& cell = samples_of(i);
      const Eigen::Vector3d corner = corner_of(cells[i], edge) - origin_;
      std::uint32_t count = begin_.back();
      for (unsigned octant = 0; octant < cell.samples.size(); ++octant) {
        if (!cell.has(octant)) continue;
        const Eigen::Map<const Eigen::Array<std::uint8_t, 3, 1>> steps(cell.samples[octant].data());
        const Eigen::Array3d within = edge / 256.0 * (steps.cast<double>() + 0.5);
        const Eigen::Vector3f point = (corner.array() + within).cast<float>();
        points_.x[count] = point.x();
        points_.y[count] = point.y();
        points_.z[count++] = point.z();
      }
      begin_.push_back(count);
    }
  }
  std::size_t size() const { return begin_.size() - 1; }
  std::size_t memory_bytes() const { return 4 * (begin_.capacity() + 3 * points_.size()); }

  /// Calls `visit(i, bits)` for each cell within range of a sensor (m, frame of the cells) of which
  /// some sample is free or hit. `bits`: detail::Visibility::Bits of its samples.
  /// `test_visibility(points, count, origin)`: see detail::test_visibility(); points relative to
  /// `origin`, m, with the axes of the cells.
  template <class TestVisibility, class Visit>
  void test(const Eigen::Vector3d& sensor, TestVisibility&& test_visibility, Visit&& visit) const {
    if (size() == 0) return;
    const detail::Visibility& visibility =
        test_visibility(points_, std::size_t{begin_.back()}, origin_);
    const Eigen::Vector2f at = (sensor - origin_).head<2>().cast<float>();
    for (std::size_t i = 0; i < size(); ++i) {
      const Eigen::Vector2f first(points_.x[begin_[i]], points_.y[begin_[i]]);
      if ((first - at).squaredNorm() > static_cast<float>(kTestRange * kTestRange)) continue;
      const detail::Visibility::Bits seen = visibility.bits(begin_[i], begin_[i + 1]);
      if ((seen.free | seen.hit) != 0) visit(i, seen);
    }
  }

 private:
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
  std::vector<std::uint32_t> begin_ = {0};  // by cell: first sample, and the end
  PointBuffer points_;                      // m, relative to the origin; padded for packs
};

}  // namespace dynains
