#include "dynains/evaluation/error_analysis.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>

#include "detail/range_gate.hpp"
#include "dynains/errors.hpp"

namespace dynains::evaluation {
namespace {

bool is_kept(const LabelledScan& scan, std::size_t i) {
  return !scan.in_map.empty() && (scan.in_map[i] & 1U) != 0;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

ErrorAnalysis::ErrorAnalysis(const Settings& settings) : settings_(settings) {
  detail::RangeGate(settings.min_range, settings.max_range);
  if (!(settings.ring_width >= 0.1) || !std::isfinite(settings.ring_width)) {
    throw ConfigError("ErrorAnalysis.ring_width = " + std::to_string(settings.ring_width) +
                      " must be in [0.1, inf) m");
  }
}

void ErrorAnalysis::add(const LabelledScan& scan) {
  const detail::RangeGate gate(settings_.min_range, settings_.max_range);
  std::vector<std::size_t> judged;
  judged.reserve(scan.size());
  std::map<std::uint32_t, Sighting> sightings;
  // Consecutive points mostly have one label.
  std::optional<std::uint32_t> last_label;
  Counts* of_class = nullptr;
  Track* track = nullptr;
  Sighting* sighting = nullptr;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const std::uint32_t label = scan.truth[i];
    const Truth truth = settings_.truth(label);
    if (truth == Truth::kIgnored || !gate.passes(scan.xyz + i * scan.stride)) continue;
    judged.push_back(i);
    const bool removed = !is_kept(scan, i);
    const Eigen::Vector3d p = scan.point(i);
    const double range = p.head<2>().norm();

    if (last_label != label) {
      last_label = label;
      of_class = &classes_[semantic_class(label)];
      const bool has_instance = semantic_instance(label) != 0;
      track = has_instance ? &tracks_[label] : nullptr;
      sighting = has_instance ? &sightings[label] : nullptr;
    }
    ++of_class->points;
    of_class->removed += removed;

    PointScore& score = ring(range).score;
    if (truth == Truth::kStatic) {
      ++score.static_total;
      score.static_kept += !removed;
    } else {
      ++score.dynamic_total;
      score.dynamic_removed += removed;
    }

    if (track == nullptr) continue;
    ++track->counts.points;
    track->counts.removed += removed;
    track->range_sum += range;
    sighting->sum += p;
    ++sighting->count;
  }

  for (const auto& [label, seen] : sightings) {
    Track& seen_track = tracks_[label];
    const Eigen::Vector3d centroid =
        scan.T_world_sensor * Eigen::Vector3d(seen.sum / static_cast<double>(seen.count));
    if (seen_track.scans > 0 && scan.time > seen_track.last_time) {
      seen_track.speeds.push_back((centroid - seen_track.last_centroid).norm() /
                                  (scan.time - seen_track.last_time));
    }
    seen_track.last_centroid = centroid;
    seen_track.last_time = scan.time;
    ++seen_track.scans;
  }

  if (!scan.causes.empty()) count_causes(scan, judged);
  if (!scan.instances.empty()) count_merged(scan, judged);
}

ErrorAnalysis::RingErrors& ErrorAnalysis::ring(double range) {
  // Without a range limit, the last ring has no outer border.
  constexpr std::size_t kMaxRings = 100;
  const auto number =
      std::min(static_cast<std::size_t>(range / settings_.ring_width), kMaxRings - 1);
  while (rings_.size() <= number) {
    const auto next = static_cast<double>(rings_.size());
    rings_.push_back({next * settings_.ring_width, (next + 1) * settings_.ring_width, {}});
  }
  return rings_[number];
}

void ErrorAnalysis::count_causes(const LabelledScan& scan, const std::vector<std::size_t>& judged) {
  has_causes_ = true;
  for (const std::size_t i : judged) {
    const std::size_t number = scan.causes[i] < kCauseCount ? scan.causes[i] : 0;
    CauseErrors& cause = causes_[number];
    const bool dynamic = settings_.truth(scan.truth[i]) == Truth::kDynamic;
    const bool kept = is_kept(scan, i);
    if (dynamic != kept) {
      ++cause.right;
    } else if (dynamic) {
      ++cause.missed_dynamic;
    } else {
      ++cause.lost_static;
    }
  }
}

void ErrorAnalysis::count_merged(const LabelledScan& scan, const std::vector<std::size_t>& judged) {
  has_clusters_ = true;
  struct Composition {
    std::size_t static_points = 0;
    std::size_t dynamic_points = 0;
  };
  std::unordered_map<std::uint32_t, Composition> clusters;
  std::vector<Composition*> cluster_of;  // by judged point
  cluster_of.reserve(judged.size());
  // Consecutive points mostly have one cluster.
  std::optional<std::uint32_t> last_id;
  Composition* cluster = nullptr;
  for (const std::size_t i : judged) {
    if (last_id != scan.instances[i]) {
      last_id = scan.instances[i];
      cluster = &clusters[*last_id];  // references stay valid when the map grows
    }
    const bool dynamic = settings_.truth(scan.truth[i]) == Truth::kDynamic;
    ++(dynamic ? cluster->dynamic_points : cluster->static_points);
    cluster_of.push_back(cluster);
  }
  for (std::size_t k = 0; k < judged.size(); ++k) {
    const std::size_t i = judged[k];
    if (scan.instances[i] == kNoInstance) continue;
    const Composition& own = *cluster_of[k];
    const bool dynamic = settings_.truth(scan.truth[i]) == Truth::kDynamic;
    const bool kept = is_kept(scan, i);
    if (dynamic && kept && own.static_points > own.dynamic_points) ++merged_.missed_dynamic;
    if (!dynamic && !kept && own.dynamic_points > own.static_points) ++merged_.lost_static;
  }
}

std::vector<ErrorAnalysis::ClassErrors> ErrorAnalysis::by_class() const {
  std::vector<ClassErrors> errors;
  for (const auto& [id, counts] : classes_) errors.push_back({id, settings_.truth(id), counts});
  return errors;
}

std::vector<ErrorAnalysis::InstanceErrors> ErrorAnalysis::by_instance() const {
  std::vector<InstanceErrors> errors;
  for (const auto& [label, track] : tracks_) {
    InstanceErrors instance;
    instance.class_id = semantic_class(label);
    instance.instance = semantic_instance(label);
    instance.truth = settings_.truth(label);
    instance.counts = track.counts;
    instance.scans = track.scans;
    instance.mean_range = track.range_sum / static_cast<double>(track.counts.points);
    if (!track.speeds.empty()) instance.speed = median(track.speeds);
    errors.push_back(instance);
  }
  std::sort(errors.begin(), errors.end(), [](const InstanceErrors& a, const InstanceErrors& b) {
    return std::pair(a.class_id, a.instance) < std::pair(b.class_id, b.instance);
  });
  return errors;
}

}  // namespace dynains::evaluation
