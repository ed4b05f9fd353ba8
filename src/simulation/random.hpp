// Random numbers with the same bits everywhere. Draw one per statement: the order in which
// function arguments are evaluated differs between compilers (braces are ordered).
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>

namespace dynains::simulation {

/// Finaliser of SplitMix64: a bijection that spreads every bit.
constexpr std::uint64_t mix(std::uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

constexpr std::uint64_t mix(std::uint64_t a, std::uint64_t b) {
  return mix(a * 0x9e3779b97f4a7c15ULL + mix(b + 0x632be59bd9b4e019ULL));
}

/// Uniform in [0, 1) from 24 bits.
constexpr float unit_float(std::uint64_t bits) {
  return static_cast<float>(bits >> 40) * (1.0F / 16777216.0F);
}

/// Nearly normal, mean 0 and deviation 1, within +-3.4: sum of four uniform 16-bit numbers.
constexpr float normal_float(std::uint64_t bits) {
  const auto sum = static_cast<float>((bits & 0xffff) + ((bits >> 16) & 0xffff) +
                                      ((bits >> 32) & 0xffff) + (bits >> 48));
  return (sum * (1.0F / 65536.0F) - 2.0F) * 1.7320508F;
}

/// A stream of random numbers (SplitMix64).
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(mix(seed)) {}

  std::uint64_t bits() { return mix(state_ += 0x9e3779b97f4a7c15ULL); }
  /// In [0, 1).
  double unit() { return static_cast<double>(bits() >> 11) * 0x1p-53; }
  double uniform(double min, double max) { return min + (max - min) * unit(); }
  /// Uniform magnitude with a random sign.
  double either_sign(double min, double max) {
    const double magnitude = uniform(min, max);
    return (bits() & 1) != 0 ? magnitude : -magnitude;
  }
  double normal() { return static_cast<double>(normal_float(bits())); }
  bool chance(double probability) { return unit() < probability; }
  /// In [0, count).
  std::size_t index(std::size_t count) {
    return static_cast<std::size_t>(unit() * static_cast<double>(count));
  }
  /// One of the pairs of a value and its weight.
  template <class Value, std::size_t N>
  Value draw(const std::pair<Value, double> (&choices)[N]) {
    double sum = 0;
    for (const auto& choice : choices) sum += choice.second;
    double u = unit() * sum;
    for (const auto& choice : choices) {
      u -= choice.second;
      if (u < 0) return choice.first;
    }
    return choices[N - 1].first;
  }
  /// A separate stream for one purpose.
  Random fork(std::uint64_t purpose) const { return Random(mix(state_, purpose)); }

 private:
  std::uint64_t state_;
};

}  // namespace dynains::simulation
