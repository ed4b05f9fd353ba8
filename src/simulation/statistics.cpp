#include "dynains/simulation/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <unordered_map>

#include "dynains/errors.hpp"
#include "simulation/grid_index.hpp"

namespace dynains::simulation {
namespace {

constexpr int kCells = 256;  // of 1 m, around the sensor
constexpr float kReach = 0.5F * kCells;

int cell_of(float x, float y) {
  const auto column = static_cast<int>(std::floor(x)) + kCells / 2;
  const auto row = static_cast<int>(std::floor(y)) + kCells / 2;
  return column < 1 || row < 1 || column >= kCells - 1 || row >= kCells - 1 ? -1
                                                                            : row * kCells + column;
}

struct Car {
  std::size_t points = 0;
  double x = 0, y = 0;
};

double share(std::size_t part, std::size_t whole) {
  return whole == 0 ? 0 : static_cast<double>(part) / static_cast<double>(whole);
}

}  // namespace

void ScanStatistics::add(Span<const float> xyzi, Span<const std::uint32_t> labels) {
  const std::size_t count = xyzi.size() / 4;
  if (!labels.empty() && labels.size() != count) {
    throw CloudError("ScanStatistics: " + std::to_string(labels.size()) + " labels for " +
                     std::to_string(count) + " points");
  }
  ++scans_;
  std::vector<float> lowest(grid_index(kCells, 0, kCells), std::numeric_limits<float>::infinity());
  std::unordered_map<std::uint32_t, Car> cars;
  for (std::size_t i = 0; i < count; ++i) {
    const float* p = xyzi.data() + 4 * i;
    const double range = std::sqrt(static_cast<double>(p[0]) * static_cast<double>(p[0]) +
                                   static_cast<double>(p[1]) * static_cast<double>(p[1]) +
                                   static_cast<double>(p[2]) * static_cast<double>(p[2]));
    if (!(range > 0.1)) continue;
    ++points_;
    const auto bin = std::upper_bound(kRangeLimits.begin(), kRangeLimits.end(), range);
    ++ranges_[static_cast<std::size_t>(bin - kRangeLimits.begin())];
    if (std::abs(p[0]) < kReach && std::abs(p[1]) < kReach) {
      const int cell = cell_of(p[0], p[1]);
      if (cell >= 0) {
        float& low = lowest[static_cast<std::size_t>(cell)];
        low = std::min(low, p[2]);
      }
    }
    if (labels.empty()) continue;
    const std::uint32_t label = labels[i] & 0xffff;
    moving_ += label >= 252 && label <= 259;
    if ((label == 10 || label == 252) && labels[i] >> 16 != 0) {
      Car& car = cars[labels[i] >> 16];
      ++car.points;
      car.x += static_cast<double>(p[0]);
      car.y += static_cast<double>(p[1]);
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    const float* p = xyzi.data() + 4 * i;
    if (!(std::abs(p[0]) < kReach && std::abs(p[1]) < kReach)) continue;
    const int cell = cell_of(p[0], p[1]);
    if (cell < 0) continue;
    float low = std::numeric_limits<float>::infinity();
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const int beside = cell + dy * kCells + dx;
        low = std::min(low, lowest[static_cast<std::size_t>(beside)]);
      }
    }
    const float range = std::sqrt(p[0] * p[0] + p[1] * p[1]);
    ground_ += p[2] - low < 0.2F && low < -0.9F + 0.03F * range;
  }
  for (const auto& entry : cars) {
    const Car& car = entry.second;
    const auto n = static_cast<double>(car.points);
    const double range = std::sqrt(car.x * car.x + car.y * car.y) / n;
    for (std::size_t k = 0; k < kCarRanges.size(); ++k) {
      if (std::abs(range / kCarRanges[k] - 1) < 0.15) car_points_[k].push_back(car.points);
    }
  }
}

double ScanStatistics::points_per_scan() const { return share(points_, scans_); }

std::array<double, ScanStatistics::kRangeLimits.size() + 1> ScanStatistics::range_shares() const {
  std::array<double, kRangeLimits.size() + 1> result{};
  for (std::size_t i = 0; i < result.size(); ++i) result[i] = share(ranges_[i], points_);
  return result;
}

double ScanStatistics::ground_share() const { return share(ground_, points_); }
double ScanStatistics::moving_share() const { return share(moving_, points_); }

std::array<double, ScanStatistics::kCarRanges.size()> ScanStatistics::points_per_car() const {
  std::array<double, kCarRanges.size()> result{};
  for (std::size_t k = 0; k < result.size(); ++k) {
    std::vector<std::size_t> counts = car_points_[k];
    if (counts.empty()) continue;
    const auto middle = counts.begin() + static_cast<std::ptrdiff_t>(counts.size() / 2);
    std::nth_element(counts.begin(), middle, counts.end());
    result[k] = static_cast<double>(*middle);
  }
  return result;
}

std::array<std::size_t, ScanStatistics::kCarRanges.size()> ScanStatistics::cars() const {
  std::array<std::size_t, kCarRanges.size()> result{};
  for (std::size_t k = 0; k < result.size(); ++k) result[k] = car_points_[k].size();
  return result;
}

}  // namespace dynains::simulation
