// The second pass of a run over first verdicts.
#include "dynains/recording/second_pass.hpp"

#include "support/box_street.hpp"
#include "support/catch.hpp"

using namespace dynains;
using namespace dynains::test;

namespace {

constexpr std::uint32_t kHouse = 50, kTree = 70, kCar = 10, kFlat = 1, kHigh = 2;
constexpr std::uint32_t kCarBeside = 1U << 16U | kCar;

StreetBox car_at(double x, double y = 4.0) { return {{x, y, 0.0}, {x + 4.0, y + 1.8, 1.5}, kCar}; }

/// Houses on both sides tell where along the street a scan is.
std::vector<StreetBox> street() {
  return {{{-12, 8, 0}, {-6, 11, 4}, kHouse},  {{-32, 8, 0}, {-26, 11, 5}, kHouse},
          {{28, 8, 0}, {34, 11, 5}, kHouse},   {{-24, -11, 0}, {-18, -8, 5}, kHouse},
          {{22, -11, 0}, {28, -8, 5}, kHouse}, {{20, 7, 0}, {20.5, 7.5, 3}, kTree},
          {{8, -7, 0}, {12, -5, 1.6}, kHouse}};
}

/// The scans of a drive to and fro, one each half a second.
struct Recorded {
  std::vector<BoxScan> scans;

