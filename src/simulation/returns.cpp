#include "simulation/returns.hpp"

#include <algorithm>
#include <cmath>

#include "simulation/materials.hpp"
#include "simulation/random.hpp"

namespace dynains::simulation {
namespace {

float power_of(const Surface& surface, float share) {
  return share * surface.reflectivity / std::max(surface.range * surface.range, 0.01F);
}

/// The return of two surfaces, `share` of the beam on the first: one if they are less than 1.5 m
/// apart, which is of neither if it lies more than 0.25 m from both.
Surface one_return(const Surface& own, const Surface& other, float share) {
  if (std::abs(own.range - other.range) > 1.5F) {
    return power_of(own, share) >= power_of(other, 1 - share) ? own : other;
  }
  Surface result = share >= 0.5F ? own : other;
  result.range = share * own.range + (1 - share) * other.range;
  if (std::min(std::abs(result.range - own.range), std::abs(result.range - other.range)) > 0.25F) {
    result.label = semantic::kOutlier;
  }
  return result;
}

}  // namespace

bool Returns::is_lost(std::size_t column, std::uint64_t seed) const {
  if (config_.packet_loss <= 0) return false;
  return unit_float(mix(mix(seed, 15), column / model_.packet)) <
         static_cast<float>(config_.packet_loss);
}

float Returns::bias_of(int laser) const {
  if (config_.beam_bias <= 0) return 0;
  return static_cast<float>(config_.beam_bias) *
         normal_float(mix(mix(config_.seed, 13), static_cast<std::uint64_t>(laser)));
}

Surface Returns::mixed(const Surfaces& surfaces, const BeamTable& beams, std::size_t i,
                       std::size_t columns, std::uint64_t random) const {
  const Surface& own = *surfaces[i];
  if (config_.divergence <= 0) return own;
  const bool later = unit_float(mix(random, 7)) < 0.5F;
  const std::size_t column = i % columns;
  if (later ? column + 1 == columns : column == 0) return own;
  const std::size_t beside = later ? i + 1 : i - 1;
  if (!surfaces[beside]) return own;
  const auto& order = beams.measured_order();
  const float gap = norm(beams.direction(order[i]) - beams.direction(order[beside]));
  // The edge lies anywhere between the two beams, within half a width with this probability.
  const auto width = static_cast<float>(config_.divergence * kPi / 180);
  if (unit_float(mix(random, 8)) * gap >= width) return own;
  return one_return(own, *surfaces[beside], 0.5F + 0.5F * unit_float(mix(random, 9)));
}

std::optional<Surface> Returns::at(const Surfaces& surfaces, const BeamTable& beams, std::size_t i,
                                   BeamTable::Columns columns, std::uint64_t seed) const {
  const auto count = static_cast<std::size_t>(columns.last - columns.first);
  const std::size_t column = static_cast<std::size_t>(columns.first) + i % count;
  if (!surfaces[i] || is_lost(column, seed)) return std::nullopt;
  Surface result = mixed(surfaces, beams, i, count, mix(seed, beams.measured_order()[i]));
  result.range += bias_of(model_.laser_of(i, count));
  return result;
}

}  // namespace dynains::simulation
