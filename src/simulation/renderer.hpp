// Nearest surface along every beam of a scan.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "simulation/beams.hpp"
#include "simulation/primitive.hpp"
#include "simulation/random.hpp"

namespace dynains::simulation {

/// Distance from the origin that no part of the primitive undercuts.
inline float nearest_distance(const Primitive& primitive) {
  const Vec3 p = primitive.to_unit * (-1.0F * primitive.centre);
  const Vec3 inside{std::clamp(p.x, -1.0F, 1.0F), std::clamp(p.y, -1.0F, 1.0F),
                    std::clamp(p.z, -1.0F, 1.0F)};
  return norm(primitive.centre + primitive.from_unit * inside);
}

inline std::uint64_t cell_hash(Vec3 p, float size, std::uint64_t salt) {
  const auto ix = static_cast<std::int64_t>(std::floor(p.x / size));
  const auto iy = static_cast<std::int64_t>(std::floor(p.y / size));
  const auto iz = static_cast<std::int64_t>(std::floor(p.z / size));
  const auto key = static_cast<std::uint64_t>((ix * 73856093) ^ (iy * 19349663) ^ (iz * 83492791));
  return mix(key ^ salt);
}

/// Range (m) at which a beam ends within a porous shape, or a negative number. Beams collide at
/// random with constant density; collisions in lasting gaps are void (Woodcock tracking).
inline float porous_hit(const Primitive& primitive, std::uint64_t salt, Vec3 direction, float enter,
                        float leave, std::uint64_t random) {
  const Material& material = *primitive.material;
  const bool clumped = material.clump > 0;
  const float density = clumped ? 1.7F * material.density : material.density;
  float t = enter;
  for (int i = 0; i < 32; ++i) {
    random = mix(random + 0x9e3779b97f4a7c15ULL);
    t -= std::log(unit_float(random) + 3e-8F) / density;
    if (t >= leave) return -1;
    if (!clumped) return t;
    // Gaps stay where they are in the shape's own frame.
    const Vec3 unit = primitive.to_unit * (t * direction - primitive.centre);
    const Vec3 metres{unit.x * norm(transposed(primitive.from_unit).x),
                      unit.y * norm(transposed(primitive.from_unit).y),
                      unit.z * norm(transposed(primitive.from_unit).z)};
    if (unit_float(cell_hash(metres, material.clump, salt)) < 0.6F) return t;
  }
  return -1;
}

/// A hit on a facade: windows lie deeper, and some let the beam into the room.
inline void look_through_window(const Primitive& primitive, std::uint64_t salt, Vec3 direction,
                                float leave, std::uint64_t random, float& range, float& loss) {
  const Vec3 unit = primitive.to_unit * (range * direction - primitive.centre);
  const float ax = std::abs(unit.x), ay = std::abs(unit.y), az = std::abs(unit.z);
  if (az >= ax && az >= ay) return;
  const Mat3 half_axes = transposed(primitive.from_unit);
  const bool front = ay >= ax;
  const float along = (front ? unit.x : unit.y) * norm(front ? half_axes.x : half_axes.y);
  const float up = (unit.z + 1) * norm(half_axes.z) - 1.0F;
  const float u = along / primitive.material->window_spacing, v = up / 3.0F;
  const float part_u = u - std::floor(u), part_v = v - std::floor(v);
  if (part_u < 0.28F || part_u > 0.72F || part_v < 0.3F || part_v > 0.8F || up < 0.5F) return;
  const Vec3 normal = surface_normal(primitive, range * direction);
  const float cosine = std::max(0.05F, -dot(normal, direction));
  const std::uint64_t room =
      mix(salt ^ mix(static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(u)) * 1009 +
                                                static_cast<std::int64_t>(std::floor(v)))));
  const float which = unit_float(random);
  float deeper = 0.15F;
  if (which < 0.2F) {
    deeper = 0.6F + 3.0F * unit_float(room);
  } else if (which < 0.6F) {
    loss = 1.0F;
  }
  range = std::min(range + deeper / cosine, leave);
}

/// All beams start in one point, so the scan is drawn like a picture: every primitive meets only
/// the beams within its solid angle and keeps those that it shortens.
class Renderer {
 public:
  struct Drawn {
    Primitive primitive;      ///< sensor frame
    std::uint32_t label = 0;  ///< as of a point; without a class: that of the material
    std::uint64_t salt = 0;   ///< lasting identity, for gaps in leaves and rooms behind windows
  };

  struct Hit {
    float range = 0;
    const Drawn* drawn = nullptr;  ///< valid until start(); null: nothing
    float extra_loss = 0;          ///< chance of no return at all: glass
  };

  /// Forgets the last scan; every beam can see as far as `max_range`. A share of the beams passes
  /// through the panes of vehicles.
  void start(const BeamTable& beams, float max_range, std::uint64_t seed, float glass_passes = 0) {
    beams_ = &beams;
    max_range_ = max_range;
    seed_ = seed;
    glass_passes_ = glass_passes;
    drawn_.clear();
    order_.clear();
    hits_.assign(beams.size(), Hit{max_range, nullptr, 0});
  }

