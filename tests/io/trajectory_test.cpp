#include "dynains/io/trajectory.hpp"

#include "io/files.hpp"
#include "support/catch.hpp"

using namespace dynains;
using namespace dynains::test;

namespace {

Trajectory read(const std::string& text) {
  const TemporaryFolder folder;
  write_text(folder / "poses.txt", text);
  return read_trajectory(folder / "poses.txt");
}

Eigen::Isometry3d pose(double x, double angle) {
  return Eigen::Translation3d(x, 0.0, 0.0) * Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ());
}

}  // namespace

TEST_CASE("Every form of a trajectory gives the same pose") {
  // (1, 2, 3), turned by 90 degrees around z.
  const std::string q = "0 0 0.70710678 0.70710678";
  struct Form {
    std::string text;
    bool timed;
    QuaternionOrder order;
  };
  const Form forms[] = {
      {"0 -1 0 1 1 0 0 2 0 0 1 3\n", false, QuaternionOrder::kNone},
      {"5.5 0 -1 0 1 1 0 0 2 0 0 1 3\n", true, QuaternionOrder::kNone},
      {"0 -1 0 1 1 0 0 2 0 0 1 3 0 0 0 1\n", false, QuaternionOrder::kNone},
      {"5.5 1 2 3 " + q + "\n", true, QuaternionOrder::kXyzw},
      {"# time x y z and so on\n5.5 1 2 3 " + q + "\n# end\n\n", true, QuaternionOrder::kXyzw},
      {"5.5,1,2,3,0,0,0.70710678,0.70710678\r\n", true, QuaternionOrder::kXyzw},
      {"1 2 3 " + q, false, QuaternionOrder::kXyzw},
      {"timestamp,tx,ty,tz,qw,qx,qy,qz\n5.5,1,2,3,0.70710678,0,0,0.70710678\n", true,
       QuaternionOrder::kWxyz},
      {"#timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y "
       "[], q_RS_z [], v_x [m/s]\n5.5,1,2,3,0.70710678,0,0,0.70710678,9\n",
       true, QuaternionOrder::kWxyz},
      {"#sec,nsec,x,y,z,qx,qy,qz,qw\n5,500000000,1,2,3,0,0,0.70710678,0.70710678\n", true,
       QuaternionOrder::kXyzw},
      {"name;pos_x;pos_y;pos_z;orientation.x;orientation.y;orientation.z;orientation.w\n"
       "a;1;2;3;0;0;0.70710678;0.70710678\n",
       false, QuaternionOrder::kXyzw},
  };
  for (const Form& form : forms) {
    CAPTURE(form.text);
    const Trajectory trajectory = read(form.text);
    REQUIRE(trajectory.poses.size() == 1);
    CHECK(trajectory.poses[0].translation() == Eigen::Vector3d(1.0, 2.0, 3.0));
    CHECK((trajectory.poses[0].linear() * Eigen::Vector3d::UnitX())
              .isApprox(Eigen::Vector3d::UnitY(), 1e-9));
    CHECK(trajectory.order == form.order);
    REQUIRE(trajectory.times.size() == (form.timed ? 1 : 0));
    if (form.timed) CHECK(trajectory.times[0] == 5.5);
  }
}

TEST_CASE("Damaged trajectories are refused with their line") {
  const std::string row = "1 1 2 3 0 0 0 1\n";
  struct Damage {
    std::string text;
    const char* expected;
  };
  const Damage damages[] = {
      {"", "file ends, expected at least one pose"},
      {"# nothing\n", "file ends, expected at least one pose"},
      {"1 2 3\n", ":1: expected 12 numbers (KITTI), 8 (TUM"},
      {row + "2 1 2 3 0 0\n", ":2: expected 8 columns as before, found 6"},
      {row + "2 1 2 3 0 0 0 1 7\n", ":2: expected 8 columns as before, found 9"},
      {row + "2 1 x 3 0 0 0 1\n", ":2: expected a finite number in column 3, found \"x\""},
      {row + "2 1 nan 3 0 0 0 1\n", ":2: expected a finite number in column 3"},
      {row + "2 1 2 3 0 0 0 0\n", ":2: expected a quaternion of length 1"},
      {row + "2 1 2 3 0 0 0 1.1\n", ":2: expected a quaternion of length 1"},
      {row + row, ":2: expected a time after that of the row before"},
      {"1 0 0 0 0 1 0 0 0 0 -1 0\n", ":1: expected a rigid transform"},
      {"2 0 0 0 0 2 0 0 0 0 2 0\n", ":1: expected a rigid transform"},
      {"frame,x,y\n1,2,3\n", ":1: expected 12 numbers"},
      {"x,y,z,qx,qy,qz,qw\n1,2,,0,0,0,1\n", ":2: expected a finite number in column 3, found \"\""},
      {std::string(100000, '1'), ":1: expected a line of text"},
      {std::string(12, '\0') + "\n", ":1: expected"},
  };
  for (const Damage& damage : damages) {
    CAPTURE(damage.text.substr(0, 60));
    CHECK_THAT(message_of<IoError>([&] { read(damage.text); }), ContainsSubstring(damage.expected));
  }
  CHECK_THAT(message_of<IoError>([] { read_trajectory("/nonexistent/poses.txt"); }),
             ContainsSubstring("/nonexistent/poses.txt: cannot be read"));
  const TemporaryFolder folder;
  write_text(folder / "transformations.pcd",
             "VERSION 0.7\nFIELDS x y z intensity roll pitch yaw\n");
  CHECK_THAT(message_of<IoError>([&] { read_trajectory(folder / "transformations.pcd"); }),
             ContainsSubstring("is a cloud") && ContainsSubstring("expected 12 numbers"));
}

