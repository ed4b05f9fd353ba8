#include "ros_common/find_pose.hpp"

#include "support/catch.hpp"

using namespace dynains_ros;

namespace {

struct Transform {
  struct {
    double stamp = 0.0;
  } header;
  struct {
    struct {
      double x = 1.0, y = 2.0, z = 3.0;
    } translation;
    struct {
      double w = 1.0, x = 0.0, y = 0.0, z = 0.0;
    } rotation;
  } transform;
};

constexpr double kLatest = -1.0;

/// A buffer of transforms from time 1 to `newest`; another one comes behind each question.
struct GrowingBuffer {
  mutable double newest;

  Transform lookupTransform(const std::string& /*target*/, const std::string& source,
                            double stamp) const {
    if (source.empty()) throw tf2::InvalidArgumentException("no name");
    const double present = newest;
    newest += 1.0;
    if (stamp != kLatest && (stamp < 1.0 || stamp > present)) {
      throw tf2::ExtrapolationException("not there");
    }
    Transform result;
    result.header.stamp = stamp == kLatest ? present : stamp;
    return result;
  }
};

PoseAnswer ask(double newest, double stamp, const std::string& frame = "lidar") {
  return find_pose(GrowingBuffer{newest}, "map", frame, stamp, kLatest,
                   [&](double time) { return time < stamp; });
}

}  // namespace

TEST_CASE("a pose between the transforms is there") {
  const PoseAnswer answer = ask(5.0, 4.0);
  REQUIRE(answer.T_fixed_sensor);
  CHECK(answer.T_fixed_sensor->translation() == Eigen::Vector3d(1, 2, 3));
}

TEST_CASE("a pose behind the newest transform may come, also if transforms come meanwhile") {
  for (const double stamp : {4.0, 5.0, 9.0}) {
    CAPTURE(stamp);
    const PoseAnswer answer = ask(3.0, stamp);
    CHECK((answer.T_fixed_sensor || answer.may_come));
  }
}

TEST_CASE("a pose before the oldest transform and one of no frame never come") {
  CHECK_FALSE(ask(5.0, 0.5).may_come);
  CHECK(ask(5.0, 0.5).reason == "not there");
  CHECK_FALSE(ask(5.0, 4.0, "").may_come);
}
