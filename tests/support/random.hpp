// Random numbers that are equal for all standard libraries.
#pragma once

#include "support/standard.hpp"

namespace dynains::test {

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  /// Uniform in [low, high).
  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1p-53;
  }
  float uniform_float(double low, double high) { return static_cast<float>(uniform(low, high)); }
  /// Uniform in a box. Draws the coordinates one by one, because the order in which function
  /// arguments are evaluated is unspecified.
  Eigen::Vector3d vector(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
    Eigen::Vector3d result;
    for (int i = 0; i < 3; ++i) result[i] = uniform(low[i], high[i]);
    return result;
  }
  /// Sum of twelve uniform numbers: mean 0, standard deviation 1, and nearly normal.
  double normal() {
    double sum = -6.0;
    for (int i = 0; i < 12; ++i) sum += uniform(0.0, 1.0);
    return sum;
  }
  /// Any rotation, translated by at most `reach` (m) along each axis.
  Eigen::Isometry3d pose(double reach) {
    const Eigen::Vector3d ones = Eigen::Vector3d::Ones();
    const Eigen::Vector3d axis = vector(-ones, ones).normalized();
    const double angle = uniform(0.0, 2.0 * M_PI);
    return Eigen::Translation3d(vector(-reach * ones, reach * ones)) *
           Eigen::AngleAxisd(angle, axis);
  }
  /// Uniform in [0, count).
  std::size_t index(std::size_t count) { return static_cast<std::size_t>(engine_() % count); }

  /// 0 to count - 1 in random order.
  std::vector<std::size_t> permutation(std::size_t count) {
    std::vector<std::size_t> order(count);
    for (std::size_t i = 0; i < count; ++i) order[i] = i;
    for (std::size_t i = count; i > 1; --i) std::swap(order[i - 1], order[index(i)]);
    return order;
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace dynains::test
