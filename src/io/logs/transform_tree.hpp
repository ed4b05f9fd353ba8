// Transforms between named frames over time, as in ROS.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "dynains/io/trajectory.hpp"
#include "dynains/pose.hpp"
#include "ros_messages.hpp"

namespace dynains {

/// Adds a pose with its time (s), in any order.
inline void append(double time, const Pose& pose, Trajectory& trajectory) {
  trajectory.times.push_back(time);
  trajectory.poses.push_back(pose);
}
/// Orders poses by time. Of several poses of one time, the first one stays.
inline void sort_by_time(Trajectory& trajectory) {
  std::map<double, Pose> sorted;
  for (std::size_t i = 0; i < trajectory.times.size(); ++i) {
    sorted.emplace_hint(sorted.end(), trajectory.times[i], trajectory.poses[i]);
  }
  if (sorted.empty()) return;  // a static pose has no time
  trajectory.times.clear();
  trajectory.poses.clear();
  for (const auto& [time, pose] : sorted) append(time, pose, trajectory);
}

/// Where transforms come from. Robots in one log may name their frames alike, each with transforms
/// below a namespace of its own.
struct TransformSource {
  std::string name_space;    ///< "/robot1" of "/robot1/tf", "" of "/tf"
  std::size_t nearness = 0;  ///< to the clouds; of a frame, those of the nearest namespace count
};

/// Each frame has one parent. An edge is static, or a trajectory that is interpolated.
class TransformTree {
 public:
  /// Maximum number of edges between a frame and its root. Robots have fewer than 100.
  static constexpr std::size_t kDeepest = 256;

  /// `longest_gap`: s, between two poses of an edge that changes. The newest pose of an edge that
  /// hardly changes holds until the next one.
  explicit TransformTree(double longest_gap = kMaxPoseGap) : longest_gap_(longest_gap) {}

  /// Adds T_frame_child of a pose. A static transform replaces earlier ones of its frame. A pose
  /// that gives a frame a second parent is left out and counted.
  void add(const StampedPose& pose, bool is_static, const TransformSource& source = {}) {
    const Edge first{pose.frame, is_static, {}, source, {}};
    Edge& edge = edges_.try_emplace(pose.child, first).first->second;
    if (edge.source.nearness > source.nearness) return;
    if (edge.source.nearness < source.nearness) edge = first;
    if (edge.source.name_space != source.name_space) {
      const bool are_equal = edge.is_static && is_static && edge.parent == pose.frame &&
                             edge.poses.poses.front().isApprox(pose.T_frame_child, 1e-6);
      if (!are_equal) edge.rival = source.name_space;
      return;
    }
    if (edge.parent != pose.frame || (edge.is_static && !is_static)) {
      ++left_out_;
      return;
    }
    if (is_static) {
      edge.is_static = true;
      edge.poses.poses.assign(1, pose.T_frame_child);
      edge.poses.times.clear();
    } else {
      append(pose.time, pose.T_frame_child, edge.poses);
    }
  }
  std::size_t left_out() const { return left_out_; }

  /// Orders the poses of each edge by time, for the members below.
  void sort() {
    for (auto& edge : edges_) sort_by_time(edge.second.poses);
  }

