// Any input gives an exception or a label, and the remover continues to work.

#include "support/catch.hpp"
#include "support/own_stages.hpp"
#include "support/runs.hpp"

namespace dynains {

namespace test {
// A cloud whose points throw at some index.
struct BrokenCloud {
  const std::vector<Eigen::Vector3f>& points;
};
}  // namespace test

template <>
struct PointCloudTraits<test::BrokenCloud> {
  static std::size_t size(const test::BrokenCloud& cloud) { return cloud.points.size(); }
  static Eigen::Vector3f point(const test::BrokenCloud& cloud, std::size_t i) {
    if (2 * i > cloud.points.size()) throw std::runtime_error("lost");
    return cloud.points[i];
  }
};

}  // namespace dynains

namespace dynains::test {
namespace {

using Config = DynaInsRemover::Config;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::vector<Scan> good_scans() { return drive(oncoming(), 7, 5.0); }

Config any_preset() { return GENERATE(Config::paper(), Config()); }

std::vector<PointLabel> labels_of(const Config& config,
                                  const std::vector<Eigen::Vector3f>& points) {
  DynaInsRemover remover(config);
  const FrameResult frame = remover.push(points, Eigen::Isometry3d::Identity());
  return {frame.newest().labels.begin(), frame.newest().labels.end()};
}

Eigen::Isometry3d broken(const std::function<void(Eigen::Matrix4d&)>& damage) {
  Eigen::Isometry3d T = sensor_at(1.0, 2.0, 0.3);
  damage(T.matrix());
  return T;
}

TEST_CASE("an invalid pose or time is refused with its reason, and the state does not change") {
  struct Case {
    const char* reason;
    Eigen::Isometry3d pose;
  };
  const std::vector<Case> cases = {
      {"NaN", broken([](Eigen::Matrix4d& m) { m(0, 3) = kNan; })},
      {"NaN", broken([](Eigen::Matrix4d& m) { m(1, 1) = kNan; })},
      {"infinite", broken([](Eigen::Matrix4d& m) { m(2, 3) = -kInfinity; })},
      {"not rigid", broken([](Eigen::Matrix4d& m) { m.topLeftCorner<3, 3>() *= 2.0; })},
      {"not rigid", broken([](Eigen::Matrix4d& m) { m(0, 1) += 0.1; })},
      {"not rigid", broken([](Eigen::Matrix4d& m) { m.col(0) = -m.col(0); })},  // a mirror
      {"not rigid", broken([](Eigen::Matrix4d& m) { m.topLeftCorner<3, 3>().setZero(); })},
      {"last row", broken([](Eigen::Matrix4d& m) { m(3, 0) = 1.0; })},
      {"last row", broken([](Eigen::Matrix4d& m) { m(3, 3) = 2.0; })},
      {"translation", broken([](Eigen::Matrix4d& m) { m(0, 3) = -1e12; })},
  };
  const Config config = any_preset();
  const std::vector<Scan> scans = good_scans();
  const Run expected = run(config, scans);
  DynaInsRemover remover(config);
  for (std::size_t s = 0; s < scans.size(); ++s) {
    for (const Case& c : cases) {
      CHECK_THROWS_AS(remover.push(scans[s].points, c.pose, scans[s].time), PoseError);
      if (s == 0) {
        CHECK_THROWS_WITH(remover.push(scans[s].points, c.pose, scans[s].time),
                          StartsWith("T_world_sensor") && ContainsSubstring(c.reason));
      }
    }
    for (const double time : {kNan, kInfinity, -kInfinity}) {
      CHECK_THROWS_AS(remover.push(scans[s].points, scans[s].T_world_sensor, time), PoseError);
    }
    for (const double time : {scans[0].time, scans[0].time - 1.0}) {
      if (s == 0) continue;
      CHECK_THROWS_WITH(remover.push(scans[s].points, scans[s].T_world_sensor, time),
                        StartsWith("time = ") && ContainsSubstring("greater than"));
    }
    REQUIRE((Verdict(push(remover, scans[s]).newest()) == expected.newest[s]));
  }
  remover.flush([&](const ScanVerdict& verdict) {
    REQUIRE((Verdict(verdict) == expected.final.at(verdict.scan)));
  });
}

TEST_CASE("a push without a time is 0.1 s later than the one before, however late that was") {
  for (const double time : {0.0, 1e9, 1e15, 1e17, 1e300, -1e17}) {
    CAPTURE(time);
    DynaInsRemover remover(any_preset());
    const std::vector<Scan> scans = good_scans();
    remover.push(scans[0].points, scans[0].T_world_sensor, time);
    for (int i = 1; i < 3; ++i) {
      const auto frame = remover.push(scans[1].points, scans[1].T_world_sensor);
      if (std::abs(time) < 1e15)
        CHECK(frame.newest().time == Approx(time + 0.1 * i).epsilon(1e-12));
    }
  }
  const std::vector<Eigen::Vector3f> cloud = {{10.0F, 0.0F, 1.0F}};
  CHECK(DynaInsRemover().push(cloud, Eigen::Isometry3d::Identity()).newest().time == 0.0);
}

TEST_CASE("a view that would read memory outside the points is refused") {
  DynaInsRemover remover(any_preset());
  const std::vector<float> floats(12, 5.0F);
  const std::vector<double> doubles(12, 5.0);
  const Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  for (const std::size_t stride : {std::size_t{0}, std::size_t{1}, std::size_t{2}}) {
    CHECK_THROWS_AS(remover.push(RawPoints<float>{floats.data(), 4, stride}, pose), CloudError);
    CHECK_THROWS_AS(remover.push(RawPoints<double>{doubles.data(), 4, stride}, pose), CloudError);
    CHECK_THROWS_AS(remover.reserve_like(RawPoints<float>{floats.data(), 4, stride}), CloudError);
  }
  CHECK_THROWS_AS(remover.push(RawPoints<float>{nullptr, 4, 3}, pose), CloudError);
  CHECK_THROWS_AS(remover.push(PointsView{floats, {floats.data(), 11}, floats}, pose), CloudError);
  CHECK_THROWS_AS(remover.push(PointsView{floats, floats, {}}, pose), CloudError);
  CHECK(remover.push(RawPoints<float>{nullptr, 0, 3}, pose).newest().scan == 0);
  CHECK(remover.push(RawPoints<float>{floats.data(), 4, 3}, pose).newest().labels.size() == 4);
}

TEST_CASE("a rotation with the few digits of a text file is accepted") {
  Eigen::Isometry3d T = sensor_at(1.0, 2.0, 0.3);
  T.linear() = (T.linear() * 1e4).array().round() / 1e4;
  DynaInsRemover remover(any_preset());
  const FrameResult frame = remover.push(good_scans()[0].points, T);
  const Eigen::Matrix3d R = frame.newest().T_world_sensor.linear();
  CHECK((R.transpose() * R - Eigen::Matrix3d::Identity()).norm() < 1e-12);
}

TEST_CASE("points that are no measurements get a label for this") {
  constexpr float kNanF = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInf = std::numeric_limits<float>::infinity();
  using L = PointLabel;
  struct Case {
    Eigen::Vector3f point;
    PointLabel label;
  };
  const std::vector<Case> cases = {
      {{kNanF, 0.0F, 0.0F}, L::kInvalid},     {{10.0F, kNanF, 0.0F}, L::kInvalid},
      {{10.0F, 0.0F, kNanF}, L::kInvalid},    {{kNanF, kNanF, kNanF}, L::kInvalid},
      {{kInf, 0.0F, 0.0F}, L::kInvalid},      {{10.0F, -kInf, 0.0F}, L::kInvalid},
      {{10.0F, 0.0F, kInf}, L::kInvalid},     {{0.0F, 0.0F, 0.0F}, L::kInvalid},
      {{-0.0F, 0.0F, -0.0F}, L::kInvalid},    {{1.0F, 1.0F, 0.0F}, L::kOutOfRange},
      {{1e6F, 0.0F, 0.0F}, L::kOutOfRange},   {{3e38F, 3e38F, 0.0F}, L::kOutOfRange},
      {{10.0F, 0.0F, 3e38F}, L::kOutOfRange}, {{10.0F, 0.0F, -1e6F}, L::kOutOfRange},
      {{-10.0F, -0.0F, 0.0F}, L::kStatic},    {{-10.0F, 1e-45F, 1e-45F}, L::kStatic},
  };
  std::vector<Eigen::Vector3f> points;
  for (const Case& c : cases) points.push_back(c.point);
  const Config config = any_preset();
  const std::vector<PointLabel> labels = labels_of(config, points);
  for (std::size_t i = 0; i < cases.size(); ++i) {
    INFO(cases[i].point.transpose());
    CHECK(labels[i] == cases[i].label);
    CHECK(labels_of(config, {cases[i].point}) == std::vector<PointLabel>{cases[i].label});
  }
}

// Patchwork erases reflections below the ground.
TEST_CASE("points far below the ground are not judged by the paper") {
  Config config = Config::paper();
  const auto label_of = [&](float z) { return labels_of(config, {{10.0F, 0.0F, z}})[0]; };
  const auto lowest = static_cast<float>(-1.8 * config.ground.sensor_height);
  CHECK(label_of(lowest + 0.01F) == PointLabel::kStatic);
  CHECK(label_of(lowest - 0.01F) == PointLabel::kOutOfRange);
  config.ground.noise_depth = 0.0;
  CHECK(label_of(lowest - 0.01F) == PointLabel::kStatic);
}

TEST_CASE("bad points do not change the labels of good points") {
  const Config config = any_preset();
  std::vector<Scan> scans = good_scans();
  const Run clean = run(config, scans);
  const std::vector<Eigen::Vector3f> bad = {Eigen::Vector3f::Constant(std::nanf("")),
                                            Eigen::Vector3f::Zero(),
                                            {std::numeric_limits<float>::infinity(), 1.0F, 2.0F},
                                            {1e20F, 1e20F, 1e20F}};
  for (Scan& scan : scans) {
    std::vector<Eigen::Vector3f> mixed;
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      if (i % 5 == 0) mixed.push_back(bad[i / 5 % bad.size()]);
      mixed.push_back(scan.points[i]);
    }
    scan.points = mixed;
  }
  const Run result = run(config, scans);
  for (std::size_t s = 0; s < scans.size(); ++s) {
    std::vector<PointLabel> good;
    for (std::size_t i = 0; i < scans[s].points.size(); ++i) {
      if (i % 6 == 0) {  // a bad point before each five
        REQUIRE(result.final[s].labels[i] <= PointLabel::kOutOfRange);
        REQUIRE(result.final[s].instances[i] == kNoInstance);
        REQUIRE(result.final[s].beliefs[i] == 0.0F);
      } else {
        good.push_back(result.final[s].labels[i]);
      }
    }
    REQUIRE((good == clean.final[s].labels));
  }
}

TEST_CASE("any cloud can come between good ones") {
  struct Case {
    const char* name;
    std::vector<Eigen::Vector3f> points;
  };
  Random random(1);
  std::vector<Case> cases = {
      {"no point", {}},
      {"one point", {{10.0F, 1.0F, 0.0F}}},
      {"nothing but NaN",
       std::vector<Eigen::Vector3f>(1000, Eigen::Vector3f::Constant(std::nanf("")))},
      {"nothing but zeros", std::vector<Eigen::Vector3f>(1000, Eigen::Vector3f::Zero())},
      {"equal points", std::vector<Eigen::Vector3f>(20000, Eigen::Vector3f(8.0F, 3.0F, 0.5F))},
      {"equal points on the floor",
       std::vector<Eigen::Vector3f>(20000, Eigen::Vector3f(8.0F, 3.0F, -1.7F))},
      {"500,000 points", {}},
      {"a vertical line", {}},
  };
  for (int i = 0; i < 500000; ++i) {
    cases[6].points.push_back(random.vector({-60, -60, -2}, {60, 60, 5}).cast<float>());
  }
  for (int i = 0; i < 2000; ++i) {
    cases[7].points.emplace_back(5.0F, 5.0F, random.uniform_float(-200, 200));
  }
  const Config config = any_preset();
  const std::vector<Scan> scans = good_scans();
  const Run expected = run(config, scans);
  for (const Case& c : cases) {
    INFO(c.name);
    DynaInsRemover remover(config);
    // Invalid clouds first, enough to fill a window, then good ones after a pause.
    for (int i = 0; i < 5; ++i) {
      const FrameResult frame = remover.push(c.points, sensor_at(0.0), -100.0 + 0.1 * i);
      REQUIRE(frame.newest().labels.size() == c.points.size());
    }
    for (std::size_t s = 0; s < scans.size(); ++s) {
      const Verdict newest(push(remover, scans[s]).newest());
      // The default preset would derive the sensor model from the cloud of many points.
      if (config.decision == Decision::kFreeSpace && c.points.size() == 500000) continue;
      REQUIRE((newest.labels == expected.newest[s].labels));
    }
  }
}

TEST_CASE("a cloud that throws is not taken, and the state does not change") {
  const Config config = any_preset();
  const std::vector<Scan> scans = drive(oncoming(), 40, 5.0);  // longer than lookahead_scans
  const Run expected = run(config, scans);
  DynaInsRemover remover(config);
  Run result;
  for (const Scan& scan : scans) {
    CHECK_THROWS_WITH(remover.push(BrokenCloud{scan.points}, scan.T_world_sensor, scan.time),
                      "lost");
    const FrameResult frame = push(remover, scan);
    result.newest.emplace_back(frame.newest());
    if (frame.finished) result.final.emplace_back(*frame.finished);
  }
  remover.flush([&](const ScanVerdict& verdict) { result.final.emplace_back(verdict); });
  CHECK((result.newest == expected.newest));
  CHECK((result.final == expected.final));
}

// Throws at the first sensor that it gets.
class FaintingClusterer : public CurvedVoxelClusterer {
 public:
  using CurvedVoxelClusterer::CurvedVoxelClusterer;

