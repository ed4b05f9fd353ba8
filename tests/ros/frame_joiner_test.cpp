#include "ros_common/frame_joiner.hpp"

#include "support/catch.hpp"

namespace dynains_ros {
namespace {

using StampPtr = std::shared_ptr<const double>;  // its stamp

/// A joiner with the frames that it released, as stamps by topic, "-" for none.
struct Joined {
  FrameJoiner<StampPtr> joiner;
  std::vector<std::string> frames = {};

  void add(std::size_t topic, double stamp, double now) {
    joiner.add(topic, std::make_shared<const double>(stamp), stamp, now,
               [this](const Frame<StampPtr>& frame) { note(frame); });
  }
  void poll(double now) {
    joiner.poll(now, [this](const Frame<StampPtr>& frame) { note(frame); });
  }
  void note(const Frame<StampPtr>& frame) {
    CHECK(frame.stamp == *frame.anchor());
    std::string text;
    for (const StampPtr& cloud : frame.clouds) {
      text += (text.empty() ? "" : " ") + (cloud ? std::to_string(int(*cloud * 1e3 + 0.5)) : "-");
    }
    frames.push_back(text);
  }
};

TEST_CASE("a cloud of one topic is a frame at once") {
  Joined joined{FrameJoiner<StampPtr>(1)};
  for (const double stamp : {1.0, 1.1, 0.5}) joined.add(0, stamp, 9.0);
  CHECK(joined.frames == std::vector<std::string>{"1000", "1100", "500"});
  CHECK_FALSE(joined.joiner.is_waiting());
}

TEST_CASE("clouds within half a period are one frame in any order of arrival") {
  Joined joined{FrameJoiner<StampPtr>(2)};
  joined.add(0, 1.00, 1.10);
  joined.add(1, 1.03, 1.11);
  joined.add(1, 1.13, 1.20);
  joined.add(0, 1.10, 1.21);
  CHECK(joined.frames == std::vector<std::string>{"1000 1030", "1100 1130"});
}

TEST_CASE("a sensor that is late or silent holds up nothing else") {
  Joined joined{FrameJoiner<StampPtr>(2)};
  joined.add(0, 1.0, 1.0);
  joined.poll(1.3);  // the period is not known yet
  CHECK(joined.frames.empty());
  joined.add(0, 1.1, 1.4);
  CHECK(joined.frames == std::vector<std::string>{"1000 -"});
  joined.poll(1.44);
  CHECK(joined.frames.size() == 1);
  joined.poll(1.46);
  CHECK(joined.frames.back() == "1100 -");
  joined.add(0, 1.2, 1.50);
  joined.add(1, 1.12, 1.51);  // after its frame
  CHECK(joined.frames.back() == "- 1120");
  joined.add(1, 1.22, 1.52);
  CHECK(joined.frames.back() == "1200 1220");
  joined.add(1, 1.32, 1.60);
  joined.add(1, 1.42, 1.70);  // the first topic is silent
  CHECK(joined.frames.back() == "- 1320");
}

TEST_CASE("a slow sensor is in some frames of a fast one") {
  Joined joined{FrameJoiner<StampPtr>(2)};
  joined.add(0, 1.00, 1.00);
  joined.add(1, 1.01, 1.01);
  for (const double stamp : {1.1, 1.2}) joined.add(0, stamp, stamp);
  joined.add(1, 1.21, 1.21);
  joined.poll(1.3);
  CHECK(joined.frames == std::vector<std::string>{"1000 1010", "1100 -", "1200 1210"});
}

}  // namespace
}  // namespace dynains_ros
