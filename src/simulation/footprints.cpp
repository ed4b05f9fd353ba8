#include "simulation/footprints.hpp"

#include <algorithm>
#include <cmath>

namespace dynains::simulation {
namespace {

Vec2 local(const Footprint& footprint, Vec2 p) {
  const Vec2 u = direction(footprint.heading), d = p - footprint.centre;
  return {dot(d, u), dot(d, left_of(u))};
}

/// True if no axis of `a` separates the two rectangles.
bool axes_overlap(const Footprint& a, const Footprint& b) {
  const Vec2 centre = local(a, b.centre);
  const double c = std::abs(std::cos(b.heading - a.heading));
  const double s = std::abs(std::sin(b.heading - a.heading));
  return std::abs(centre.x) <= a.half_length + c * b.half_length + s * b.half_width &&
         std::abs(centre.y) <= a.half_width + s * b.half_length + c * b.half_width;
}

}  // namespace

double distance(const Footprint& footprint, Vec2 p) {
  const Vec2 q = local(footprint, p);
  return norm(Vec2{std::max(std::abs(q.x) - footprint.half_length, 0.0),
                   std::max(std::abs(q.y) - footprint.half_width, 0.0)});
}

bool overlap(const Footprint& a, const Footprint& b) {
  return axes_overlap(a, b) && axes_overlap(b, a);
}

std::uint64_t FootprintSet::key(Vec2 p) {
  return cell_key(static_cast<int>(std::floor(p.x / kCell)),
                  static_cast<int>(std::floor(p.y / kCell)));
}

void FootprintSet::add(const Footprint& footprint) {
  // Every cell within reach of the rectangle's surroundings lists it.
  const double reach = norm(Vec2{footprint.half_length, footprint.half_width}) + kCell / 2;
  const Vec2 c = footprint.centre;
  for (double x = std::floor((c.x - reach) / kCell); x * kCell <= c.x + reach; ++x) {
    for (double y = std::floor((c.y - reach) / kCell); y * kCell <= c.y + reach; ++y) {
      cells_[key({(x + 0.5) * kCell, (y + 0.5) * kCell})].push_back(footprint);
    }
  }
}

bool FootprintSet::is_free(const Footprint& footprint, double margin) const {
  Footprint grown = footprint;
  grown.half_length += margin;
  grown.half_width += margin;
  // Long rectangles are asked piece by piece, so that the cells of their middle suffice.
  const Vec2 u = direction(grown.heading);
  bool free = true;
  const auto pieces = static_cast<int>(std::ceil(grown.half_length / 10.0));
  for (int i = 0; i < pieces && free; ++i) {
    const double offset = grown.half_length * ((2 * i + 1.0) / pieces - 1);
    visit_near(grown.centre + offset * u,
               [&](const Footprint& other) { free = free && !overlap(grown, other); });
  }
  return free;
}

}  // namespace dynains::simulation