  void adapt(const SensorModel& sensor) {
    if (std::exchange(fails_to_adapt_, false)) throw std::bad_alloc();
    CurvedVoxelClusterer::adapt(sensor);
  }

 private:
  bool fails_to_adapt_ = true;
};
struct FaintingClustererStages : DefaultStages {
  using Clusterer = FaintingClusterer;
};

TEST_CASE("a remover that failed to adapt to its sensor adapts at the next scan") {
  BasicDynaInsRemover<FaintingClustererStages> remover;
  const std::vector<Scan> scans = good_scans();
  CHECK_THROWS_AS(push(remover, scans.front()), std::bad_alloc);
  CHECK_FALSE(remover.sensor().known());
  const Run expected = run(Config(), scans);
  const Run result = run(remover, scans);
  CHECK(remover.sensor().known());
  CHECK((result.newest == expected.newest));
  CHECK((result.final == expected.final));
}

TEST_CASE("a moved-from remover throws, and can be assigned to") {
  const std::vector<Scan> scans = drive(yard(), 3, 5.0);
  DynaInsRemover first;
  push(first, scans[0]);
  DynaInsRemover second = std::move(first);
  CHECK_THROWS_AS(push(first, scans[1]), UsageError);
  CHECK_THROWS_AS(first.flush([](const ScanVerdict&) {}), UsageError);
  CHECK(push(second, scans[1]).newest().scan == 1);
  first = std::move(second);
  CHECK(push(first, scans[2]).newest().scan == 2);
}

}  // namespace
}  // namespace dynains::test
