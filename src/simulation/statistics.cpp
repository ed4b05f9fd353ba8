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
using Cars = std::unordered_map<std::uint32_t, Car>;

/// Height of the lowest point of each cell, m.
class LowestPoints {
 public:
  void add(const float* p) {
    const int cell = near_cell(p);
    if (cell < 0) return;
    float& low = lowest_[static_cast<std::size_t>(cell)];
    low = std::min(low, p[2]);
  }

  /// Whether a point is at most 0.2 m above the lowest point around it, which lies below a slope
  /// that rises with the distance.
  bool is_ground(const float* p) const {
    const int cell = near_cell(p);
    if (cell < 0) return false;
    float low = std::numeric_limits<float>::infinity();
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const int beside = cell + dy * kCells + dx;
        low = std::min(low, lowest_[static_cast<std::size_t>(beside)]);
      }
    }
    const float range = std::sqrt(p[0] * p[0] + p[1] * p[1]);
    return p[2] - low < 0.2F && low < -0.9F + 0.03F * range;
  }

 private:
  static int near_cell(const float* p) {
    return std::abs(p[0]) < kReach && std::abs(p[1]) < kReach ? cell_of(p[0], p[1]) : -1;
  }

  std::vector<float> lowest_ =
      std::vector<float>(grid_index(kCells, 0, kCells), std::numeric_limits<float>::infinity());
};

double range_of(const float* p) {
  return std::sqrt(static_cast<double>(p[0]) * static_cast<double>(p[0]) +
                   static_cast<double>(p[1]) * static_cast<double>(p[1]) +
                   static_cast<double>(p[2]) * static_cast<double>(p[2]));
}

void add_car_point(const float* p, std::uint32_t label, Cars& cars) {
  const std::uint32_t kind = label & 0xffff;
  const std::uint32_t instance = label >> 16;
  if ((kind != 10 && kind != 252) || instance == 0) return;
  Car& car = cars[instance];
  ++car.points;
  car.x += static_cast<double>(p[0]);
  car.y += static_cast<double>(p[1]);
}

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
  LowestPoints lowest;
  Cars cars;
  for (std::size_t i = 0; i < count; ++i) {
    const float* p = xyzi.data() + 4 * i;
    const double range = range_of(p);
    if (!(range > 0.1)) continue;
    ++points_;
    const auto bin = std::upper_bound(kRangeLimits.begin(), kRangeLimits.end(), range);
    ++ranges_[static_cast<std::size_t>(bin - kRangeLimits.begin())];
    lowest.add(p);
    if (labels.empty()) continue;
    const std::uint32_t kind = labels[i] & 0xffff;
    moving_ += kind >= 252 && kind <= 259;
    add_car_point(p, labels[i], cars);
  }
  for (std::size_t i = 0; i < count; ++i) ground_ += lowest.is_ground(xyzi.data() + 4 * i);
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
