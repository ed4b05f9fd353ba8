// Poses by tf2, which ROS 1 and ROS 2 share, without waiting.
#pragma once

#if __has_include(<tf2/exceptions.hpp>)  // newer releases
#include <tf2/exceptions.hpp>
#else
#include <tf2/exceptions.h>
#endif

#include <Eigen/Geometry>
#include <string>

#include "dynains/pose.hpp"
#include "ros_common/cloud_queue.hpp"

namespace dynains_ros {

/// The pose of `frame` in `fixed_frame` at `stamp`, by a tf2::BufferCore. A pose at a time before
/// the transforms of the buffer never comes, any other one may. `latest`: the time that asks for
/// the newest transform. `is_before(header.stamp)`: whether that of a transform is before `stamp`.
template <class Buffer, class Time, class IsBefore>
PoseAnswer find_pose(const Buffer& buffer, const std::string& fixed_frame, const std::string& frame,
                     const Time& stamp, const Time& latest, IsBefore&& is_before) {
  PoseAnswer answer;
  // Asked first, because transforms may come between both questions.
  bool is_newest_before = true;
  try {
    is_newest_before = is_before(buffer.lookupTransform(fixed_frame, frame, latest).header.stamp);
  } catch (const tf2::TransformException&) {
  }
  try {
    const auto T = buffer.lookupTransform(fixed_frame, frame, stamp).transform;
    const auto& p = T.translation;
    const auto& q = T.rotation;
    answer.T_fixed_sensor =
        Eigen::Translation3d(p.x, p.y, p.z) * Eigen::Quaterniond(q.w, q.x, q.y, q.z).normalized();
  } catch (const tf2::ExtrapolationException& error) {
    answer.reason = error.what();
    answer.may_come = is_newest_before;
  } catch (const tf2::InvalidArgumentException& error) {  // a name that no frame can have
    answer.reason = error.what();
    answer.may_come = false;
  } catch (const tf2::TransformException& error) {
    answer.reason = error.what();
  }
  return answer;
}

/// The newest pose of `other` in `frame`, which is taken for the one at all times. `latest`: see
/// find_pose().
template <class Buffer, class Time>
PoseAnswer find_extrinsic(const Buffer& buffer, const std::string& frame, const std::string& other,
                          const Time& latest) {
  return find_pose(buffer, frame, other, latest, latest, [](const auto&) { return false; });
}

}  // namespace dynains_ros
