// Clouds that wait for their poses, in the order of their stamps. Without types of ROS.
#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <string>
#include <utility>

#include "dynains/pose.hpp"

namespace dynains_ros {

/// Why a cloud is left out.
enum class Drop {
  kLate,         ///< its stamp is not after that of a cloud that was taken or waits
  kOverflow,     ///< the oldest of too many clouds that wait
  kNoTransform,  ///< no pose at its stamp within the patience
  kJump,         ///< it waited when time jumped backwards
  kInvalid,      ///< the remover refused its points or its pose
};

inline constexpr std::size_t kDropReasons = 5;

/// Answer to the question for the pose at a stamp.
struct PoseAnswer {
  std::optional<dynains::Pose> T_fixed_sensor;
  bool may_come = true;  ///< false: asking again is of no use
  std::string reason;    ///< why there is no pose
};

/// A queue of `CloudPtr`, which points to a message. Stamps and the present time are in seconds;
/// they may be of different clocks. Not for several threads.
template <class CloudPtr>
class CloudQueue {
 public:
  struct Entry {
    CloudPtr cloud;
    double stamp = 0.0;
    double arrival = 0.0;
  };
  struct Release {
    CloudPtr cloud;
    double stamp = 0.0;
    dynains::Pose T_fixed_sensor;
  };

  /// A step backwards by more than this, s, is a jump of the time if a second cloud confirms it. A
  /// smaller one is a cloud out of order.
  static constexpr double kJump = 1.0;

  /// `patience`: time for which a cloud waits for its pose, s. `capacity`: of clouds that wait, at
  /// least 1.
  CloudQueue(double patience, std::size_t capacity) : patience_(patience), capacity_(capacity) {}

  std::size_t size() const { return waiting_.size(); }
  bool empty() const { return waiting_.empty(); }

  /// Lets a cloud wait. Calls `drop(Drop)` for each cloud that leaves. Returns whether the time
  /// jumped backwards: all that waits is from before the jump and leaves.
  template <class OnDrop>
  bool add(CloudPtr cloud, double stamp, double now, OnDrop&& drop) {
    const bool is_far_back = released_ && stamp < *released_ - kJump;
    const bool has_jumped = is_far_back && far_back_ && stamp > *far_back_;
    far_back_ = is_far_back && !has_jumped ? std::optional<double>(stamp) : std::nullopt;
    if (has_jumped) {
      for (; !waiting_.empty(); waiting_.pop_front()) drop(Drop::kJump);
      released_.reset();
    }
    auto next = waiting_.end();
    while (next != waiting_.begin() && std::prev(next)->stamp > stamp) --next;
    const bool is_known = next != waiting_.begin() && std::prev(next)->stamp == stamp;
    if (is_known || (released_ && !(stamp > *released_))) {
      drop(Drop::kLate);
      return false;
    }
    waiting_.insert(next, Entry{std::move(cloud), stamp, now});
    if (waiting_.size() > capacity_) {
      waiting_.pop_front();
      drop(Drop::kOverflow);
    }
    return has_jumped;
  }

  /// The oldest cloud, if its pose is known. `find_pose(const CloudPtr&)` gives a PoseAnswer. Calls
  /// `drop(Drop, reason)` for each cloud without a pose that leaves.
  template <class FindPose, class OnDrop>
  std::optional<Release> take(double now, FindPose&& find_pose, OnDrop&& drop) {
    while (!waiting_.empty()) {
      Entry& oldest = waiting_.front();
      const PoseAnswer answer = find_pose(std::as_const(oldest.cloud));
      if (answer.T_fixed_sensor) {
        Release result{std::move(oldest.cloud), oldest.stamp, *answer.T_fixed_sensor};
        released_ = oldest.stamp;
        waiting_.pop_front();
        return result;
      }
      if (now < oldest.arrival) oldest.arrival = now;  // the clock was set back
      if (answer.may_come && now - oldest.arrival < patience_) return std::nullopt;
      waiting_.pop_front();
      drop(Drop::kNoTransform, answer.reason);
    }
    return std::nullopt;
  }

 private:
  double patience_;
  std::size_t capacity_;
  std::deque<Entry> waiting_;       // ascending stamps
  std::optional<double> released_;  // stamp of the newest cloud that was taken
  std::optional<double> far_back_;  // stamp of the last cloud, if it may be the first of a jump
};

}  // namespace dynains_ros
