#include "dynains/surfaces/way_search.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace dynains {
namespace {

using Points = std::vector<Eigen::Vector3d>;

constexpr double kCoarse = 0.5;     // m
constexpr double kFineShift = 0.1;  // m

Points thinned(const Points& points) {
  constexpr std::size_t kMaxCount = 800;
  const std::size_t stride = 1 + points.size() / kMaxCount;
  Points kept;
  for (std::size_t i = 0; i < points.size(); i += stride) kept.push_back(points[i]);
  return kept;
}

Pose moved(Pose T, const Eigen::Vector3d& way) {
  T.translation() += way;
  return T;
}

/// Mean distance to `a`, each at most `most` (m).
double gap_of(const Landmarks& a, const Points& points, const Pose& T, double most = 1.0) {
  double sum = 0.0;
  for (const Eigen::Vector3d& p : points) sum += std::min(most, a.distance_to(T * p));
  return sum / static_cast<double>(points.size());
}

/// The `points` of another scan that do not keep their place beside `a`, as traffic ahead and
/// smooth walls do. Only these points determine the way. Empty if they are few.
Points decisive_of(const Points& points, const Landmarks& a, const Pose& standing) {
  constexpr double kMinShare = 0.15;  // of the points
  Points decisive;
  for (const Eigen::Vector3d& p : points) {
    if (a.distance_to(standing * p) > kDistinct) decisive.push_back(p);
  }
  const double min_count = kMinShare * static_cast<double>(points.size());
  if (static_cast<double>(decisive.size()) < min_count || decisive.size() < kMinLandmarks) {
    decisive.clear();
  }
  return decisive;
}

/// The index of the least gap; empty if it is at an end, or if another minimum is nearly as low.
std::optional<std::size_t> clear_minimum(const std::vector<double>& gaps) {
  const auto least =
      static_cast<std::size_t>(std::min_element(gaps.begin(), gaps.end()) - gaps.begin());
  if (least == 0 || least + 1 == gaps.size()) return std::nullopt;
  for (std::size_t k = 1; k + 1 < gaps.size(); ++k) {
    const bool is_minimum = gaps[k] <= gaps[k - 1] && gaps[k] <= gaps[k + 1];
    const bool is_other = std::max(k, least) - std::min(k, least) > 1;
    if (is_minimum && is_other && kAlmost * gaps[k] < gaps[least]) return std::nullopt;
  }
  return least;
}

}  // namespace

double mean_gap(const Landmarks& a, const Landmarks& b, const Pose& T_a_b) {
  return 0.5 *
         (gap_of(a, thinned(b.points()), T_a_b) + gap_of(b, thinned(a.points()), T_a_b.inverse()));
}

std::optional<Pose> search_way(const Landmarks& a, const Landmarks& b, const Pose& T_a_b,
                               const Eigen::Vector3d& direction, double farthest) {
  constexpr double kMaxPull = 0.4;  // m; traffic of another speed must not pull at the minimum
  const Points of_a = thinned(a.points());
  const Points of_b = thinned(b.points());
  if (of_a.size() < kMinLandmarks || of_b.size() < kMinLandmarks) return std::nullopt;
  const double way = direction.dot(T_a_b.translation());
  const Pose standing = moved(T_a_b, -way * direction);
  const Points decisive_a = decisive_of(of_a, b, standing.inverse());
  const Points decisive_b = decisive_of(of_b, a, standing);
  if (decisive_a.empty() || decisive_b.empty()) return std::nullopt;
  std::vector<double> gaps;
  const auto steps = static_cast<int>(std::ceil(farthest / kCoarse));
  for (int k = -steps; k <= steps; ++k) {
    gaps.push_back(gap_of(a, decisive_b, moved(T_a_b, kCoarse * k * direction)));
  }
  const auto min_gap = clear_minimum(gaps);
  if (!min_gap) return std::nullopt;
  const double coarse = kCoarse * (static_cast<double>(*min_gap) - static_cast<double>(steps));

  const auto gap_at = [&](double displacement) {
    const Pose T = moved(T_a_b, displacement * direction);
    return 0.5 *
           (gap_of(a, decisive_b, T, kMaxPull) + gap_of(b, decisive_a, T.inverse(), kMaxPull));
  };
  double best = coarse;
  double least = gap_at(best);
  for (int k = -4; k <= 4; ++k) {
    const double gap = k == 0 ? least : gap_at(coarse + kFineShift * k);
    if (!(gap < least)) continue;
    least = gap;
    best = coarse + kFineShift * k;
  }
  const double before = gap_at(best - 2.0 * kFineShift);
  const double behind = gap_at(best + 2.0 * kFineShift);
  const double curvature = before - 2.0 * least + behind;
  if (curvature > 0.0) {
    best += std::clamp(kFineShift * (before - behind) / curvature, -kFineShift, kFineShift);
  }
  return moved(T_a_b, best * direction);
}

std::optional<Registration> register_along(const SurfaceGrid& a, const Points& b,
                                           const Landmarks& landmarks_a,
                                           const Landmarks& landmarks_b, const Pose& T_a_b,
                                           const Eigen::Vector3d& direction, double farthest) {
  constexpr double kDeviation = 0.04;  // m, of search_way()
  const auto guess = search_way(landmarks_a, landmarks_b, T_a_b, direction, farthest);
  if (!guess) return std::nullopt;
  return register_near(
      a, b, *guess, KnownTranslation{direction, direction.dot(guess->translation()), kDeviation});
}

}  // namespace dynains
