#include "point_time_faults.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "agreement_sum.hpp"
#include "dynains/io/trajectory.hpp"
#include "given_motion.hpp"
#include "landmarks.hpp"

namespace dynains {
namespace {

/// Motion of the sensor around scan i, from one scan to the next.
class MotionAround {
 public:
  MotionAround(const Recording& recording, std::size_t i)
      : recording_(recording), i_(i), T_sensor_world_(recording.T_world_sensor(i).inverse()) {}

  /// Pose of the sensor `offset` s after scan i in its frame then.
  Pose T_scan_sensor(double offset) const {
    const std::size_t k = offset < 0.0 ? i_ - 1 : i_;
    const double begin = recording_.time(k);
    const double share = (recording_.time(i_) + offset - begin) / (recording_.time(k + 1) - begin);
    return T_sensor_world_ *
           extrapolate(recording_.T_world_sensor(k), recording_.T_world_sensor(k + 1), share);
  }

 private:
  const Recording& recording_;
  std::size_t i_;
  Pose T_sensor_world_;
};

/// A scan that is corrected by offsets of time in another way.
class Recorrected {
 public:
  /// Scan i > 0 has a next one.
  Recorrected(const Recording& recording, std::size_t i)
      : motion_(recording, i), scan_(recording.read_scan(i)) {
    offsets_ = recording.point_offsets(i, scan_);
    for (std::size_t k = 0; k < scan_.size(); ++k) {
      if (!is_measured(k)) continue;
      first_ = std::min(first_, offsets_[k]);
      last_ = std::max(last_, offsets_[k]);
    }
  }

  bool is_empty() const { return !(first_ < last_); }

  PointBuffer points(PointTimesReading reading) const {
    std::vector<Pose> T(kSteps + 1);  // from the correction as given to that of the reading
    for (std::size_t step = 0; step <= kSteps; ++step) {
      const double offset = first_ + (last_ - first_) * static_cast<double>(step) / kSteps;
      T[step] =
          motion_.T_scan_sensor(read(reading, offset)) * motion_.T_scan_sensor(offset).inverse();
    }
    PointBuffer result;
    const std::size_t step = 1 + scan_.size() / kMostPoints;
    for (std::size_t k = 0; k < scan_.size(); k += step) {
      if (!is_measured(k)) continue;
      const double share = (offsets_[k] - first_) / (last_ - first_);
      const Eigen::Vector3f p =
          (T[static_cast<std::size_t>(std::lround(share * kSteps))] * scan_.point(k).position)
              .cast<float>();
      result.push_back(p.x(), p.y(), p.z());
    }
    return result;
  }

 private:
  static constexpr int kSteps = 100;
  static constexpr std::size_t kMostPoints = 30000;

  bool is_measured(std::size_t k) const {
    const Eigen::Vector3d p = scan_.point(k).position;
    return std::isfinite(offsets_[k]) && p.allFinite() && !p.isZero(0.0);
  }
  double read(PointTimesReading reading, double offset) const {
    switch (reading) {
      case PointTimesReading::kAsGiven:
        break;
      case PointTimesReading::kNone:
        return 0.0;
      case PointTimesReading::kReversed:
        return first_ + last_ - offset;
      case PointTimesReading::kTwice:
        return 2.0 * offset;
      case PointTimesReading::kHalf:
        return 0.5 * offset;
    }
    return offset;
  }

  MotionAround motion_;
  RecordedScan scan_;
  std::vector<double> offsets_;  // s after the scan, by point
  double first_ = std::numeric_limits<double>::infinity();
  double last_ = -std::numeric_limits<double>::infinity();
};

constexpr double kScanLever = 10.0;  // m

/// The first scan behind i that sees what is beside the way in other directions, or during which
/// the sensor moves otherwise, so that its points are moved otherwise; 0: none.
std::size_t partner_of(const Recording& recording, std::size_t i, std::size_t last) {
  constexpr double kWay = 8.0;       // m
  constexpr double kOther = 0.3;     // m, difference of the motions during both scans
  constexpr std::size_t kMost = 50;  // scans
  const Pose T_next_i = motion_between(recording, i + 1, i);
  for (std::size_t k = i + 1; k < last && k <= i + kMost; ++k) {
    if (extent_of(motion_between(recording, i, k), kWay) >= kWay) return k;
    if (extent_of(T_next_i * motion_between(recording, k, k + 1), kScanLever) >= kOther) return k;
  }
  return 0;
}

}  // namespace

PointTimesGaps point_times_gaps(const Recording& recording, std::size_t first, std::size_t last) {
  constexpr std::size_t kMostPairs = 10;
  constexpr double kLeastMotion = 0.15;  // m, within a scan, at that distance
  constexpr double kClearly = 0.02;
  PointTimesGaps gaps;
  std::array<AgreementSum, kPointTimesReadings> sums;
  for (std::size_t pair = 0; pair < kMostPairs && first + 2 < last; ++pair) {
    const std::size_t i = first + 1 + pair * (last - first - 2) / kMostPairs;
    const std::size_t k = partner_of(recording, i, last);
    if (k == 0 || extent_of(motion_between(recording, i, i + 1), kScanLever) < kLeastMotion)
      continue;
    const Recorrected a(recording, i), b(recording, k);
    if (a.is_empty() || b.is_empty()) continue;
    const Mounting mounting = estimate_mounting(a.points(PointTimesReading::kAsGiven));
    std::array<Agreement, kPointTimesReadings> found;
    for (std::size_t r = 0; r < kPointTimesReadings; ++r) {
      const auto reading = static_cast<PointTimesReading>(r);
      const Landmarks of_a(a.points(reading), mounting), of_b(b.points(reading), mounting);
      found[r] = of_a.compare(of_b, motion_between(recording, i, k));
    }
    ++gaps.pairs;
    for (std::size_t r = 0; r < kPointTimesReadings; ++r) {
      sums[r].add(found[r]);
      gaps.better[r] += found[r].gap < (1.0 - kClearly) * found[0].gap ? 1 : 0;
    }
  }
  for (std::size_t r = 0; r < kPointTimesReadings; ++r) gaps.gap[r] = sums[r].mean().gap;
  return gaps;
}

PointTimesReading best_reading(const PointTimesGaps& gaps) {
  constexpr std::size_t kFewestPairs = 3;
  // Right times differed by at most half as much from the best reading.
  constexpr double kRatio = 0.975;
  constexpr double kGain = 0.012;  // m
  if (gaps.pairs < kFewestPairs) return PointTimesReading::kAsGiven;
  const auto best = static_cast<std::size_t>(std::min_element(gaps.gap.begin(), gaps.gap.end()) -
                                             gaps.gap.begin());
  const bool is_clear = gaps.gap[best] < kRatio * gaps.gap[0] &&
                        gaps.gap[0] - gaps.gap[best] > kGain &&
                        5 * gaps.better[best] >= 3 * gaps.pairs;
  return is_clear ? static_cast<PointTimesReading>(best) : PointTimesReading::kAsGiven;
}

std::string text_of(PointTimesReading reading) {
  switch (reading) {
    case PointTimesReading::kAsGiven:
      break;
    case PointTimesReading::kNone:
      return "without them, as if the recorder had de-skewed the clouds: leave --deskew out";
    case PointTimesReading::kReversed:
      return "if they run backwards in each scan";
    case PointTimesReading::kTwice:
      return "if they are twice as long; see --point-time-unit";
    case PointTimesReading::kHalf:
      return "if they are half as long; see --point-time-unit";
  }
  return {};
}

}  // namespace dynains
