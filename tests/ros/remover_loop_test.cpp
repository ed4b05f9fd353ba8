#include "ros_common/remover_loop.hpp"

#include <atomic>

#include "adapters/message.hpp"
#include "ros_common/worker.hpp"
#include "support/catch.hpp"
#include "support/scene.hpp"

namespace dynains_ros {
namespace {

using Message = dynains::test::LookAlike;
using Cloud = std::shared_ptr<const Message>;
using Loop = RemoverLoop<Cloud>;

Cloud message_of(const dynains::test::Scan& scan, double stamp) {
  auto message = dynains::test::make_message<Message>(scan.points);
  const double second = std::floor(stamp);
  message.header.stamp.sec = static_cast<std::int32_t>(second);
  message.header.stamp.nanosec = static_cast<std::uint32_t>(std::lround(1e9 * (stamp - second)));
  return std::make_shared<const Message>(std::move(message));
}

/// A street that is driven along, with a van that comes the other way.
std::vector<dynains::test::Scan> scans(int count) {
  return dynains::test::drive(dynains::test::oncoming(), count, 5.0);
}

PoseAnswer no_extrinsic(const std::string&, const std::string&) {
  throw std::logic_error("no extrinsic");
}

/// A loop whose transforms are all known, with what it published.
struct Node {
  Loop loop;
  std::vector<dynains::test::Scan> scans;
  std::vector<std::vector<dynains::PointLabel>> labels = {};

  void add(std::size_t scan, double stamp) { loop.add(message_of(scans[scan], stamp), stamp); }