  void drive(const std::vector<StreetBox>& boxes, double from, double to) {
    const double step = from < to ? 1.0 : -1.0;
    for (double x = from; x != to; x += step) scans.push_back(scan_boxes(boxes, x, 0.0));
  }
};

/// The cause of a removal by the first pass; kUnknown: it keeps the point.
using Removes = std::function<Cause(std::size_t scan, std::uint32_t label)>;

Cause removes_nothing(std::size_t, std::uint32_t) { return Cause::kUnknown; }

/// Verdicts that call everything static but what `removes` tells; the boxes of one class are one
/// instance.
VerdictArrays first_verdict(const BoxScan& scan, std::size_t number, const Removes& removes) {
  VerdictArrays verdict;
  for (std::size_t i = 0; i < scan.labels.size(); ++i) {
    const bool is_ground = scan.verdicts[i] == PointLabel::kGround;
    verdict.labels.push_back(scan.verdicts[i]);
    verdict.causes.push_back(is_ground ? Cause::kGround : Cause::kOccupied);
    verdict.instances.push_back(is_ground ? kNoInstance : scan.labels[i] & 0xFFFFU);
    verdict.beliefs.push_back(0.5F);
    const Cause removal = removes(number, scan.labels[i]);
    if (removal == Cause::kUnknown) continue;
    verdict.labels.back() = PointLabel::kDynamic;
    verdict.causes.back() = removal;
    verdict.beliefs.back() = 0.99F;
  }
  return verdict;
}

/// Changes the pose that the first pass has compared.
using Changes = std::function<void(std::size_t scan, ComparedPose& pose)>;

void changes_nothing(std::size_t, ComparedPose&) {}

/// The first pass compares fewer scans than one drive has.
SecondPassConfig short_first_pass() {
  SecondPassConfig config;
  config.evidence.lookback_scans = 10;
  config.evidence.lookahead_scans = 10;
  return config;
}

SecondPassConfig last_policy() {
  SecondPassConfig config = short_first_pass();
  config.static_policy = StaticPolicy::kLast;
  return config;
}

struct Counts {
  std::size_t kept = 0, removed = 0;
  bool are_removed() const { return removed > 9 * kept; }
  bool are_kept() const { return kept > 0 && removed == 0; }
};

/// Points of each scan with a label, after both passes.
std::vector<Counts> count(const Recorded& recording, std::uint32_t label, bool tests = true,
                          const Removes& removes = removes_nothing,
                          const SecondPassConfig& config = short_first_pass(),
                          const Changes& changes = changes_nothing) {
  ByteStore store(std::filesystem::temp_directory_path());
  SecondPass pass(store, config);
  for (std::size_t i = 0; i < recording.scans.size(); ++i) {
    const VerdictArrays arrays = first_verdict(recording.scans[i], i, removes);
    ScanVerdict verdict;
    verdict.scan = i;
    verdict.time = 0.5 * static_cast<double>(i);
    verdict.compared.T_world_sensor = recording.scans[i].T_world_sensor;
    changes(i, verdict.compared);
    verdict.T_world_sensor = verdict.compared.T_world_sensor;
    verdict.labels = arrays.labels;
    verdict.causes = arrays.causes;
    verdict.instances = arrays.instances;
    pass.add(recording.scans[i].points, verdict);
  }
  pass.test([tests] { return tests; });
  CHECK(pass.is_decided() == tests);
  std::vector<Counts> counts;
  std::uint32_t number = 0;
  std::size_t disagreeing = 0;  // labels, causes and beliefs
  for (const BoxScan& scan : recording.scans) {
    VerdictArrays arrays = first_verdict(scan, number, removes);
    const VerdictArrays before = arrays;
    const bool has_changed = pass.revise(scan.points, number++, arrays);
    CHECK(has_changed == (arrays.labels != before.labels));
    counts.emplace_back();
    for (std::size_t i = 0; i < arrays.labels.size(); ++i) {
      const bool is_removed = arrays.labels[i] == PointLabel::kDynamic;
      const bool is_new = arrays.labels[i] != before.labels[i];
      const bool has_own_cause = arrays.causes[i] == Cause::kCameOrWent ||
                                 arrays.causes[i] == Cause::kStands ||
                                 arrays.labels[i] == PointLabel::kGround;
      const bool agrees = (!is_new || has_own_cause) &&
                          is_removed == is_dynamic(arrays.causes[i]) &&
                          is_removed == arrays.beliefs[i] > 0.9F;
      disagreeing += agrees ? 0 : 1;
      if (scan.labels[i] != label) continue;
      ++(is_removed ? counts.back().removed : counts.back().kept);
    }
  }
  CHECK(disagreeing == 0);
  return counts;
}

Counts sum(const std::vector<Counts>& counts) {
  Counts all;
  for (const Counts& of_scan : counts) {
    all.kept += of_scan.kept;
    all.removed += of_scan.removed;
  }
  return all;
}

/// A drive there and one back; a car is parked during the first one, the second one, or both.
Recorded there_and_back(bool is_parked_first, bool is_parked_then, double y = 4.0) {
  Recorded recording;
  std::vector<StreetBox> with_car = street();
  with_car.push_back(car_at(4.0, y));
  recording.drive(is_parked_first ? with_car : street(), -15.0, 15.0);
  recording.drive(is_parked_then ? with_car : street(), 15.0, -15.0);
  return recording;
}

Recorded with_parked_car(double y = 4.0) { return there_and_back(true, false, y); }

/// Some scans take parts of a car for ground: kFlat up to 9 cm, kHigh from 45 to 70 cm.
Recorded with_ground_on_car(Recorded recording) {
  for (std::size_t number = 0; number < recording.scans.size(); number += 8) {
    BoxScan& scan = recording.scans[number];
    for (std::size_t i = 0; i < scan.labels.size(); ++i) {
      const double height =
          static_cast<double>(scan.points.z[i]) + scan.T_world_sensor.translation().z();
      const bool is_flat = height <= 0.09;
      const bool is_high = height >= 0.45 && height <= 0.7;
      if (scan.labels[i] != kCar || !(is_flat || is_high)) continue;
      scan.labels[i] = is_flat ? kFlat : kHigh;
      scan.verdicts[i] = PointLabel::kGround;
    }
  }
  return recording;
}

}  // namespace

TEST_CASE("a car that leaves after a minute leaves the scans before, and nothing else does") {
  const Recorded recording = with_parked_car();
  const Counts car = sum(count(recording, kCar));
  CHECK(car.removed > 1000);
  CHECK(car.removed >= 9 * car.kept);
  CHECK(sum(count(recording, kHouse)).removed == 0);
  CHECK(sum(count(recording, kTree)).removed == 0);
}

