// Clouds of several topics that are one frame, by their stamps. Without types of ROS.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

namespace dynains_ros {

/// Clouds of several sensors at nearly the same time.
template <class CloudPtr>
struct Frame {
  std::vector<CloudPtr> clouds;  ///< by topic; null: none came
  double stamp = 0.0;            ///< s, of anchor()

  /// The cloud whose stamp is that of the frame: the one on the first topic that has one.
  const CloudPtr& anchor() const {
    return *std::find_if(clouds.begin(), clouds.end(), [](const auto& cloud) { return !!cloud; });
  }
};

/// Joins clouds whose stamps are at most half a period apart. A frame is complete when each topic
/// has a cloud, when a cloud of the next frame comes, or after half a period: a sensor that is late
/// or silent holds up nothing else. The period is the least time between two clouds of a topic.
/// Times are in seconds. Not for several threads.
template <class CloudPtr>
class FrameJoiner {
 public:
  explicit FrameJoiner(std::size_t topics) : last_(topics) {}

  /// Takes a cloud of topic `topic`, and calls `release(Frame)` for each frame that is complete.
  template <class Release>
  void add(std::size_t topic, CloudPtr cloud, double stamp, double now, Release&& release) {
    measure_period(topic, stamp);
    if (open_ && stamp < open_->stamp - period_ / 2) return release(alone(topic, cloud, stamp));
    if (open_ && (open_->clouds[topic] || stamp > open_->stamp + period_ / 2)) close(release);
    if (open_) {
      open_->clouds[topic] = std::move(cloud);
      if (open_->anchor() == open_->clouds[topic]) open_->stamp = stamp;
    } else {
      open_ = alone(topic, std::move(cloud), stamp);
      arrival_ = now;
    }
    const auto& clouds = open_->clouds;
    if (std::find(clouds.begin(), clouds.end(), nullptr) == clouds.end()) close(release);
  }

  /// Whether a frame waits for clouds.
  bool is_waiting() const { return open_.has_value(); }
  /// Forgets the frame that waits for clouds.
  void clear() { open_.reset(); }

  /// Releases a frame whose missing clouds are too late.
  template <class Release>
  void poll(double now, Release&& release) {
    if (open_ && std::abs(now - arrival_) > period_ / 2) close(release);
  }

 private:
  void measure_period(std::size_t topic, double stamp) {
    std::optional<double>& last = last_[topic];
    if (last && stamp > *last) period_ = std::min(period_, stamp - *last);
    last = stamp;
  }

  Frame<CloudPtr> alone(std::size_t topic, CloudPtr cloud, double stamp) const {
    Frame<CloudPtr> frame{std::vector<CloudPtr>(last_.size()), stamp};
    frame.clouds[topic] = std::move(cloud);
    return frame;
  }

  template <class Release>
  void close(Release&& release) {
    release(*std::exchange(open_, std::nullopt));
  }

  std::vector<std::optional<double>> last_;  // stamp, by topic
  double period_ = std::numeric_limits<double>::infinity();
  std::optional<Frame<CloudPtr>> open_;
  double arrival_ = 0.0;  // of the first cloud of the open frame
};

}  // namespace dynains_ros
