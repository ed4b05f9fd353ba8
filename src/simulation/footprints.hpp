// Rectangles on the ground that objects occupy.
#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "simulation/vector.hpp"

namespace dynains::simulation {

/// Oriented rectangle on the ground.
struct Footprint {
  Vec2 centre;
  double heading = 0;
  double half_length = 0, half_width = 0;
};

/// Distance from a point to the rectangle, 0 inside.
double distance(const Footprint& footprint, Vec2 p);
bool overlap(const Footprint& a, const Footprint& b);

/// Rectangles that are found by place.
class FootprintSet {
 public:
  void add(const Footprint& footprint);
  /// True if the rectangle, grown by `margin` (m), touches no rectangle of the set.
  bool is_free(const Footprint& footprint, double margin = 0.1) const;
  /// Rectangles whose surroundings contain `p`; the nearest 12 m at least.
  template <class Visitor>
  void visit_near(Vec2 p, Visitor&& visitor) const {
    const auto found = cells_.find(key(p));
    if (found == cells_.end()) return;
    for (const Footprint& footprint : found->second) visitor(footprint);
  }

 private:
  static constexpr double kCell = 24.0;
  static std::uint64_t key(Vec2 p);

  std::unordered_map<std::uint64_t, std::vector<Footprint>> cells_;
};

}  // namespace dynains::simulation