  bool has(const std::string& frame) const { return edges_.count(frame) > 0; }
  /// The frame above `frame` that has no parent; nothing if the frames above it form a loop
  /// or are more than kDeepest.
  std::optional<std::string> root_of(const std::string& frame) const {
    const std::vector<std::string> frames = frames_above(frame);
    return has(frames.back()) ? std::nullopt : std::optional(frames.back());
  }
  /// Whether a moving transform leads to `frame` from a frame above it.
  bool is_moving(const std::string& frame) const {
    const std::vector<std::string> frames = frames_above(frame);
    return std::any_of(frames.begin(), frames.end(), [this](const std::string& one) {
      return has(one) && !edges_.at(one).is_static;
    });
  }
  /// Frames with a moving transform to their parent.
  std::vector<std::string> moving_frames() const {
    std::vector<std::string> names;
    for (const auto& [name, edge] : edges_) {
      if (!edge.is_static) names.push_back(name);
    }
    return names;
  }
  /// The lowest of the moving frames that all others lie above or below: the body of a robot, also
  /// if its wheels move. Nothing if there is none.
  std::optional<std::string> moving_body() const {
    std::map<std::string, std::size_t> below;  // moving frames at or below each frame
    std::vector<std::string> longest;
    const std::vector<std::string> moving = moving_frames();
    for (const std::string& frame : moving) {
      const std::vector<std::string> chain = frames_above(frame);
      for (const std::string& one : chain) ++below[one];
      if (chain.size() > longest.size()) longest = chain;
    }
    // Every moving frame lies above the body, or at or below it.
    std::size_t above = 0;
    std::optional<std::string> body;
    for (auto frame = longest.rbegin(); frame != longest.rend(); ++frame) {
      const bool is_moving = std::binary_search(moving.begin(), moving.end(), *frame);
      if (!is_moving) continue;
      if (below[*frame] + above < moving.size()) break;
      body = *frame;
      ++above;
    }
    return body;
  }
  /// T_target_source at `time` (s), by the nearest frame above both. Nothing if there is none, or
  /// if a moving edge on the way has no pose at that time.
  std::optional<Pose> find(const std::string& target, const std::string& source,
                           double time) const {
    const std::vector<Step> from_source = climb(source, time);
    const std::vector<Step> from_target = climb(target, time);
    if (from_source.back().frame != from_target.back().frame) return std::nullopt;
    for (const Step& to : from_target) {
      for (const Step& from : from_source) {
        if (from.frame == to.frame) return to.T_frame_source.inverse() * from.T_frame_source;
      }
    }
    return std::nullopt;
  }
  /// A frame between both, and two namespaces that are equally near and place it differently: which
  /// of them find() takes is chance.
  std::optional<std::string> conflict(const std::string& target, const std::string& source) const {
    const std::vector<std::string> ways[] = {frames_above(target), frames_above(source)};
    for (std::size_t i = 0; i < 2; ++i) {
      for (const std::string& frame : ways[i]) {
        const std::vector<std::string>& other = ways[1 - i];
        const auto edge = edges_.find(frame);
        const bool is_between = std::find(other.begin(), other.end(), frame) == other.end();
        if (!is_between || edge == edges_.end() || edge->second.rival.empty()) continue;
        return "frame " + frame + " by namespaces " + edge->second.source.name_space + " and " +
               edge->second.rival;
      }
    }
    return std::nullopt;
  }
  /// Times of all moving transforms, s, strictly increasing.
  std::vector<double> times() const {
    std::vector<double> times;
    for (const auto& edge : edges_) {
      times.insert(times.end(), edge.second.poses.times.begin(), edge.second.poses.times.end());
    }
    std::sort(times.begin(), times.end());
    times.erase(std::unique(times.begin(), times.end()), times.end());
    return times;
  }
  /// Names of all frames that have a parent.
  std::vector<std::string> frames() const {
    std::vector<std::string> names;
    for (const auto& edge : edges_) names.push_back(edge.first);
    return names;
  }

 private:
  struct Edge {
    std::string parent;
    bool is_static = false;
    Trajectory poses;  ///< one pose without time if static
    TransformSource source;
    std::string rival;  ///< another namespace, as near, whose transforms of this frame differ
  };
  /// A frame above another one, and the transform to it.
  struct Step {
    std::string frame;
    Pose T_frame_source = Pose::Identity();
  };

  /// Whether points 10 m away keep their place, to 10 cm, from one pose to another.
  static bool are_alike(const Pose& a, const Pose& b) {
    const Pose T = a.inverse() * b;
    return T.translation().norm() + 10.0 * (T.linear() - Eigen::Matrix3d::Identity()).norm() < 0.1;
  }

  std::optional<Pose> pose_at(const Trajectory& trajectory, double time) const {
    const std::vector<Pose>& poses = trajectory.poses;
    if (trajectory.times.empty()) return poses.front();
    if (const auto match = match_time(trajectory, time, longest_gap_)) {
      return interpolate(poses[match->before], poses[match->after], match->share);
    }
    const auto after = std::upper_bound(trajectory.times.begin(), trajectory.times.end(), time);
    const auto next = static_cast<std::size_t>(after - trajectory.times.begin());
    const std::size_t newest = next > 0 ? next - 1 : 0;
    const std::size_t other = next < poses.size() ? next : newest > 0 ? newest - 1 : 0;
    if (!are_alike(poses[newest], poses[other])) return std::nullopt;
    return poses[newest];
  }

  /// `frame` and the frames above it, at most kDeepest.
  std::vector<std::string> frames_above(const std::string& frame) const {
    std::vector<std::string> frames = {frame};
    for (auto edge = edges_.find(frame); edge != edges_.end() && frames.size() <= kDeepest;
         edge = edges_.find(frames.back())) {
      frames.push_back(edge->second.parent);
    }
    return frames;
  }
  /// `source` and the frames above it, as far as transforms lead at that time.
  std::vector<Step> climb(const std::string& source, double time) const {
    std::vector<Step> steps = {{source, Pose::Identity()}};
    while (steps.size() <= kDeepest) {
      const auto edge = edges_.find(steps.back().frame);
      if (edge == edges_.end()) break;
      const std::optional<Pose> T_parent_child = pose_at(edge->second.poses, time);
      if (!T_parent_child) break;
      steps.push_back({edge->second.parent, *T_parent_child * steps.back().T_frame_source});
    }
    return steps;
  }

  std::map<std::string, Edge> edges_;  ///< by child
  std::size_t left_out_ = 0;
  double longest_gap_;
};

}  // namespace dynains
