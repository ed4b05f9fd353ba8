#include "transform_tree.hpp"

#include <algorithm>
#include <set>

namespace dynains {
namespace {

std::optional<Pose> pose_at(const Trajectory& trajectory, double time) {
  if (trajectory.times.empty()) return trajectory.poses.front();
  const std::optional<TrajectoryMatch> match = match_time(trajectory, time);
  if (!match) return std::nullopt;
  return interpolate(trajectory.poses[match->before], trajectory.poses[match->after], match->share);
}

}  // namespace

void add_in_order(double time, const Pose& pose, Trajectory& trajectory) {
  // Most come by increasing time.
  const auto at = std::lower_bound(trajectory.times.begin(), trajectory.times.end(), time);
  if (at != trajectory.times.end() && *at == time) return;
  trajectory.poses.insert(trajectory.poses.begin() + (at - trajectory.times.begin()), pose);
  trajectory.times.insert(at, time);
}

void TransformTree::add(const StampedPose& pose, bool is_static) {
  Edge& edge = edges_.try_emplace(pose.child, Edge{pose.frame, is_static, {}}).first->second;
  if (edge.parent != pose.frame || (edge.is_static && !is_static)) {
    ++left_out_;
    return;
  }
  if (is_static) {
    edge.is_static = true;
    edge.poses.poses.assign(1, pose.T_frame_child);
    edge.poses.times.clear();
  } else {
    add_in_order(pose.time, pose.T_frame_child, edge.poses);
  }
}

std::optional<std::string> TransformTree::root_of(const std::string& frame) const {
  std::string root = frame;
  std::size_t steps = 0;
  for (auto edge = edges_.find(root); edge != edges_.end(); edge = edges_.find(root)) {
    if (++steps > edges_.size()) return std::nullopt;
    root = edge->second.parent;
  }
  return root;
}

/// `source` and the frames above it, as far as transforms lead at that time.
std::vector<TransformTree::Step> TransformTree::climb(const std::string& source,
                                                      double time) const {
  std::vector<Step> steps = {{source, Pose::Identity()}};
  while (steps.size() <= edges_.size()) {
    const auto edge = edges_.find(steps.back().frame);
    if (edge == edges_.end()) break;
    const std::optional<Pose> T_parent_child = pose_at(edge->second.poses, time);
    if (!T_parent_child) break;
    steps.push_back({edge->second.parent, *T_parent_child * steps.back().T_frame_source});
  }
  return steps;
}

std::optional<Pose> TransformTree::find(const std::string& target, const std::string& source,
                                        double time) const {
  const std::vector<Step> from_source = climb(source, time);
  for (const Step& above_target : climb(target, time)) {
    for (const Step& above_source : from_source) {
      if (above_source.frame != above_target.frame) continue;
      return above_target.T_frame_source.inverse() * above_source.T_frame_source;
    }
  }
  return std::nullopt;
}

std::vector<double> TransformTree::times() const {
  std::set<double> times;
  for (const auto& edge : edges_) {
    times.insert(edge.second.poses.times.begin(), edge.second.poses.times.end());
  }
  return {times.begin(), times.end()};
}

std::vector<std::string> TransformTree::frames() const {
  std::vector<std::string> names;
  for (const auto& edge : edges_) names.push_back(edge.first);
  return names;
}

}  // namespace dynains