TEST_CASE("a car that stays, and a street where nothing moves, lose nothing") {
  const Recorded recording = there_and_back(true, true);
  for (const std::uint32_t label : {kCar, kHouse, kTree}) {
    CHECK(sum(count(recording, label)).are_kept());
  }
}

TEST_CASE("a car beside one that leaves stays, though the first pass took both for one") {
  std::vector<StreetBox> boxes = street();
  boxes.push_back({{9, 4, 0}, {10, 5.8, 1.5}, kCarBeside});
  Recorded recording;
  recording.drive(boxes, 15.0, -15.0);
  boxes.push_back(car_at(4.0));
  recording.drive(boxes, -15.0, 15.0);
  const Counts leaves = sum(count(recording, kCar)), stays = sum(count(recording, kCarBeside));
  CHECK(leaves.are_removed());
  CHECK(stays.kept > 1000);
  CHECK(stays.removed == 0);
}

TEST_CASE("a car that parks and stays is static under the policy last, since it parked") {
  const Recorded recording = there_and_back(false, true);
  const auto last = [](const Recorded& of, std::uint32_t label) {
    return sum(count(of, label, true, removes_nothing, last_policy()));
  };
  CHECK(sum(count(recording, kCar)).are_removed());
  CHECK(last(recording, kCar).are_kept());
  CHECK(last(with_parked_car(), kCar).are_removed());  // a car that left is in neither map
  CHECK(last(recording, kHouse).removed == 0);
}

TEST_CASE("an epoch judges another one if it fits there, and no scan that was compared before") {
  const Recorded recording = with_parked_car();
  const std::size_t turn = recording.scans.size() / 2;
  const auto removed_after = [&](double jump) {
    const auto jumps = [&](std::size_t scan, ComparedPose& pose) {
      pose.epoch = scan < turn ? 0 : 1;
      if (scan >= turn) pose.T_world_sensor.translation().x() += jump;
    };
    return sum(count(recording, kCar, true, removes_nothing, short_first_pass(), jumps)).removed;
  };
  CHECK(removed_after(0.0) > 0);
  for (const double jump : {0.3, 1.0, 3.0}) CHECK(removed_after(jump) == 0);
  CHECK(sum(count(recording, kCar, true, removes_nothing, {})).removed == 0);
}

TEST_CASE("poses that the first pass doubts judge nothing") {
  const auto doubts = [](std::size_t scan, ComparedPose& pose) {
    if (scan == 20) pose.suspicion = Suspicion::kPoses;
  };
  const Recorded recording = with_parked_car();
  CHECK(sum(count(recording, kCar, true, removes_nothing, short_first_pass(), doubts)).removed ==
        0);
}

TEST_CASE("the ground tells which way is up") {
  const Recorded recording = with_parked_car();
  const Counts upright = sum(count(recording, kCar));
  Pose T_turned_world(Eigen::AngleAxisd(2.0, Eigen::Vector3d(0.6, 0.0, 0.8)));
  T_turned_world.translation() = Eigen::Vector3d(100.0, -50.0, 20.0);
  const auto turns = [&](std::size_t, ComparedPose& pose) {
    pose.T_world_sensor = T_turned_world * pose.T_world_sensor;
  };
  const Counts turned =
      sum(count(recording, kCar, true, removes_nothing, short_first_pass(), turns));
  CHECK(turned.removed == Approx(upright.removed).epsilon(0.01));
}

TEST_CASE("the margins are those of the first pass") {
  SecondPassConfig config = short_first_pass();
  config.evidence.margin = 2.0;
  const Recorded recording = with_parked_car(9.8);  // the wall is at 12 m
  CHECK(sum(count(recording, kCar, true, removes_nothing, config)).removed <
        sum(count(recording, kCar)).removed);
}

TEST_CASE("a second pass that was interrupted changes nothing") {
  CHECK(sum(count(with_parked_car(), kCar, false)).removed == 0);
}

