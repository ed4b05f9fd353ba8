// The points of a scan that its pose is corrected by.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/ground/ground_split.hpp"
#include "dynains/points.hpp"

namespace dynains::detail {

/// Instances of the non-ground points of a scan. Without: no point is on an instance.
struct ScanInstances {
  Span<const std::uint32_t> of_point;  ///< below `count`, or kNoCluster
  std::size_t count = 0;
};

/// Calls `visit(index, x, y, z)` for about `wanted` points of a scan, 3 to 50 m from the sensor.
/// They are spread evenly over its order, at pseudo-random distances, since beams repeat at regular
/// ones.
template <class Visit>
void visit_some(const GroundSplit& split, std::size_t wanted, Visit&& visit) {
  constexpr double kNearest = 3.0, kFarthest = 50.0;  // m, horizontal
  const std::size_t step = split.count / wanted + 1;
  std::uint32_t random = 1;
  for (std::size_t begin = 0; begin < split.count; begin += step) {
    random = random * 1664525U + 1013904223U;
    const std::size_t i = step == 1 ? begin : begin + (random >> 8) % step;  // division is slow
    if (i >= split.count) return;
    const double x = static_cast<double>(split.points.x[i]);
    const double y = static_cast<double>(split.points.y[i]);
    const double squared = x * x + y * y;
    if (squared < kNearest * kNearest || squared > kFarthest * kFarthest) continue;
    visit(i, x, y, static_cast<double>(split.points.z[i]));
  }
}

/// About 3,000 points of a scan (m, sensor frame). Tells which of them are on objects that are
/// small enough to be vehicles or persons.
class AlignmentPoints {
 public:
  static constexpr std::size_t kMost = 3072;

  /// Points on instances of at most this horizontal diagonal and height (m) are on objects.
  AlignmentPoints(double longest_object, double highest_object)
      : longest_object_(longest_object), highest_object_(highest_object) {}

  /// Allocates memory for all points.
  void reserve() {
    points_.grow(kMost);
    instance_of_.reserve(kMost);
  }

  void select(const GroundSplit& split, const ScanInstances& instances) {
    constexpr std::size_t kWanted = 3000;
    points_.clear();
    instance_of_.clear();
    boxes_.assign(instances.count, Box());
    visit_some(split, kWanted, [&](std::size_t i, double x, double y, double z) {
      points_.push_back(split.points.x[i], split.points.y[i], split.points.z[i]);
      const bool has_instance = i >= split.ground_count && !instances.of_point.empty();
      const std::uint32_t instance =
          has_instance ? instances.of_point[i - split.ground_count] : kNoCluster;
      instance_of_.push_back(instance);
      if (instance != kNoCluster) boxes_[instance].add(x, y, z);
    });
  }

  PointsView points() const { return points_; }

  bool is_on_object(std::size_t point) const {
    const std::uint32_t instance = instance_of_[point];
    if (instance == kNoCluster) return false;
    const Box& box = boxes_[instance];
    return box.length() <= longest_object_ && box.height() <= highest_object_;
  }

 private:
  /// Around points, m.
  struct Box {
    double least[3] = {kFar, kFar, kFar};
    double most[3] = {-kFar, -kFar, -kFar};

    void add(double x, double y, double z) {
      const double point[3] = {x, y, z};
      for (int k = 0; k < 3; ++k) {
        least[k] = std::min(least[k], point[k]);
        most[k] = std::max(most[k], point[k]);
      }
    }
    double length() const { return std::hypot(most[0] - least[0], most[1] - least[1]); }
    double height() const { return most[2] - least[2]; }

    static constexpr double kFar = 1e9;
  };

  double longest_object_, highest_object_;
  PointBuffer points_;
  std::vector<std::uint32_t> instance_of_;  // by point
  std::vector<Box> boxes_;                  // by instance, of its selected points
};

}  // namespace dynains::detail