  bool clean(const dynains::Pose& T_world_sensor) {
    return loop.clean_next(
        0.0,
        [&](const Cloud&) {
          return PoseAnswer{T_world_sensor, true, ""};
        },
        no_extrinsic,
        [&](const Frame<Cloud>&, const Cleaned& cleaned) {
          labels.emplace_back(cleaned.labels.begin(), cleaned.labels.end());
        });
  }
};

dynains::DynaInsRemover::Config paper() { return dynains::DynaInsRemover::Config::paper(); }

TEST_CASE("a loop gives the labels of the remover") {
  Node node{Loop(paper(), {}), scans(6)};
  dynains::DynaInsRemover remover(paper());
  for (std::size_t i = 0; i < node.scans.size(); ++i) {
    const dynains::test::Scan& scan = node.scans[i];
    const double stamp = 100.0 + scan.time;
    node.add(i, stamp);
    CHECK(node.loop.is_waiting());
    REQUIRE(node.clean(scan.T_world_sensor));
    CHECK_FALSE(node.loop.is_waiting());
    CHECK_FALSE(node.clean(scan.T_world_sensor));
    const auto frame = remover.push(scan.points, scan.T_world_sensor, stamp);
    CHECK(node.labels.back() == std::vector<dynains::PointLabel>(frame.newest().labels.begin(),
                                                                 frame.newest().labels.end()));
  }
  const Diagnosis diagnosis = node.loop.report(1.0);
  CHECK(diagnosis.message == "clouds are cleaned");
  CHECK(diagnosis.values.at(1) == std::pair<std::string, std::string>("cleaned (Hz)", "6.0"));
  CHECK(node.loop.report(1.0).message == "no cloud arrives");
}

TEST_CASE("a map is published by change, to readers, and not too often") {
  Loop::Config config;
  config.map_period = 2.0;
  Node node{Loop(paper(), config), scans(8)};
  std::vector<std::size_t> sizes;
  const auto publish = [&](double now, bool has_readers) {
    node.loop.publish_map(now, has_readers, [&](const auto& map) { sizes.push_back(map.size()); });
    return sizes.size();
  };
  CHECK(publish(10.0, true) == 0);  // no map yet
  for (std::size_t i = 0; i < 5; ++i) {
    node.add(i, 100.0 + node.scans[i].time);
    node.clean(node.scans[i].T_world_sensor);
  }
  CHECK(publish(10.0, false) == 0);
  CHECK(publish(10.0, true) == 1);
  CHECK(publish(13.0, true) == 1);  // the same map
  node.add(6, 100.0 + node.scans[6].time);
  node.clean(node.scans[6].T_world_sensor);
  CHECK(publish(11.9, true) == 1);
  CHECK(publish(12.0, true) == 2);
  CHECK(sizes[1] > sizes[0]);
}

TEST_CASE("when time jumps backwards, the remover starts anew and so does the map") {
  Node node{Loop(paper(), {}), scans(8)};
  const auto push = [&](std::size_t scan, double stamp) {
    const bool has_jumped = node.loop.add(message_of(node.scans[scan], stamp), stamp);
    node.clean(node.scans[scan].T_world_sensor);
    return has_jumped;
  };
  for (std::size_t i = 0; i < 8; ++i) CHECK_FALSE(push(i, 100.0 + node.scans[i].time));
  CHECK(node.labels.size() == 8);
  const std::vector<std::vector<dynains::PointLabel>> first = node.labels;
  CHECK_FALSE(push(0, 50.0));
  for (std::size_t i = 0; i < 8; ++i) CHECK(push(i, 51.0 + node.scans[i].time) == (i == 0));
  REQUIRE(node.labels.size() == 16);
  node.labels.erase(node.labels.begin(), node.labels.begin() + 8);
  CHECK(node.labels == first);
}

TEST_CASE("a bad cloud and a failing publisher are counted, and the loop goes on") {
  Node node{Loop(paper(), {}), scans(2)};
  auto broken = std::make_shared<Message>(*message_of(node.scans[0], 100.0));
  broken->fields[0].name = "Z";
  node.loop.add(broken, 0.0);
  CHECK(node.clean(dynains::Pose::Identity()));
  CHECK(node.labels.empty());
  CHECK(node.loop.report(1.0).message ==
        "no cloud is taken: 1 refused (PointCloud2: no field 'z', only: Z, ring, x, y)");

  node.add(1, 100.5);
  CHECK(node.loop.clean_next(
      0.0,
      [](const Cloud&) {
        return PoseAnswer{dynains::Pose::Identity(), true, ""};
      },
      no_extrinsic, [](const Frame<Cloud>&, const Cleaned&) { throw std::runtime_error("full"); }));
  const Diagnosis diagnosis = node.loop.report(1.0);
  CHECK(diagnosis.message == "messages that could not be published: 1");
}

TEST_CASE("with odometry, clouds alone are cleaned, and pass whole after a loss") {
  Loop::Config config;
  config.odometry = true;
  Loop loop(dynains::DynaInsRemover::Config::odometry(), config);
  const std::vector<dynains::test::Scan> drive = scans(12);
  std::size_t moving = 0, whole = 0, posed = 0;
  double x = 0.0;
  const auto push = [&](const dynains::test::Scan& scan, double stamp) {
    loop.add(message_of(scan, stamp), stamp);
    return loop.clean_next(
        stamp + 0.02, [](const Cloud&) -> PoseAnswer { throw std::logic_error("no pose"); },
        no_extrinsic,
        [&](const Frame<Cloud>&, const Cleaned& cleaned) {
          whole += cleaned.labels.empty() ? 1 : 0;
          posed += cleaned.T_odom_sensor ? 1 : 0;
          if (cleaned.T_odom_sensor) x = cleaned.T_odom_sensor->translation().x();
          moving += static_cast<std::size_t>(std::count(
              cleaned.labels.begin(), cleaned.labels.end(), dynains::PointLabel::kDynamic));
        });
  };
  for (const dynains::test::Scan& scan : drive) REQUIRE(push(scan, 100.0 + scan.time));
  CHECK(posed == 12);
  CHECK(whole == 0);
  CHECK(moving > 0);
  const double way =
      (drive.front().T_world_sensor.inverse() * drive.back().T_world_sensor).translation().norm();
  CHECK(x == Approx(way).margin(0.2));
  const Diagnosis diagnosis = loop.report(1.0);
  CHECK(diagnosis.level == Diagnosis::Level::kOk);
  CHECK(diagnosis.values[diagnosis.values.size() - 2].first == "latency (ms)");
  CHECK(std::stod(diagnosis.values[diagnosis.values.size() - 2].second) > 20.0);

  dynains::test::Scan empty = drive.front();  // a sensor that is covered
  for (auto& point : empty.points) point.setZero();
  REQUIRE(push(empty, 101.5));
  CHECK(whole == 1);
  CHECK_THAT(loop.report(1.0).message,
             ContainsSubstring("track is lost: 1 clouds pass with their moving points (too few"));
  const double before = x;
  for (const dynains::test::Scan& scan : drive) REQUIRE(push(scan, 110.0 + scan.time));
  CHECK(posed == 23);  // the first cloud after the gap is lost, the others begin where it was
  CHECK(x == Approx(before + way).margin(0.5 + 0.2 * way));
}

TEST_CASE("clouds of two sensors are one frame, and each gets the labels of its points") {
  const dynains::Pose T_front_rear =
      Eigen::Translation3d(-0.5, 0.1, 0.2) * Eigen::AngleAxisd(3.0, Eigen::Vector3d::UnitZ());
  Loop::Config config;
  config.topics = 2;
  Loop loop(paper(), config);
  auto two_sensors = paper();
  two_sensors.sensors.push_back(T_front_rear);
  dynains::DynaInsRemover remover(two_sensors);
  const auto cloud_of = [](const std::vector<Eigen::Vector3f>& points, double time,
                           const char* frame) {
    auto message =
        std::make_shared<Message>(*message_of({dynains::Pose::Identity(), 0.0, points, {}}, time));
    message->header.frame_id = frame;
    return message;
  };
  std::size_t moving = 0;
  for (const dynains::test::Scan& scan : scans(10)) {
    std::vector<Eigen::Vector3f> front, rear, all;
    std::vector<std::uint8_t> sensors;
    for (std::size_t i = 0; i < scan.points.size(); ++i)
      (i % 3 ? front : rear).push_back(scan.points[i]);
    all = front;
    all.insert(all.end(), rear.begin(), rear.end());
    sensors.resize(front.size(), 0);
    sensors.resize(all.size(), 1);
    for (auto& point : rear) point = T_front_rear.inverse().cast<float>() * point;
    const double stamp = 100.0 + scan.time;
    loop.add(cloud_of(rear, stamp - 0.01, "rear"), stamp, 1);
    CHECK(loop.is_waiting());
    loop.add(cloud_of(front, stamp, "front"), stamp, 0);
    std::vector<std::vector<dynains::PointLabel>> labels(2);
    REQUIRE(loop.clean_next(
        stamp,
        [&](const Cloud& cloud) {
          const bool is_rear = cloud->header.frame_id == "rear";
          return PoseAnswer{is_rear ? scan.T_world_sensor * T_front_rear : scan.T_world_sensor,
                            true, ""};
        },
        [&](const std::string& frame, const std::string& other) {
          CHECK(frame == "front");
          CHECK(other == "rear");
          return PoseAnswer{T_front_rear, true, ""};
        },
        [&](const Frame<Cloud>& clouds, const Cleaned& cleaned) {
          CHECK(cleaned.frame_id == "front");
          CHECK(clouds.stamp == Approx(stamp));
          cleaned.for_each_cloud(clouds, [&](std::size_t i, const Message&, const auto& of_cloud) {
            labels[i].assign(of_cloud.begin(), of_cloud.end());
          });
        }));
    const dynains::RawPoints<float> merged{all.front().data(), all.size(), 3, sensors.data()};
    const auto expected = remover.push(merged, scan.T_world_sensor, stamp).newest().labels;
    REQUIRE(labels[0].size() == front.size());
    REQUIRE(labels[1].size() == rear.size());
    std::size_t different = 0;  // rounding of the transform of the points
    for (std::size_t i = 0; i < all.size(); ++i) {
      const auto label = i < front.size() ? labels[0][i] : labels[1][i - front.size()];
      different += label == expected[i] ? 0 : 1;
      moving += label == dynains::PointLabel::kDynamic ? 1 : 0;
    }
    CHECK(different <= all.size() / 200);
  }
  CHECK(moving > 0);
  config.sensor_frames = {"front"};
  CHECK_THROWS_AS(Loop(paper(), config), dynains::ConfigError);
  config.topics = 0;
  CHECK_THROWS_AS(Loop(paper(), config), dynains::ConfigError);
}

TEST_CASE("a worker works when it is woken, and ends at once") {
  std::atomic<int> steps{0};
  {
    Worker worker([&] {
      ++steps;
      return Worker::Wait(3600000);
    });
    while (steps < 1) std::this_thread::yield();
    worker.wake();
    while (steps < 2) std::this_thread::yield();
  }
  CHECK(steps == 2);
}

TEST_CASE("a slow reader gets the newest value, and the sender does not wait") {
  std::atomic<bool> is_stuck{true};
  std::atomic<int> begun{0};
  std::atomic<int> last{0};
  Outbox<std::unique_ptr<int>> outbox([&](std::unique_ptr<int> value) {
    ++begun;
    while (is_stuck) std::this_thread::yield();
    last = *value;
  });
  outbox.post(std::make_unique<int>(1));
  while (begun < 1) std::this_thread::yield();
  for (const int value : {2, 3, 4}) outbox.post(std::make_unique<int>(value));
  is_stuck = false;
  while (last != 4) std::this_thread::yield();
  CHECK(begun == 2);
}

}  // namespace
}  // namespace dynains_ros
