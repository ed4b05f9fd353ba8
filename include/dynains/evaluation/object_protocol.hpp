// Scores by object: the share of static objects that stay whole, and of moving objects that leave.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "dynains/evaluation/scan.hpp"
#include "dynains/evaluation/scores.hpp"
#include "dynains/evaluation/truth.hpp"

namespace dynains::evaluation {

/// Numbers of objects of one estimate. An object is all points of the recording with one label:
/// class and instance id, which is not 0.
struct ObjectScore {
  std::uint64_t static_total = 0;  ///< without people
  std::uint64_t static_kept = 0;   ///< that keep at least 90 % of their points
  std::uint64_t dynamic_total = 0;
  std::uint64_t dynamic_removed = 0;  ///< that lose at least 95 % of their points

  double kept() const { return percent(static_kept, static_total); }          ///< %
  double removed() const { return percent(dynamic_removed, dynamic_total); }  ///< %
};

/// Objects and points of one class, ground excluded. Objects with few points count by points only.
struct ClassScore {
  std::uint16_t id = 0;  ///< SemanticKITTI class
  Truth truth = Truth::kStatic;
  std::uint64_t objects = 0;  ///< with enough points
  std::uint64_t right = 0;    ///< objects that are kept or removed as in ObjectScore
  std::uint64_t points = 0;
  std::uint64_t points_kept = 0;
};

/// Counts the points of each object and class that each estimate keeps (LabelledScan::in_map).
class ObjectProtocol {
 public:
  static constexpr std::uint64_t kMinPoints = 50;  ///< of an object that is judged
  static constexpr double kKept = 0.90;
  static constexpr double kRemoved = 0.95;

  struct Settings {
    double min_range = 2.7;  ///< m, planar
    double max_range = 50;   ///< m, planar; 0 = no limit
    TruthClasses truth;
  };

  /// Throws ConfigError for ranges out of bounds or more than kMaxEstimates estimates.
  ObjectProtocol(const Settings& settings, std::size_t estimates);

  void add(const LabelledScan& scan);

  ObjectScore score(std::size_t estimate) const;
  /// Static classes first, each ordered by id; without ground.
  std::vector<ClassScore> by_class(std::size_t estimate) const;

  /// Scores of the references: no point removed, and exactly the dynamic points removed.
  ObjectScore identity() const;
  ObjectScore oracle() const;

 private:
  struct Counts {
    std::uint64_t points = 0;
    std::array<std::uint64_t, kMaxEstimates> kept{};
  };
  bool is_right(Truth truth, const Counts& counts, std::size_t estimate) const;

  Settings settings_;
  std::size_t estimates_;
  std::unordered_map<std::uint32_t, Counts> by_label_;
};

}  // namespace dynains::evaluation