TEST_CASE("what the first pass removed for a while comes back under the policy last") {
  const Recorded recording = there_and_back(false, true);
  const std::size_t turn = recording.scans.size() / 2;
  const auto removes = [turn](std::size_t scan, std::uint32_t label) {
    const bool is_one = scan >= turn + 12 && scan < turn + 15 && label == kCar;
    return is_one ? Cause::kWithInstance : Cause::kUnknown;
  };
  const std::vector<Counts> car = count(recording, kCar, true, removes, last_policy());
  for (std::size_t scan = turn + 12; scan < turn + 15; ++scan) {
    CHECK(car[scan].kept > 9 * car[scan].removed);
  }
  // Without a test, the first verdicts stay.
  CHECK(count(recording, kCar, false, removes, last_policy())[turn + 13].kept == 0);
}

TEST_CASE("removed ground comes back, but not if it was seen free or under what moves") {
  Recorded recording;
  recording.drive(street(), -15.0, 15.0);
  constexpr std::uint32_t kRoad = 40;
  for (const Cause cause : {Cause::kWithInstance, Cause::kUnderInstance, Cause::kFreeSpace}) {
    const auto removes = [cause](std::size_t scan, std::uint32_t label) {
      return scan == 15 && label == kRoad ? cause : Cause::kUnknown;
    };
    const Counts road = count(recording, kRoad, true, removes)[15];
    if (cause == Cause::kWithInstance) {
      CHECK(road.kept > 3 * road.removed);
    } else {
      CHECK(road.kept == 0);
    }
  }
}

TEST_CASE(
    "what a scan took for ground on a car that leaves is moving if it rises above the ground") {
  constexpr std::uint32_t kRoad = 40;
  const Recorded left = with_ground_on_car(with_parked_car());
  CHECK(sum(count(left, kHigh)).are_removed());
  CHECK(sum(count(left, kFlat)).are_kept());
  CHECK(sum(count(left, kRoad)).removed == 0);
  // The second pass keeps every point of a car that is parked during the whole recording.
  CHECK(sum(count(with_ground_on_car(there_and_back(true, true)), kHigh)).are_kept());
}

TEST_CASE("memory does not change the second pass") {
  Recorded recording = with_parked_car();
  const Counts counts = sum(count(recording, kCar));
  CHECK(counts.removed > 0);
  SecondPassConfig config = short_first_pass();
  config.memory = 0;
  const Counts others = sum(count(recording, kCar, true, removes_nothing, config));
  CHECK(others.removed == counts.removed);
  CHECK(others.kept == counts.kept);
}

TEST_CASE("the second pass refuses scans out of order and verdicts of another size") {
  const BoxScan scan = scan_boxes(street(), 0.0, 0.0);
  const VerdictArrays arrays = first_verdict(scan, 0, removes_nothing);
  ScanVerdict verdict;
  verdict.labels = arrays.labels;
  verdict.causes = arrays.causes;
  verdict.instances = arrays.instances;
  ByteStore store(std::filesystem::temp_directory_path());
  SecondPass pass(store);
  verdict.scan = 1;
  CHECK_THROWS_AS(pass.add(scan.points, verdict), UsageError);
  verdict.scan = 0;
  CHECK_THROWS_AS(pass.add(PointBuffer(), verdict), UsageError);
  pass.add(scan.points, verdict);
  CHECK_THROWS_AS(pass.add(scan.points, verdict), UsageError);
  pass.test();
  verdict.scan = 1;
  CHECK_THROWS_AS(pass.add(scan.points, verdict), UsageError);
  VerdictArrays short_one = arrays;
  short_one.causes.pop_back();
  CHECK_THROWS_AS(pass.revise(scan.points, 0, short_one), UsageError);
  VerdictArrays whole = arrays;
  CHECK_FALSE(pass.revise(scan.points, 0, whole));
  SecondPassConfig config;
  config.evidence.margin = -1.0;
  CHECK_THROWS_AS(SecondPass(store, config), ConfigError);
}
