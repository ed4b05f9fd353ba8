// Views of the instances of one scan: what references tell that look at them from the side of the
// scan, and which references look from another side. Goes beyond the paper.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "dynains/evidence/instance_samples.hpp"

namespace dynains::detail {

/// An object that stands hides from other sides the surfaces that a scan measured, and beams that
/// graze its edges pass them. So free samples of a reference on another side are no evidence where
/// references on the side of the scan hit the instance and none of them saw it free.
class InstanceViews {
 public:
  /// Position, m, in the sensor frame of the scan.
  using Position = std::array<float, 3>;

  /// Forgets all references. Computes the centres of the instances of a new scan.
  void begin(const InstanceSamples& samples) {
    views_.resize(samples.instance_count());
    std::uint32_t at = 0;
    for (std::size_t instance = 0; instance < views_.size(); ++instance) {
      const std::uint32_t begin = at;
      at += samples.count(instance);
      views_[instance] = View();
      for (std::uint32_t i = begin; i < at; ++i) {
        views_[instance].sum[0] += samples.points.x[i];
        views_[instance].sum[1] += samples.points.y[i];
        views_[instance].sum[2] += samples.points.z[i];
      }
      views_[instance].count = static_cast<float>(at - begin);
    }
  }

  /// Sets the position of the reference of the next calls.
  void look_from(const Position& reference) {
    for (View& view : views_) view.is_other_side = is_other_side(view, reference);
  }

  /// Whether free samples of the reference are no evidence on an instance.
  bool is_contradicted(std::size_t instance) const {
    const View& view = views_[instance];
    return view.is_other_side && view.hits >= kFewestHits && !view.was_free;
  }

  /// Takes into account that the reference sees enough of an instance. `free_ratio`: ratio of free
  /// to visible samples.
  void add(std::size_t instance, float free_ratio) {
    View& view = views_[instance];
    if (view.is_other_side) return;
    if (free_ratio <= kHit && view.hits < kFewestHits) ++view.hits;
    if (free_ratio >= kFree) view.was_free = true;
  }

 private:
  static constexpr float kCosine = 0.9396926F;    // of 20 deg, the largest angle on the own side
  static constexpr std::uint8_t kFewestHits = 6;  // references
  static constexpr float kHit = 0.15F, kFree = 0.5F;  // ratios of free to visible samples

  struct View {
    Position sum = {};  // of the positions of the samples
    float count = 0.0F;
    std::uint8_t hits = 0;  // references on the side of the scan that hit the instance
    bool was_free = false;  // a reference on the side of the scan saw the instance free
    bool is_other_side = false;
  };

  // Whether the directions from an instance to the sensor and to the reference differ by more than
  // the largest angle. All vectors are scaled by the number of samples.
  static bool is_other_side(const View& view, const Position& reference) {
    float product = 0.0F, to_sensor = 0.0F, to_reference = 0.0F;
    for (std::size_t i = 0; i < 3; ++i) {
      const float other = view.sum[i] - view.count * reference[i];
      product += view.sum[i] * other;
      to_sensor += view.sum[i] * view.sum[i];
      to_reference += other * other;
    }
    return product < kCosine * std::sqrt(to_sensor) * std::sqrt(to_reference);
  }

  std::vector<View> views_;  // by instance
};

}  // namespace dynains::detail
