// Small labelled scans for tests of the evaluation.
#pragma once

#include "dynains/evaluation/scan.hpp"
#include "dynains/evaluation/truth.hpp"
#include "support/random.hpp"
#include "support/standard.hpp"

namespace dynains::evaluation::testing {

inline constexpr std::uint32_t kRoad = 40;
inline constexpr std::uint32_t kMovingCar = 252;

/// A scan that owns its data.
struct OwnedScan {
  std::vector<float> xyz;
  std::vector<std::uint32_t> truth;
  std::vector<std::uint8_t> in_map;
  std::vector<std::uint8_t> causes;
  Eigen::Isometry3d T_world_sensor = Eigen::Isometry3d::Identity();

  void add(float x, float y, float z, std::uint32_t label, unsigned held_by = 0) {
    xyz.insert(xyz.end(), {x, y, z});
    truth.push_back(label);
    in_map.push_back(static_cast<std::uint8_t>(held_by));
  }

  LabelledScan view() const {
    LabelledScan scan;
    scan.xyz = xyz.data();
    scan.T_world_sensor = T_world_sensor;
    scan.truth = truth;
    scan.in_map = in_map;
    scan.causes = causes;
    return scan;
  }
};

inline ScanSource source_of(const std::vector<OwnedScan>& scans) {
  return [&scans](std::size_t index, LabelledScan& scan) {
    if (index >= scans.size()) return false;
    scan = scans[index].view();
    return true;
  };
}

using test::Random;

inline bool chance(Random& random, double probability) {
  return random.uniform(0, 1) < probability;
}

/// Scans of a small box of points. Truths, ignored points and two estimates mix in most voxels of
/// 0.2 m. The sensor turns and moves. Some points are no returns or not finite.
inline std::vector<OwnedScan> mixed_scans(std::uint64_t seed, std::size_t scans,
                                          std::size_t points_per_scan) {
  Random random(seed);
  std::vector<OwnedScan> result(scans);
  for (std::size_t s = 0; s < scans; ++s) {
    OwnedScan& scan = result[s];
    scan.T_world_sensor = Eigen::Translation3d(500.0 + random.uniform(0, 0.5), -300.0, 2.0) *
                          Eigen::AngleAxisd(random.uniform(-0.2, 0.2), Eigen::Vector3d::UnitZ());
    for (std::size_t i = 0; i < points_per_scan; ++i) {
      const bool moving = chance(random, 0.4);
      const std::uint32_t label = chance(random, 0.1) ? 0 : moving ? kMovingCar : kRoad;
      // Estimate 0 is mostly right, estimate 1 nearly random.
      const unsigned held =
          (chance(random, moving ? 0.2 : 0.8) ? 1U : 0U) | (chance(random, 0.5) ? 2U : 0U);
      auto x = static_cast<float>(random.uniform(0.5, 3.0));
      const auto y = static_cast<float>(random.uniform(-1.5, 1.5));
      const auto z = static_cast<float>(random.uniform(-0.3, 0.6));
      if (chance(random, 0.01)) x = std::numeric_limits<float>::quiet_NaN();
      if (chance(random, 0.01)) {
        scan.add(0, 0, 0, label, held);
      } else {
        scan.add(x, y, z, label, held);
      }
    }
  }
  return result;
}

}  // namespace dynains::evaluation::testing
