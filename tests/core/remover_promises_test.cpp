// Guarantees of the facade, on scenes with known truth.
#include <thread>

#include "support/catch.hpp"
#include "support/runs.hpp"

namespace dynains::test {
namespace {

using Config = DynaInsRemover::Config;

// Indices of the dynamic points of one verdict.
std::vector<std::size_t> dynamic_points(const Verdict& verdict) {
  std::vector<std::size_t> result;
  for (std::size_t i = 0; i < verdict.labels.size(); ++i) {
    if (verdict.labels[i] == PointLabel::kDynamic) result.push_back(i);
  }
  return result;
}

bool is_subset(const Verdict& a, const Verdict& b) {
  const auto inner = dynamic_points(a);
  const auto outer = dynamic_points(b);
  return std::includes(outer.begin(), outer.end(), inner.begin(), inner.end());
}

std::size_t dynamic_count(const std::vector<Verdict>& verdicts) {
  std::size_t result = 0;
  for (const Verdict& verdict : verdicts) result += dynamic_points(verdict).size();
  return result;
}

TEST_CASE("in a static scene at most 0.1 % is removed, with any motion and heading of the sensor") {
  const Config config = GENERATE(Config::paper(), Config());
  const auto [speed, yaw] = GENERATE(table<double, double>({{0.0, 0.7}, {5.0, 3.1}, {8.0, 0.0}}));
  const std::vector<Scan> scans = drive(yard(), 12, speed, yaw);
  INFO("speed " << speed << " m/s, yaw " << yaw);
  CHECK(share(scans, run(config, scans).final, PointLabel::kDynamic).value() < 1e-3);
}

Config with_references(int step) {
  Config config;
  config.evidence.reference_step = step;
  return config;
}

TEST_CASE("a moving van is removed, and static objects around it stay") {
  const Config config = GENERATE(Config::paper(), Config(), with_references(1), with_references(4));
  const auto [speed, yaw] =  // also across the azimuth seam
      GENERATE(table<double, double>({{0.0, 0.7}, {0.0, 3.1}, {5.0, 0.0}, {5.0, 1.6}}));
  const std::vector<Scan> scans = drive(oncoming(), 10, speed, yaw);
  const std::vector<Verdict> verdicts = run(config, scans).final;
  INFO("speed " << speed << " m/s, yaw " << yaw);
  const Share moving = share(scans, verdicts, PointLabel::kDynamic, kAddedBox);
  REQUIRE(moving.total > 5000);
  CHECK(moving.value() > 0.9);
  CHECK(share(scans, verdicts, PointLabel::kStatic, kAddedBox).value() < 0.02);
  const Share all = share(scans, verdicts, PointLabel::kDynamic);
  CHECK(all.labelled - moving.labelled < all.total / 200);
}

TEST_CASE("a van passes under a bridge: the van goes, the bridge stays") {
  const Config config = GENERATE(Config::paper(), Config());
  const double yaw = GENERATE(0.0, 0.7, 3.1);
  Scene scene = oncoming();
  scene.boxes.push_back({{14.0, -12.0, 4.2}, {18.0, 12.0, 5.2}});
  const std::vector<Scan> scans = drive(scene, 10, 0.0, yaw);
  const std::vector<Verdict> verdicts = run(config, scans).final;
  CHECK(share(scans, verdicts, PointLabel::kDynamic, kAddedBox).value() > 0.9);
  const Share bridge = share(scans, verdicts, PointLabel::kDynamic, kAddedBox + 1);
  REQUIRE(bridge.total > 10000);
  CHECK(bridge.value() < 0.01);
}

TEST_CASE("the map is exactly the points with a static final label, each once") {
  const Config paper = GENERATE(Config::paper(), Config());
  Config config = paper;
  config.map.map_voxel = 0.0;
  const std::vector<Scan> scans = drive(oncoming(), 7, 5.0, 0.4);
  DynaInsRemover remover(config);
  const Run result = run(remover, scans);
  std::vector<Eigen::Vector3d> expected, found = map_points(remover);
  for (const Verdict& verdict : result.final) {
    const Scan& scan = scans[verdict.scan];
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      if (!is_static(verdict.labels[i])) continue;
      expected.emplace_back(scan.T_world_sensor * scan.points[i].cast<double>());
    }
  }
  REQUIRE(found.size() == expected.size());
  for (int axis = 0; axis < 3; ++axis) {
    const auto by_axis = [axis](const auto& a, const auto& b) { return a[axis] < b[axis]; };
    std::sort(found.begin(), found.end(), by_axis);
    std::sort(expected.begin(), expected.end(), by_axis);
    for (std::size_t i = 0; i < found.size(); ++i) {
      REQUIRE(std::abs(found[i][axis] - expected[i][axis]) < 1e-4);
    }
  }
}

TEST_CASE("without a map the labels are equal") {
  Config config = Config::paper();
  const std::vector<Scan> scans = drive(oncoming(), 6, 0.0);
  const Run with_map = run(config, scans);
  config.build_map = false;
  DynaInsRemover remover(config);
  CHECK((run(remover, scans).final == with_map.final));
  CHECK(remover.map().empty());
}

TEST_CASE("the first scan alone shows no dynamic point, two scans do") {
  const std::vector<Scan> scans = drive(oncoming(), 2, 0.0);
  const Run result = run_paper(scans);
  CHECK(dynamic_points(result.newest[0]).empty());
  CHECK(share(scans, {result.newest[1]}, PointLabel::kDynamic, kAddedBox).value() > 0.5);
  CHECK(dynamic_count(run_paper({scans[0]}).final) == 0);
}

TEST_CASE("each window is judged on its own: scans before it have no influence") {
  const std::vector<Scan> scans = drive(oncoming(), 8, 5.0);
  const Run whole = run_paper(scans);
  for (std::ptrdiff_t last = 4; last < 8; ++last) {
    const std::vector<Scan> window(scans.begin() + last - 3, scans.begin() + last + 1);
    const Verdict newest = run_paper(window).newest.back();
    const Verdict& expected = whole.newest[static_cast<std::size_t>(last)];
    CHECK((newest.labels == expected.labels));
    CHECK((newest.beliefs == expected.beliefs));
  }
}

TEST_CASE("equal input gives equal bytes, also in two threads at once") {
  const Config config = GENERATE(Config::paper(), Config());
  const std::vector<Scan> scans = drive(oncoming(), 8, 5.0);
  const Run expected = run(config, scans);
  Run a, b;
  std::thread first([&] { a = run(config, scans); });
  std::thread second([&] { b = run(config, scans); });
  first.join();
  second.join();
  CHECK((a.final == expected.final));
  CHECK((b.final == expected.final));
  CHECK((a.newest == expected.newest));
  CHECK((b.newest == expected.newest));
}

TEST_CASE("reserved memory changes no result, and can be reserved before the first scan only") {
  const Config config = GENERATE(Config::paper(), Config());
  static const std::vector<Scan> scans = drive(oncoming(), 8, 5.0);
  DynaInsRemover remover(config);
  // Less memory than the scans need, more than they need, and as much as they need.
  std::vector<Eigen::Vector3f> example = scans[0].points;
  example.resize(GENERATE(std::size_t{1000}, std::size_t{200000}, scans[0].points.size()),
                 Eigen::Vector3f(20.0F, 3.0F, 0.5F));
  remover.reserve_like(example, GENERATE(std::size_t{0}, std::size_t{3}, std::size_t{8}));
  const Run reserved = run(remover, scans);
  DynaInsRemover unprepared(config);
  const Run plain = run(unprepared, scans);
  const std::size_t map_size = unprepared.map().size();
  CHECK(remover.map().size() == map_size);
  CHECK(reserved.newest == plain.newest);
  CHECK(reserved.final == plain.final);
  CHECK_THROWS_AS(remover.reserve_like(example), UsageError);
  remover.reset();
  CHECK_NOTHROW(remover.reserve_like(example));
  CHECK(run(remover, scans).final == plain.final);
  CHECK(remover.map().size() == map_size);
}

TEST_CASE("a sensor model from a later scan changes nothing in earlier scans") {
  // Scans with too few points for a sensor model: ground, and a wall behind it. In one of them, an
  // object stands in front of the wall.
  std::vector<Scan> scans;
  const auto add_scan = [&scans] {
    scans.push_back(
        {Eigen::Isometry3d::Identity(), 0.1 * static_cast<double>(scans.size()), {}, {}});
  };
  for (int s = 0; s < 11; ++s) {
    add_scan();
    std::vector<Eigen::Vector3f>& points = scans.back().points;
    for (int i = 0; i < 13 * 13; ++i) {
      points.emplace_back(6.0F + 0.3F * static_cast<float>(i / 13),
                          0.15F * static_cast<float>(i % 13 - 6), -1.723F);
    }
    const bool stands = s == 5;
    const int edge = stands ? 10 : 18;
    for (int i = 0; i < edge * edge; ++i) {
      const auto across = static_cast<float>(i / edge);
      const auto up = static_cast<float>(i % edge);
      points.push_back(stands
                           ? Eigen::Vector3f(8.0F, -0.2F + 0.04F * across, -1.0F + 0.1F * up)
                           : Eigen::Vector3f(30.0F, -0.95F + 0.12F * across, -3.9F + 0.22F * up));
    }
    REQUIRE(points.size() < 500);
  }
  const std::vector<Verdict> alone = run(Config(), scans).final;
  CHECK(dynamic_count(alone) > 50);

  // Then a dome of many beams, from straight down to straight up.
  add_scan();
  for (int i = 0; i < 600 * 200; ++i) {
    const float azimuth = 0.0026F * static_cast<float>(i % 200) - 0.26F;
    const float elevation = 0.005F * static_cast<float>(i / 200) - 1.5F;
    scans.back().points.emplace_back(20.0F * std::cos(azimuth) * std::cos(elevation),
                                     20.0F * std::sin(azimuth) * std::cos(elevation),
                                     20.0F * std::sin(elevation));
  }
  const std::vector<Verdict> all = run(Config(), scans).final;
  REQUIRE(all.size() == alone.size() + 1);
  CHECK(std::equal(alone.begin(), alone.end(), all.begin()));
}

TEST_CASE("instance ids stay with an object and are never shared") {
  const std::vector<Scan> scans = drive(oncoming(), 10, 5.0);
  const Run result = run_paper(scans);
  std::set<std::uint32_t> ids_of_van;
  for (std::size_t s = 1; s < scans.size(); ++s) {
    // Most frequent id of each object in this scan.
    std::map<int, std::map<std::uint32_t, int>> votes;
    for (std::size_t i = 0; i < scans[s].points.size(); ++i) {
      const std::uint32_t id = result.newest[s].instances[i];
      const bool is_ground = result.newest[s].labels[i] == PointLabel::kGround;
      if (is_ground) REQUIRE(id == kNoInstance);
      if (scans[s].object[i] != kGroundObject && !is_ground) ++votes[scans[s].object[i]][id];
    }
    std::set<std::uint32_t> ids;
    for (const auto& [object, counts] : votes) {
      const auto most =
          std::max_element(counts.begin(), counts.end(),
                           [](const auto& a, const auto& b) { return a.second < b.second; });
      CHECK(most->first != kNoInstance);
      CHECK(ids.insert(most->first).second);
      if (object == kAddedBox) ids_of_van.insert(most->first);
    }
  }
  CHECK(ids_of_van.size() == 1);
}

TEST_CASE("votes: the more windows must agree, the less is removed") {
  const std::vector<Scan> scans = drive(oncoming(), 10, 5.0);
  Config config = Config::paper();
  config.votes = 0;
  const Run newest_alone = run(config, scans);
  CHECK((newest_alone.final == newest_alone.newest));  // without latency, both verdicts are equal
  std::vector<Verdict> looser;
  for (int votes = 1; votes <= config.window; ++votes) {
    config.votes = votes;
    const Run result = run(config, scans);
    INFO(votes << " votes");
    for (std::size_t s = 0; s < scans.size(); ++s) {
      CHECK(result.newest[s].labels == newest_alone.newest[s].labels);
      if (votes == 1) CHECK(is_subset(result.newest[s], result.final[s]));
      if (votes > 1) CHECK(is_subset(result.final[s], looser[s]));
    }
    if (votes > 1) CHECK(dynamic_count(result.final) < dynamic_count(looser));
    looser = result.final;
  }
  // The first and the last scan are in fewer than K windows that compare, so that they never get
  // four votes.
  CHECK(dynamic_points(looser.front()).empty());
  CHECK(dynamic_points(looser.back()).empty());
}

TEST_CASE("verdicts on newest scans are the same whether or not those before were read") {
  const std::vector<Scan> scans = drive(oncoming(), 12, 5.0);
  Config config = GENERATE(Config::paper(), Config());
  config.evidence.lookahead_scans = 4;
  config.threads = GENERATE(1, 2);
  const Run all = run(config, scans);
  DynaInsRemover remover(config);
  std::vector<Verdict> finals;
  const auto take = [&](const ScanVerdict& verdict) { finals.emplace_back(verdict); };
  for (std::size_t s = 0; s < scans.size(); ++s) {
    const FrameResult frame = push(remover, scans[s]);
    if (frame.finished) take(*frame.finished);
    CHECK(frame.newest().time == scans[s].time);
    if (s % 3 == 0) CHECK((Verdict(frame.newest()) == all.newest[s]));
    if (s + 1 == scans.size()) {
      remover.flush(take);
      CHECK((Verdict(frame.newest()) == all.newest[s]));
    }
  }
  CHECK((finals == all.final));
  CHECK(remover.map().size() > 0);
}

TEST_CASE("instance ids continue from scan to scan, however soon a verdict is final") {
  const std::vector<Scan> scans = drive(oncoming(), 10, 5.0);
  Config config;
  const Run late = run(config, scans);
  config.evidence.lookahead_scans = 0;
  const Run at_once = run(config, scans);
  for (std::size_t s = 0; s < scans.size(); ++s) {
    CHECK(at_once.newest[s].instances == late.newest[s].instances);
  }
}

// A wall comes into view behind the corner of a house; a van comes on the other side.
constexpr int kVan = 0, kWall = 2;
Scene street_corner() {
  return {{van(22.0, -3.5, {-12.0, 0.0, 0.0}),
           {{-20.0, 4.0, 0.0}, {4.0, 10.0, 6.0}},
           {{6.0, 16.0, 0.0}, {15.0, 16.5, 4.0}}}};
}

std::size_t removed_of(int object, const Config& config, const std::vector<Scan>& scans) {
  return share(scans, run(config, scans).final, PointLabel::kDynamic, object).labelled;
}

TEST_CASE("belief reverts a wall that comes into view, and no van") {
  const std::vector<Scan> scans = drive(street_corner(), 16, 4.0);
  Config config = Config::paper();
  const auto removed = [&](int object) { return removed_of(object, config, scans); };
  config.use_belief = false;
  const std::size_t wall_without_belief = removed(kWall);
  const std::size_t van_without_belief = removed(kVan);
  REQUIRE(wall_without_belief > 2000);
  REQUIRE(van_without_belief > 2000);

  config.use_belief = true;
  CHECK(removed(kWall) < wall_without_belief / 10);
  CHECK(removed(kVan) == van_without_belief);
  config.belief_observations = BeliefObservations::kOthers;
  CHECK(removed(kWall) == wall_without_belief);
}

TEST_CASE("rules of the public implementation: big instances, and those that come into view") {
  Scene scene = street_corner();
  scene.boxes.push_back(van(40.0, 6.0, {-12.0, 0.0, 0.0}));
  scene.boxes[3].high.z() = 6.0;  // m: too high to be judged
  constexpr int kHighVan = 3;
  const std::vector<Scan> scans = drive(scene, 16, 4.0);
  Config config = Config::paper();
  const auto removed = [&](int object) { return removed_of(object, config, scans); };
  const std::size_t van = removed(kVan), high_van = removed(kHighVan);
  REQUIRE(van > 2000);
  REQUIRE(high_van > 500);
  config.big_is_static = true;
  CHECK(removed(kVan) == van);
  CHECK(removed(kHighVan) == 0);
  config.compared_clusters = Comparison::kAnyBefore;
  CHECK(removed(kVan) >= van);
  config = Config::published();
  CHECK(removed(kVan) > van / 2);
  CHECK(removed(kHighVan) == 0);
}

TEST_CASE("without belief every proposal is a verdict, and belief only reverts proposals") {
  const std::vector<Scan> scans = drive(oncoming(), 8, 5.0);
  Config config = Config::paper();
  config.belief.tau_p = 0.95;
  const Run with_belief = run(config, scans);
  config.use_belief = false;
  const Run proposals = run(config, scans);
  for (std::size_t s = 0; s < scans.size(); ++s) {
    CHECK(is_subset(with_belief.final[s], proposals.final[s]));
    for (std::size_t i = 0; i < scans[s].points.size(); ++i) {
      const bool dynamic = proposals.final[s].labels[i] == PointLabel::kDynamic;
      REQUIRE(proposals.final[s].beliefs[i] == (dynamic ? 1.0F : 0.0F));
      const float belief = with_belief.final[s].beliefs[i];
      REQUIRE((with_belief.final[s].labels[i] == PointLabel::kDynamic) == (belief > 0.95F));
    }
  }
  CHECK(dynamic_count(with_belief.final) < dynamic_count(proposals.final));
}

// Newest labels from scan `first` on.
std::vector<std::vector<PointLabel>> newest_labels(const Run& result, std::size_t first) {
  std::vector<std::vector<PointLabel>> labels;
  for (std::size_t s = first; s < result.newest.size(); ++s) {
    labels.push_back(result.newest[s].labels);
  }
  return labels;
}

TEST_CASE("a longer pause than max_gap or a farther jump than max_speed allows begins a window") {
  Config config = Config::paper();
  config.max_gap = 2.0;
  config.max_speed = 64.0;
  const std::vector<Scan> scans = drive(oncoming(), 8, 5.0);
  const auto labels = [&](double gap, double jump) {
    std::vector<Scan> changed = scans;
    for (std::size_t i = 0; i < changed.size(); ++i) {
      const auto number = static_cast<double>(i);
      changed[i].time = 0.125 * number + (i < 4 ? 0.0 : gap - 0.125);
      changed[i].T_world_sensor = sensor_at(0.5 * number + (i < 4 ? 0.0 : jump - 0.5));
    }
    const Run result = run(config, changed);
    CHECK(result.final.size() == scans.size());
    return newest_labels(result, 4);
  };
  const auto whole = newest_labels(run(config, scans), 4);
  const auto second_half = newest_labels(run(config, {scans.begin() + 4, scans.end()}), 0);
  REQUIRE((whole != second_half));
  CHECK((labels(2.0, 0.5) == whole));
  CHECK((labels(2.125, 0.5) == second_half));
  CHECK((labels(0.125, 8.125) == second_half));
  CHECK((labels(0.125, -8.125) == second_half));
  CHECK((labels(0.125, 8.0) != second_half));
}

TEST_CASE("flush in the middle finishes all open scans, and the next scan starts a new window") {
  const std::vector<Scan> scans = drive(oncoming(), 8, 5.0);
  const std::vector<Scan> first(scans.begin(), scans.begin() + 4);
  const std::vector<Scan> second(scans.begin() + 4, scans.end());
  DynaInsRemover remover(Config::paper());
  const Run a = run(remover, first);
  const Run b = run(remover, second);
  CHECK((a.final == run_paper(first).final));
  CHECK((newest_labels(b, 0) == newest_labels(run_paper(second), 0)));
  REQUIRE(b.final.size() == 4);
  CHECK(b.final[0].scan == 4);
}

TEST_CASE("both sides of min_range and max_range, horizontally") {
  Config config = Config::paper();
  config.min_range = 3.0;
  config.max_range = 50.0;
  DynaInsRemover remover(config);
  const std::vector<Eigen::Vector3f> points = {{2.999F, 0.0F, 1.0F}, {3.0F, 0.0F, 1.0F},
                                               {0.0F, -50.0F, 1.0F}, {0.0F, -50.01F, 1.0F},
                                               {0.0F, 0.0F, 5.0F},   {2.0F, 2.3F, 40.0F}};
  const FrameResult frame = remover.push(points, Eigen::Isometry3d::Identity());
  using L = PointLabel;
  CHECK((std::vector<L>(frame.newest().labels.begin(), frame.newest().labels.end()) ==
         std::vector<L>{L::kOutOfRange, L::kStatic, L::kStatic, L::kOutOfRange, L::kOutOfRange,
                        L::kStatic}));
}

// Copies of `scans` in the frame of a body, in which the sensor is at `origin`.
std::vector<Scan> moved_into_body(std::vector<Scan> scans, const Eigen::Vector3f& origin) {
  for (Scan& scan : scans) {
    for (Eigen::Vector3f& p : scan.points) p += origin;
    scan.T_world_sensor.translate(-origin.cast<double>());
  }
  return scans;
}

TEST_CASE("rays begin at the sensor: clouds of a body frame get the verdicts of the sensor") {
  Config config = GENERATE(Config::paper(), Config());
  const Eigen::Vector3f origin(1.0F, -0.5F, 1.5F);
  std::vector<Scan> scans = drive(oncoming(), 10, 5.0, 0.7);
  for (Scan& scan : scans) {  // coordinates that both frames hold exactly
    for (Eigen::Vector3f& p : scan.points) p = ((1024.0F * p).array().round() / 1024.0F).matrix();
    scan.points.emplace_back(Eigen::Vector3f::Zero());  // a beam without a return
    scan.object.push_back(kGroundObject);
  }
  std::vector<Scan> in_body = moved_into_body(scans, origin);
  for (Scan& scan : in_body) scan.points.back().setZero();
  DynaInsRemover expected(config);
  const Run by_sensor = run(expected, scans);

  SECTION("with the position of the sensor") {
    config.sensors[0].translation() = origin.cast<double>();
    DynaInsRemover remover(config);
    const Run by_body = run(remover, in_body);
    REQUIRE(by_body.final.size() == by_sensor.final.size());
    CHECK(disagreement(by_body.final, by_sensor.final) < 1e-4);
    for (const Verdict& verdict : by_body.final) {
      CHECK(verdict.labels.back() == PointLabel::kInvalid);
    }
    CHECK(remover.map().size() == Approx(expected.map().size()).epsilon(0.001));
  }
  SECTION("without it, they differ") {
    CHECK(disagreement(run(config, in_body).final, by_sensor.final) > 0.002);
  }
}

TEST_CASE("the corrected motion is that of the pushed frame, wherever the sensor is in it") {
  Config config;
  config.sensors[0].translation().x() = 3.0;
  std::vector<Scan> scans;
  for (int i = 0; i < 6; ++i) {
    scans.push_back(yard().scan(sensor_at(0.5 * i, 0.0, 0.05 * i), 0.1 * i));
  }
  scans = moved_into_body(std::move(scans), Eigen::Vector3f(3.0F, 0.0F, 0.0F));
  scans.back().T_world_sensor.translation().y() += 0.2;
  const auto residuals = [&](const Config& of_remover) {
    DynaInsRemover remover(of_remover);
    std::size_t count = 0;
    for (std::size_t i = 0; i < scans.size(); ++i) {
      const Scan& scan = scans[i];
      const FrameResult frame = push(remover, scan);
      CHECK((frame.newest().T_world_sensor.matrix() - scan.T_world_sensor.matrix()).norm() < 1e-9);
      if (!frame.pose_residual) continue;
      ++count;
      // A turn of the body also moves the sensor, here by 0.15 m.
      const double expected = i + 1 < scans.size() ? 0.0 : 0.2;
      CHECK(frame.pose_residual->translation == Approx(expected).margin(0.04));
      const Eigen::Isometry3d T_pushed =
          scans[i - 1].T_world_sensor.inverse() * scan.T_world_sensor;
      const Eigen::Vector3d error =
          frame.pose_residual->T_previous_newest.translation() - T_pushed.translation();
      CHECK(error.norm() == Approx(expected).margin(expected > 0.0 ? 0.04 : 0.02));
    }
    return count;
  };
  CHECK(residuals(config) == scans.size() - 1);
  config.evidence.pose_tolerance = 0.0;
  CHECK(residuals(config) == 0);
  CHECK(residuals(Config::paper()) == 0);
}

TEST_CASE("times of the stages add up to the total") {
  DynaInsRemover remover(Config::paper());
  const Scan scan = yard().scan(sensor_at(0.0), 0.0);
  const StageTimes times = remover.push(scan.points, scan.T_world_sensor).times;
  double sum = 0.0;
  StageTimes::visit(times, [&](const char*, double milliseconds) {
    CHECK(milliseconds >= 0.0);
    sum += milliseconds;
  });
  CHECK(times.total() == Approx(sum));
  CHECK(times.ground > 0.0);
}

}  // namespace
}  // namespace dynains::test
