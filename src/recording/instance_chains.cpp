#include "dynains/recording/instance_chains.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

namespace dynains {
namespace {

constexpr std::uint32_t kFewestPoints = 10;
constexpr float kMove = 1.0F;              // m, of both ends of a box
constexpr std::uint32_t kMostGap = 3;      // scans
constexpr std::size_t kFewestRemoved = 5;  // scans of a move

}  // namespace

bool is_compact(const Eigen::Vector3f& size) {
  constexpr float kLongest = 18.0F, kHighest = 4.5F;  // m
  return std::max(size.x(), size.y()) <= kLongest && size.z() <= kHighest;
}

void InstanceChains::add(PointsView points, Span<const PointLabel> labels,
                         Span<const std::uint32_t> instances, const Pose& T_world_sensor) {
  if (scan_ == 0) origin_ = T_world_sensor.translation();
  end_old_chains();
  take_nodes(points, labels, instances, T_world_sensor);
  for (Node& node : newest_) {
    if (node.points < kFewestPoints) continue;
    if (!is_compact((node.highest - node.lowest).matrix())) continue;
    node.scan = scan_;
    chains_[node.instance].push_back(node);
  }
  ++scan_;
}

// Ends the chains that the newest scan cannot continue.
void InstanceChains::end_old_chains() {
  for (auto at = chains_.begin(); at != chains_.end();) {
    const bool is_old = at->second.back().scan + kMostGap < scan_;
    if (is_old) end(at->second);
    at = is_old ? chains_.erase(at) : std::next(at);
  }
}

void InstanceChains::take_nodes(PointsView points, Span<const PointLabel> labels,
                                Span<const std::uint32_t> instances, const Pose& T_world_sensor) {
  newest_.clear();
  numbers_.clear();
  const Eigen::Matrix3f R = T_world_sensor.linear().cast<float>();
  const Eigen::Vector3f t = (T_world_sensor.translation() - origin_).cast<float>();
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (labels[i] != PointLabel::kStatic && labels[i] != PointLabel::kDynamic) continue;
    if (instances[i] == kNoInstance) continue;
    const std::uint32_t number = numbers_.add(instances[i]);
    if (number == newest_.size()) newest_.emplace_back().instance = numbers_.ids()[number];
    Node& node = newest_[number];
    const Eigen::Array3f at = R * Eigen::Vector3f(points.x[i], points.y[i], points.z[i]) + t;
    node.lowest = node.lowest.min(at);
    node.highest = node.highest.max(at);
    ++node.points;
    node.removed += labels[i] == PointLabel::kDynamic ? 1 : 0;
  }
}

// Horizontal way, m, by which both ends of a box went.
float InstanceChains::shift(const Node& a, const Node& b) {
  const auto along = [&](int axis) {
    const float low = b.lowest[axis] - a.lowest[axis];
    const float high = b.highest[axis] - a.highest[axis];
    return low * high > 0.0F ? std::min(std::abs(low), std::abs(high)) : 0.0F;
  };
  return std::hypot(along(0), along(1));
}

void InstanceChains::find_moves() {
  for (const auto& chain : chains_) end(chain.second);
  chains_.clear();
  std::sort(moves_.begin(), moves_.end(), [](const MovedInstance& a, const MovedInstance& b) {
    return std::make_pair(a.scan, a.instance) < std::make_pair(b.scan, b.instance);
  });
}

// Keeps the moves of a chain.
void InstanceChains::end(const Chain& chain) {
  of_chain_.assign(chain.size(), std::nullopt);
  for (std::size_t first = 0; first < chain.size(); ++first) {
    if (!chain[first].is_removed()) continue;
    std::size_t last = first;
    while (last + 1 < chain.size() && chain[last + 1].is_removed()) ++last;
    const bool is_long = last - first + 1 >= kFewestRemoved;
    if (is_long && shift(chain[first], chain[last]) >= kMove) set_elsewhere(chain, first, last);
    first = last;
  }
  for (std::size_t i = 0; i < chain.size(); ++i) {
    if (of_chain_[i]) moves_.push_back({chain[i].scan, chain[i].instance, *of_chain_[i]});
  }
}

// The object moved in the scans from `first` to `last` of the chain.
void InstanceChains::set_elsewhere(const Chain& chain, std::size_t first, std::size_t last) {
  std::size_t from = first, to = last;
  while (to > first && shift(chain[to], chain[last]) < kMove) --to;
  while (from < last && shift(chain[first], chain[from]) < kMove) ++from;
  for (std::size_t i = 0; i < first; ++i) {
    if (!of_chain_[i]) of_chain_[i] = Move{{chain[from].scan, UINT32_MAX}, true};
    of_chain_[i]->is_later = true;
  }
  for (std::size_t i = last + 1; i < chain.size(); ++i) {
    of_chain_[i] = Move{{0, chain[to].scan}, false};
  }
}

InstanceChains::Moves::const_iterator InstanceChains::first_move(std::uint32_t scan,
                                                                 std::uint32_t instance) const {
  const auto is_before = [](const MovedInstance& moved,
                            std::pair<std::uint32_t, std::uint32_t> at) {
    return std::make_pair(moved.scan, moved.instance) < at;
  };
  return std::lower_bound(moves_.begin(), moves_.end(), std::make_pair(scan, instance), is_before);
}

const InstanceChains::Move* InstanceChains::move_of(std::uint32_t scan,
                                                    std::uint32_t instance) const {
  const auto at = first_move(scan, instance);
  const bool is_found = at != moves_.end() && at->scan == scan && at->instance == instance;
  return is_found ? &at->move : nullptr;
}

}  // namespace dynains