TEST_CASE("Times are matched by interpolation, near the ends and in short gaps only") {
  Trajectory trajectory;
  trajectory.times = {10.0, 10.5, 13.0};
  trajectory.poses = {pose(0.0, 0.0), pose(1.0, 0.4), pose(2.0, 0.8)};
  const auto at = [&](double time) { return match_time(trajectory, time); };
  REQUIRE(at(10.125));
  CHECK(at(10.125)->before == 0);
  CHECK(at(10.125)->after == 1);
  CHECK(at(10.125)->share == Approx(0.25));
  CHECK(at(10.5)->before == 1);
  CHECK(at(10.5)->share == 0.0);
  // Times 5 ms beyond the ends are accepted, times 6 ms beyond are not.
  CHECK(at(9.9951));
  CHECK_FALSE(at(9.994));
  CHECK(at(13.0049));
  CHECK_FALSE(at(13.006));
  // The gap of 2.5 s is not filled.
  CHECK_FALSE(at(11.0));
  CHECK(at(10.504)->after == 1);
  CHECK(at(12.996)->before == 2);

  const Eigen::Isometry3d middle = interpolate(trajectory.poses[0], trajectory.poses[1], 0.25);
  CHECK(middle.isApprox(pose(0.25, 0.1), 1e-12));
}

TEST_CASE("Time stamps of every unit become seconds") {
  CHECK(to_seconds(1571234567.5) == 1571234567.5);
  CHECK(to_seconds(1571234567500.0) == Approx(1571234567.5).epsilon(1e-15));
  CHECK(to_seconds(1571234567500000.0) == Approx(1571234567.5).epsilon(1e-15));
  CHECK(to_seconds(1571234567500000000.0) == Approx(1571234567.5).epsilon(1e-15));
  CHECK(to_seconds(0.3) == 0.3);
}

TEST_CASE("A convention corrects the mistake in its name") {
  Eigen::Isometry3d truth = pose(3.0, 0.7);
  truth.translation() << 3.0, -2.0, 0.5;
  truth.rotate(Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitX()));
  PoseConvention convention;
  CHECK(apply(convention, truth, QuaternionOrder::kXyzw).matrix() == truth.matrix());

  convention.invert = true;
  convention.unit = 0.001;
  Eigen::Isometry3d row = truth.inverse();
  row.translation() *= 1000.0;
  CHECK(apply(convention, row, QuaternionOrder::kNone).isApprox(truth, 1e-12));

  convention = {};
  convention.left_handed = true;
  row = truth;
  row.translation().y() *= -1.0;
  const Eigen::Vector3d mirror(1.0, -1.0, 1.0);
  row.linear() = (mirror.asDiagonal() * truth.linear() * mirror.asDiagonal()).eval();
  CHECK(apply(convention, row, QuaternionOrder::kNone).isApprox(truth, 1e-12));

  const Eigen::Quaterniond q(truth.linear());
  convention = {};
  convention.quaternion = QuaternionOrder::kWxyz;
  row = truth;  // w x y z was read as x y z w
  row.linear() = Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()).toRotationMatrix();
  CHECK(apply(convention, row, QuaternionOrder::kXyzw).isApprox(truth, 1e-12));
  convention.quaternion = QuaternionOrder::kXyzw;
  row.linear() = Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w()).toRotationMatrix();
  CHECK(apply(convention, row, QuaternionOrder::kWxyz).isApprox(truth, 1e-12));
}
