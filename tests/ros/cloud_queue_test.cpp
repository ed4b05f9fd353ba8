#include "ros_common/cloud_queue.hpp"

#include "support/catch.hpp"

namespace dynains_ros {
namespace {

/// A queue of clouds that are numbers, and what left it. The pose of a cloud is known if
/// `known_until` is not before it; it never comes if the cloud is before `known_from`.
struct Line {
  CloudQueue<int> queue;
  double known_from = 0.0;
  double known_until = 1e9;
  std::vector<int> taken = {};
  std::vector<Drop> drops = {};
  std::vector<std::string> reasons = {};

  bool add(int stamp, double now) {
    return queue.add(stamp, stamp, now, [this](Drop reason) { drops.push_back(reason); });
  }

  void take_all(double now) {
    const auto pose_of = [this](int stamp) {
      if (stamp < known_from) return PoseAnswer{{}, false, "in the past"};
      if (stamp > known_until) return PoseAnswer{{}, true, "in the future"};
      return PoseAnswer{dynains::Pose::Identity(), true, ""};
    };
    while (const auto next = queue.take(now, pose_of, [this](Drop reason, const std::string& text) {
      drops.push_back(reason);
      reasons.push_back(text);
    })) {
      CHECK(next->stamp == next->cloud);
      taken.push_back(next->cloud);
    }
  }
};

using Stamps = std::vector<int>;
using Drops = std::vector<Drop>;

TEST_CASE("clouds wait for their poses, and leave in the order of their stamps") {
  Line line{CloudQueue<int>(0.5, 10)};
  line.known_until = 1;
  for (const int stamp : {1, 3, 2, 4}) line.add(stamp, 100.0);
  line.take_all(100.1);
  CHECK(line.taken == Stamps{1});
  line.known_until = 3;
  line.take_all(100.2);
  CHECK(line.taken == Stamps{1, 2, 3});
  CHECK(line.queue.size() == 1);
  CHECK(line.drops.empty());
}

TEST_CASE("a cloud without a pose leaves when its patience ends, also if the clock is set back") {
  const double now = GENERATE(100.0, 7.0);
  Line line{CloudQueue<int>(0.5, 10)};
  line.known_until = 0;
  line.add(1, 100.0);
  line.take_all(now);
  line.take_all(now + 0.4375);
  CHECK(line.queue.size() == 1);
  line.take_all(now + 0.5);
  CHECK(line.queue.empty());
  CHECK(line.drops == Drops{Drop::kNoTransform});
  CHECK(line.reasons == std::vector<std::string>{"in the future"});
}

TEST_CASE("a cloud whose pose can never come does not hold up the others") {
  Line line{CloudQueue<int>(0.5, 10)};
  line.known_from = 2;
  for (const int stamp : {1, 2}) line.add(stamp, 100.0);
  line.take_all(100.0);
  CHECK(line.taken == Stamps{2});
  CHECK(line.drops == Drops{Drop::kNoTransform});
}

TEST_CASE("of too many clouds the oldest leaves") {
  Line line{CloudQueue<int>(0.5, 3)};
  for (const int stamp : {1, 2, 3}) line.add(stamp, 100.0);
  CHECK(line.drops.empty());
  line.add(4, 100.0);
  CHECK(line.drops == Drops{Drop::kOverflow});
  line.take_all(100.0);
  CHECK(line.taken == Stamps{2, 3, 4});
}

TEST_CASE("late clouds and second copies are left out") {
  Line line{CloudQueue<int>(0.5, 10)};
  for (const int stamp : {10, 11, 11}) line.add(stamp, 100.0);
  CHECK(line.drops == Drops{Drop::kLate});  // waits already
  line.take_all(100.0);
  for (const int stamp : {11, 10}) CHECK_FALSE(line.add(stamp, 100.0));
  CHECK(line.drops == Drops(3, Drop::kLate));
  CHECK(line.queue.empty());
}

TEST_CASE("time jumps backwards when a second cloud confirms it") {
  Line line{CloudQueue<int>(0.5, 10)};
  line.known_until = 50;
  for (const int stamp : {50, 51}) line.add(stamp, 100.0);
  line.take_all(100.0);
  CHECK_FALSE(line.add(3, 100.0));

  SECTION("the second one goes on from there") {
    CHECK(line.add(4, 100.0));
    CHECK(line.drops == Drops{Drop::kLate, Drop::kJump});  // 3, and 51, which waited
    line.add(5, 100.0);
    line.take_all(100.0);
    CHECK(line.taken == Stamps{50, 4, 5});
  }
  SECTION("the same stamp again confirms nothing") {
    CHECK_FALSE(line.add(3, 100.0));
    CHECK(line.add(4, 100.0));
  }
  SECTION("one bad stamp among good ones is a late cloud") {
    CHECK_FALSE(line.add(52, 100.0));
    CHECK_FALSE(line.add(4, 100.0));
    CHECK_FALSE(line.add(53, 100.0));
    line.known_until = 60;
    line.take_all(100.0);
    CHECK(line.taken == Stamps{50, 51, 52, 53});
    CHECK(line.drops == Drops(2, Drop::kLate));
  }
}

TEST_CASE("a step back by at most a second is no jump") {
  Line line{CloudQueue<int>(0.5, 10)};
  line.add(50, 100.0);
  line.take_all(100.0);
  for (int i = 0; i < 3; ++i) CHECK_FALSE(line.add(49, 100.0));
  CHECK(line.drops == Drops(3, Drop::kLate));
}

TEST_CASE("a stamp far in the future does not hold up the clouds behind it") {
  Line line{CloudQueue<int>(0.5, 10)};
  line.known_until = 1000;
  line.add(2000, 100.0);
  for (const int stamp : {1, 2, 3}) line.add(stamp, 100.1);
  line.take_all(100.1);
  CHECK(line.taken == Stamps{1, 2, 3});
  line.take_all(100.5);
  CHECK(line.drops == Drops{Drop::kNoTransform});
}

}  // namespace
}  // namespace dynains_ros
