// Transforms between named frames over time, as in ROS.
#pragma once

#include <Eigen/Geometry>
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
void append(double time, const Pose& pose, Trajectory& trajectory);
/// Orders poses by time. Of several poses of one time, the first one stays.
void sort_by_time(Trajectory& trajectory);

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
  void add(const StampedPose& pose, bool is_static, const TransformSource& source = {});
  std::size_t left_out() const { return left_out_; }

  /// Orders the poses of each edge by time, for the members below.
  void sort();

  bool has(const std::string& frame) const { return edges_.count(frame) > 0; }
  /// The frame above `frame` that has no parent; nothing if the frames above it form a loop
  /// or are more than kDeepest.
  std::optional<std::string> root_of(const std::string& frame) const;
  /// Whether a moving transform leads to `frame` from a frame above it.
  bool is_moving(const std::string& frame) const;
  /// Frames with a moving transform to their parent.
  std::vector<std::string> moving_frames() const;
  /// The lowest of the moving frames that all others lie above or below: the body of a robot, also
  /// if its wheels move. Nothing if there is none.
  std::optional<std::string> moving_body() const;
  /// T_target_source at `time` (s), by the nearest frame above both. Nothing if there is none, or
  /// if a moving edge on the way has no pose at that time.
  std::optional<Pose> find(const std::string& target, const std::string& source, double time) const;
  /// A frame between both, and two namespaces that are equally near and place it differently: which
  /// of them find() takes is chance.
  std::optional<std::string> conflict(const std::string& target, const std::string& source) const;
  /// Times of all moving transforms, s, strictly increasing.
  std::vector<double> times() const;
  /// Names of all frames that have a parent.
  std::vector<std::string> frames() const;

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

  std::vector<std::string> frames_above(const std::string& frame) const;
  std::vector<Step> climb(const std::string& source, double time) const;

  std::map<std::string, Edge> edges_;  ///< by child
  std::size_t left_out_ = 0;
  double longest_gap_;
};

}  // namespace dynains
