// Visibility bits of a reference, given sample by sample.
#pragma once

#include "dynains/evidence/visibility.hpp"
#include "dynains/points.hpp"
#include "support/standard.hpp"

namespace dynains::test {

enum class BeamResult : std::uint8_t { kUnknown, kFree, kHit };

inline detail::Visibility visibility_of(const std::vector<BeamResult>& seen) {
  detail::Visibility visibility;
  visibility.resize(seen.size());
  const detail::Visibility::Bytes bytes = visibility.bytes();
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const auto set = [i](std::uint8_t* to, bool value) {
      const unsigned others = i % 8 == 0 ? 0U : to[i / 8];
      to[i / 8] = static_cast<std::uint8_t>(others | (value ? 1U : 0U) << i % 8);
    };
    set(bytes.free, seen[i] == BeamResult::kFree);
    set(bytes.hit, seen[i] == BeamResult::kHit);
  }
  return visibility;
}

/// Visibility of the first `count` points (m, relative to `sensor`), of which `beam(position)`
/// tells, m, world frame.
template <class Beam>
detail::Visibility visibility_by(const Beam& beam, const PointBuffer& points, std::size_t count,
                                 const Eigen::Vector3d& sensor) {
  std::vector<BeamResult> seen(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3f local(points.x[i], points.y[i], points.z[i]);
    seen[i] = beam(sensor + local.cast<double>());
  }
  return visibility_of(seen);
}

}  // namespace dynains::test