  /// Takes note of a primitive, unless it is out of reach.
  void add(const Primitive& primitive, std::uint32_t label, std::uint64_t salt) {
    const float near = nearest_distance(primitive);
    if (near > max_range_) return;
    order_.push_back({near, static_cast<std::uint32_t>(drawn_.size())});
    drawn_.push_back({primitive, label, salt});
  }

  /// Finds the nearest primitive of every beam; random numbers depend on seed, beam and salt only.
  void draw() {
    // From near to far: most beams are short when a distant primitive comes.
    std::sort(order_.begin(), order_.end());
    for (const auto& [near, index] : order_) {
      const Drawn& drawn = drawn_[index];
      const Bounds bounds = bounds_of(drawn.primitive);
      const int first_row = BeamTable::row_of(bounds.low),
                last_row = BeamTable::row_of(bounds.high);
      int first = 0, last = BeamTable::kColumns - 1;
      bool split = false;
      if (bounds.half_azimuth < kPi - 0.01) {
        first = BeamTable::column_of(wrap(bounds.azimuth - bounds.half_azimuth));
        last = BeamTable::column_of(wrap(bounds.azimuth + bounds.half_azimuth));
        split = first > last || (first == last && bounds.half_azimuth > 1);
      }
      for (int row = first_row; row <= last_row; ++row) {
        if (split)
          draw_slots(drawn, near, beams_->first_slot(row, 0), beams_->last_slot(row, last));
        draw_slots(drawn, near, beams_->first_slot(row, first),
                   beams_->last_slot(row, split ? BeamTable::kColumns - 1 : last));
      }
    }
  }

  const std::vector<Hit>& hits() const { return hits_; }

 private:
  struct Bounds {
    double azimuth = 0, half_azimuth = 0, low = 0, high = 0;
  };

  static Bounds bounds_of(const Primitive& primitive) {
    // Extremes of the eight corners, seen from the origin.
    const Vec3 c = primitive.centre;
    const double middle = std::atan2(static_cast<double>(c.y), static_cast<double>(c.x));
    const double cos_middle = std::cos(middle), sin_middle = std::sin(middle);
    double left = -10, right = 10, z_low = 1e9, z_high = -1e9, near = 1e9, far = 0;
    for (int i = 0; i < 8; ++i) {
      const Vec3 corner = c + primitive.from_unit * Vec3{i & 1 ? 1.0F : -1.0F, i & 2 ? 1.0F : -1.0F,
                                                         i & 4 ? 1.0F : -1.0F};
      const auto x = static_cast<double>(corner.x), y = static_cast<double>(corner.y);
      const double forward = x * cos_middle + y * sin_middle;
      const double sideways = y * cos_middle - x * sin_middle;
      const double angle = std::atan2(sideways, forward);
      left = std::max(left, angle);
      right = std::min(right, angle);
      near = std::min(near, forward);
      far = std::max(far, std::sqrt(x * x + y * y));
      z_low = std::min(z_low, static_cast<double>(corner.z));
      z_high = std::max(z_high, static_cast<double>(corner.z));
    }
    near = std::max(near, 1e-3);
    Bounds bounds;
    if (left - right >= kPi) {
      // The z axis may pass through.
      bounds = {0, kPi, -kPi / 2, kPi / 2};
      near = 1e-3;
    } else {
      bounds.azimuth = wrap(middle + 0.5 * (left + right));
      bounds.half_azimuth = 0.5 * (left - right);
    }
    bounds.high = std::atan2(z_high, z_high > 0 ? near : far);
    bounds.low = std::atan2(z_low, z_low < 0 ? near : far);
    return bounds;
  }

  /// `near`: m, no part of it lies nearer.
  void draw_slots(const Drawn& drawn, float near, std::size_t begin, std::size_t end) {
    const Primitive& primitive = drawn.primitive;
    const bool porous = primitive.material->density > 0;
    const bool windows = primitive.material->window_spacing > 0;
    const bool pane = glass_passes_ > 0 && primitive.material == &kMaterials.glass;
    for (std::size_t slot = begin; slot < end; ++slot) {
      Hit& hit = hits_[slot];
      if (hit.range <= near) continue;
      const Vec3 direction = beams_->direction(slot);
      const Interval interval = intersect(primitive, {}, direction);
      if (interval.empty() || interval.leave <= 0) continue;
      if (pane && unit_float(mix(~seed_ ^ drawn.salt, slot)) < glass_passes_) continue;
      float range = interval.enter, loss = 0;
      if (porous) {
        range = porous_hit(primitive, drawn.salt, direction, std::max(range, 0.0F),
                           std::min(interval.leave, hit.range), mix(seed_ ^ drawn.salt, slot));
      } else if (windows && range > 0 && range < hit.range) {
        look_through_window(primitive, drawn.salt, direction, interval.leave,
                            mix(seed_ ^ drawn.salt, slot), range, loss);
      }
      if (range <= 0 || range >= hit.range) continue;
      hit = {range, &drawn, loss};
    }
  }

  const BeamTable* beams_ = nullptr;
  float max_range_ = 0;
  std::uint64_t seed_ = 0;
  float glass_passes_ = 0;
  std::vector<Drawn> drawn_;
  std::vector<std::pair<float, std::uint32_t>> order_;
  std::vector<Hit> hits_;
};

}  // namespace dynains::simulation
