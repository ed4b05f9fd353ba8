// A minimal program: a few scans of a static street.
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <vector>

#include "dynains/dyna_ins_remover.hpp"
#include "dynains/version.hpp"

namespace {

// Flat ground 1.73 m below the sensor, and a wall 8 m to the left of it; m, sensor frame.
std::vector<Eigen::Vector3f> make_street() {
  std::vector<Eigen::Vector3f> points;
  for (float radius = 3.0F; radius < 20.0F; radius += 0.5F) {
    for (float azimuth = -3.1F; azimuth < 3.1F; azimuth += 0.02F) {
      points.emplace_back(radius * std::cos(azimuth), radius * std::sin(azimuth), -1.73F);
    }
  }
  for (float x = -10.0F; x < 10.0F; x += 0.1F) {
    for (float z = -1.5F; z < 1.5F; z += 0.1F) points.emplace_back(x, 8.0F, z);
  }
  return points;
}

std::size_t count_static(const dynains::ScanVerdict& verdict) {
  std::size_t count = 0;
  for (const dynains::PointLabel label : verdict.labels) count += dynains::is_static(label) ? 1 : 0;
  return count;
}

}  // namespace

int main() {
  const std::vector<Eigen::Vector3f> street = make_street();
  constexpr std::size_t kScans = 12;
  std::size_t finished = 0;
  std::size_t kept = 0;
  const auto finish = [&](const dynains::ScanVerdict& verdict) {
    ++finished;
    kept += count_static(verdict);
  };

  dynains::DynaInsRemover remover(dynains::DynaInsRemover::Config::paper());
  for (std::size_t scan = 0; scan < kScans; ++scan) {
    const double time = 0.1 * static_cast<double>(scan);
    const auto result = remover.push(street, Eigen::Isometry3d::Identity(), time);
    if (result.finished) finish(*result.finished);
  }
  remover.flush(finish);

  const bool works =
      finished == kScans && kept == kScans * street.size() && remover.map().size() > 0;
  std::printf("dynains %s: %zu scans, %zu of %zu points kept, %zu in the map\n",
              dynains::kVersionString, finished, kept, kScans * street.size(),
              remover.map().size());
  return works ? 0 : 1;
}
