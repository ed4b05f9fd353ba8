#include "instance_chains.hpp"

#include <algorithm>
#include <cmath>

#include "label_writer.hpp"

namespace dynains::program {
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

bool InstanceChains::Node::is_removed() const { return 5 * removed >= 4 * points; }

void InstanceChains::add(PointsView points, Span<const PointLabel> labels,
                         Span<const std::uint32_t> instances, const Pose& T_world_sensor) {
  const auto scan = static_cast<std::uint32_t>(begin_.size());
  if (scan == 0) origin_ = T_world_sensor.translation();
  open_.clear();
  numbers_.clear();
  const Eigen::Matrix3f R = T_world_sensor.linear().cast<float>();
  const Eigen::Vector3f t = (T_world_sensor.translation() - origin_).cast<float>();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::uint32_t id = mos_label(labels[i], instances[i]) >> 16U;
    if (id == kNoInstance) continue;
    if (labels[i] != PointLabel::kStatic && labels[i] != PointLabel::kDynamic) continue;
    const std::uint32_t number = numbers_.add(id);
    if (number == open_.size()) {
      open_.emplace_back();
      open_.back().instance = id;
    }
    Node& node = open_[number];
    const Eigen::Array3f at = R * Eigen::Vector3f(points.x[i], points.y[i], points.z[i]) + t;
    node.lowest = node.lowest.min(at);
    node.highest = node.highest.max(at);
    ++node.points;
    node.removed += labels[i] == PointLabel::kDynamic ? 1 : 0;
  }
  begin_.push_back(static_cast<std::uint32_t>(nodes_.size()));
  std::sort(open_.begin(), open_.end(),
            [](const Node& a, const Node& b) { return a.instance < b.instance; });
  for (Node& node : open_) {
    if (node.points < kFewestPoints) continue;
    if (!is_compact((node.highest - node.lowest).matrix())) continue;
    node.scan = scan;
    std::uint32_t& latest = latest_.try_emplace(node.instance, kNone).first->second;
    const auto number = static_cast<std::uint32_t>(nodes_.size());
    if (latest != kNone && nodes_[latest].scan + kMostGap >= scan) {
      node.has_previous = true;
      nodes_[latest].next = number;
    }
    latest = number;
    nodes_.push_back(node);
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
  std::vector<std::uint32_t> chain;
  for (std::uint32_t first = 0; first < nodes_.size(); ++first) {
    if (nodes_[first].has_previous) continue;
    chain.clear();
    for (std::uint32_t node = first; node != kNone; node = nodes_[node].next) chain.push_back(node);
    find_moves(chain);
  }
}

void InstanceChains::find_moves(const std::vector<std::uint32_t>& chain) {
  for (std::size_t first = 0; first < chain.size(); ++first) {
    if (!nodes_[chain[first]].is_removed()) continue;
    std::size_t last = first;
    while (last + 1 < chain.size() && nodes_[chain[last + 1]].is_removed()) ++last;
    const bool is_long = last - first + 1 >= kFewestRemoved;
    if (is_long && shift(nodes_[chain[first]], nodes_[chain[last]]) >= kMove) {
      set_elsewhere(chain, first, last);
    }
    first = last;
  }
}

// The object moved in the scans from `first` to `last` of the chain.
void InstanceChains::set_elsewhere(const std::vector<std::uint32_t>& chain, std::size_t first,
                                   std::size_t last) {
  std::size_t from = first, to = last;
  while (to > first && shift(nodes_[chain[to]], nodes_[chain[last]]) < kMove) --to;
  while (from < last && shift(nodes_[chain[first]], nodes_[chain[from]]) < kMove) ++from;
  for (std::size_t i = 0; i < first; ++i) {
    Node& node = nodes_[chain[i]];
    if (!node.has_move) node.move.elsewhere = {nodes_[chain[from]].scan, UINT32_MAX};
    node.has_move = node.move.is_later = true;
  }
  for (std::size_t i = last + 1; i < chain.size(); ++i) {
    nodes_[chain[i]].move.elsewhere = {0, nodes_[chain[to]].scan};
    nodes_[chain[i]].move.is_later = false;
    nodes_[chain[i]].has_move = true;
  }
}

Span<const InstanceChains::Node> InstanceChains::nodes_of(std::uint32_t scan) const {
  if (scan >= begin_.size()) return {};
  const std::size_t begin = begin_[scan];
  const std::size_t end = scan + 1 < begin_.size() ? begin_[scan + 1] : nodes_.size();
  return {nodes_.data() + begin, end - begin};
}

const InstanceChains::Move* InstanceChains::move_of(std::uint32_t scan,
                                                    std::uint32_t instance) const {
  const Span<const Node> nodes = nodes_of(scan);
  const Node* const at =
      std::lower_bound(nodes.begin(), nodes.end(), instance,
                       [](const Node& node, std::uint32_t id) { return node.instance < id; });
  if (at == nodes.end() || at->instance != instance || !at->has_move) return nullptr;
  return &at->move;
}

}  // namespace dynains::program
