// Point-wise errors of an estimate, by class, instance, range and cause.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "dynains/evaluation/causes.hpp"
#include "dynains/evaluation/scan.hpp"
#include "dynains/evaluation/scores.hpp"
#include "dynains/evaluation/truth.hpp"

namespace dynains::evaluation {

/// Counts the errors of estimate 0.
class ErrorAnalysis {
 public:
  struct Settings {
    double min_range = 2.7;  ///< m, planar
    double max_range = 50;   ///< m, planar; 0 = no limit
    double ring_width = 10;  ///< m, planar
    TruthClasses truth;
  };

  struct Counts {
    std::uint64_t points = 0;
    std::uint64_t removed = 0;
    double removed_percent() const { return percent(removed, points); }
  };

  struct ClassErrors {
    std::uint16_t id = 0;  ///< SemanticKITTI class
    Truth truth = Truth::kStatic;
    Counts counts;
  };

  struct InstanceErrors {
    std::uint16_t class_id = 0;
    std::uint16_t instance = 0;
    Truth truth = Truth::kStatic;
    Counts counts;
    std::size_t scans = 0;  ///< number of scans with points of the instance
    double mean_range = 0;  ///< m, planar, mean over its points
    /// Median speed of the centroid of its points between consecutive scans with points of the
    /// instance, m/s. A change of the visible part also moves the centroid. Empty without time
    /// stamps or with one scan.
    std::optional<double> speed;
  };

  struct RingErrors {
    double from = 0;  ///< m, planar
    double to = 0;
    PointScore score;
  };

  /// Numbers of wrong and right verdicts with one cause.
  struct CauseErrors {
    std::uint64_t missed_dynamic = 0;
    std::uint64_t lost_static = 0;
    std::uint64_t right = 0;
  };

  /// Errors in clusters (LabelledScan::instances) that contain both static and dynamic points.
  struct MergeErrors {
    std::uint64_t missed_dynamic = 0;  ///< in clusters with more static than dynamic points
    std::uint64_t lost_static = 0;     ///< in clusters with more dynamic than static points
  };

  /// Throws ConfigError for settings out of bounds.
  explicit ErrorAnalysis(const Settings& settings);

  /// Counts the errors of one scan. Scans must be added in order.
  void add(const LabelledScan& scan);

  std::vector<ClassErrors> by_class() const;        ///< ordered by id
  std::vector<InstanceErrors> by_instance() const;  ///< ordered by class and instance, without id 0
  const std::vector<RingErrors>& by_range() const { return rings_; }
  const std::array<CauseErrors, kCauseCount>& by_cause() const { return causes_; }
  const MergeErrors& merged() const { return merged_; }
  bool has_causes() const { return has_causes_; }
  bool has_clusters() const { return has_clusters_; }

 private:
  struct Track {
    Counts counts;
    double range_sum = 0;
    std::size_t scans = 0;
    std::vector<double> speeds;
    Eigen::Vector3d last_centroid = Eigen::Vector3d::Zero();
    double last_time = 0;
  };
  struct Sighting {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    std::size_t count = 0;
  };

  RingErrors& ring(double range);
  void count_causes(const LabelledScan& scan, const std::vector<std::size_t>& judged);
  void count_merged(const LabelledScan& scan, const std::vector<std::size_t>& judged);

  Settings settings_;
  std::map<std::uint16_t, Counts> classes_;
  std::map<std::uint32_t, Track> tracks_;  // key: truth label
  std::vector<RingErrors> rings_;
  std::array<CauseErrors, kCauseCount> causes_{};
  MergeErrors merged_;
  bool has_causes_ = false;
  bool has_clusters_ = false;
};

}  // namespace dynains::evaluation
