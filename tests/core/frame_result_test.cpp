// Doubts of a push about the times of scans.

#include "dynains/compiled_remover.hpp"
#include "support/catch.hpp"
#include "support/scene.hpp"

namespace dynains::test {
namespace {

/// The doubts about scans at these times, s.
std::vector<TimeDoubt> doubts_at(DynaInsRemover& remover, const std::vector<double>& times) {
  const std::vector<Eigen::Vector3f> cloud(20, {5.0F, 1.0F, -1.0F});
  std::vector<TimeDoubt> doubts;
  for (const double time : times) {
    doubts.push_back(remover.push(cloud, Eigen::Isometry3d::Identity(), time).time_doubt);
  }
  return doubts;
}

std::vector<TimeDoubt> doubts_of(double interval) {
  DynaInsRemover remover;
  return doubts_at(remover, {0, interval, 2 * interval, 3 * interval, 4 * interval});
}

TEST_CASE("an epoch that the caller begins is told, and has no residual") {
  const std::vector<Scan> scans = drive(yard(), 4, 5.0);
  DynaInsRemover remover;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    if (i == 2) remover.start_epoch();
    const FrameResult frame = remover.push(scans[i].points, scans[i].T_world_sensor.matrix());
    CHECK(frame.began_epoch.has_value() == (i == 0 || i == 2));
    CHECK(frame.pose_residual.has_value() == (i == 1 || i == 3));
  }
}

TEST_CASE("a residual names the scan that its motion begins with, also after a refused push") {
  const std::vector<Scan> scans = drive(yard(), 4, 5.0);
  DynaInsRemover remover;
  const auto push = [&](const Scan& scan, double time) {
    return remover.push(scan.points, scan.T_world_sensor, time);
  };
  CHECK_FALSE(push(scans[0], 0.0).pose_residual);
  REQUIRE(push(scans[1], 0.1).pose_residual);
  CHECK_THROWS_AS(push(scans[2], 0.05), PoseError);
  const FrameResult frame = push(scans[3], 0.3);
  REQUIRE(frame.pose_residual);
  CHECK(frame.newest().scan == 2);
  CHECK(frame.pose_residual->previous_scan == 1);
  CHECK(frame.pose_residual->previous_time == 0.1);
  const Eigen::Vector3d motion =
      (scans[1].T_world_sensor.inverse() * scans[3].T_world_sensor).translation();
  CHECK((frame.pose_residual->T_previous_newest.translation() - motion).norm() < 0.02);
}

TEST_CASE("a verdict has the pose by which its scan was compared, and its epoch") {
  const std::vector<Scan> scans = drive(yard(), 6, 5.0);
  DynaInsRemover remover;
  std::vector<ComparedPose> compared;
  bool is_corrected = false;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    if (i == 4) remover.start_epoch();
    Pose T_pushed = scans[i].T_world_sensor;
    if (i == 2) T_pushed.translation().y() += 0.2;
    const FrameResult frame = remover.push(scans[i].points, T_pushed);
    compared.push_back(frame.newest().compared);
    CHECK((i == 0 || compared[i].epoch != compared[i - 1].epoch) == frame.began_epoch.has_value());
    const Pose& T_compared = compared[i].T_world_sensor;
    is_corrected = is_corrected || !T_compared.isApprox(T_pushed, 1e-6);
    if (!frame.pose_residual) {
      CHECK(T_compared.isApprox(T_pushed, 1e-12));
      continue;
    }
    const Pose T_motion = compared[i - 1].T_world_sensor.inverse() * T_compared;
    CHECK(T_motion.isApprox(frame.pose_residual->T_previous_newest, 1e-6));
  }
  CHECK(is_corrected);
  std::size_t final = 0;
  remover.flush([&](const ScanVerdict& verdict) {
    CHECK(verdict.compared.epoch == compared[final].epoch);
    CHECK(verdict.compared.T_world_sensor.isApprox(compared[final++].T_world_sensor, 0.0));
  });
}

TEST_CASE("the verdict on the newest scan is asked for before the next push, or refused") {
  const std::vector<Scan> scans = drive(yard(), 2, 5.0);
  DynaInsRemover remover;
  const FrameResult first = remover.push(scans[0].points, scans[0].T_world_sensor);
  const FrameResult second = remover.push(scans[1].points, scans[1].T_world_sensor);
  CHECK_THROWS_AS(first.newest(), UsageError);
  CHECK(second.newest().labels.size() == scans[1].points.size());
}

TEST_CASE("times in another unit than seconds are doubted from the fourth scan on") {
  const TimeDoubt none = TimeDoubt::kNone;
  const auto all = [none](TimeDoubt last) {
    return std::vector<TimeDoubt>{none, none, none, last, last};
  };
  for (const double seconds : {0.1, 0.05, 0.01, 1.0, 1.1e-3}) {
    CAPTURE(seconds);
    CHECK((doubts_of(seconds) == all(none)));
  }
  for (const double unit : {1e3, 1e6, 1e9}) {
    CAPTURE(unit);
    CHECK((doubts_of(0.1 * unit) == all(TimeDoubt::kTooSlow)));
  }
  CHECK((doubts_of(1.01) == all(TimeDoubt::kTooSlow)));
  CHECK((doubts_of(0.1e-3) == all(TimeDoubt::kTooFast)));
  CHECK((doubts_of(0.9e-3) == all(TimeDoubt::kTooFast)));
}

TEST_CASE("pauses are no reason to doubt times, and a reset forgets them") {
  DynaInsRemover remover;
  const std::vector<TimeDoubt> none(7, TimeDoubt::kNone);
  CHECK((doubts_at(remover, {0, 100, 200, 200.1, 300, 400, 400.1}) == none));
  CHECK(doubts_at(remover, {500, 600, 700}).back() == TimeDoubt::kTooSlow);
  remover.reset();
  CHECK((doubts_at(remover, {0, 100, 200}) == std::vector<TimeDoubt>(3, TimeDoubt::kNone)));
}

}  // namespace
}  // namespace dynains::test
