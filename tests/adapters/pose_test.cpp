#include "dynains/adapters/matrix_pose.hpp"
#include "dynains/adapters/sophus.hpp"
#include "support/catch.hpp"

namespace dynains::test {
namespace {

// A quarter turn to the left, 1 m forward, 2 m to the left, 3 m up.
constexpr std::array<double, 16> kRows = {0, -1, 0, 1,  //
                                          1, 0,  0, 2,  //
                                          0, 0,  1, 3,  //
                                          0, 0,  0, 1};
constexpr std::array<float, 16> kColumns = {0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 1, 2, 3, 1};

Eigen::Isometry3d expected() {
  const Eigen::AngleAxisd turn(std::acos(-1.0) / 2, Eigen::Vector3d::UnitZ());
  return Eigen::Translation3d(1, 2, 3) * turn;
}

TEST_CASE("16 numbers are a pose in either order") {
  CHECK(pose_from_row_major(kRows.data()).isApprox(expected(), 1e-12));
  CHECK(pose_from_column_major(kColumns.data()).isApprox(expected(), 1e-12));
}

TEST_CASE("Matrices and transforms of float and double are poses") {
  const Eigen::Isometry3d T = expected();
  const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> rows = T.matrix();
  CHECK(to_pose(T).isApprox(T, 0.0));
  CHECK(to_pose(T.matrix()).isApprox(T, 0.0));
  CHECK(to_pose(rows).isApprox(T, 0.0));
  CHECK(to_pose(Eigen::Affine3d(T)).isApprox(T, 0.0));
  CHECK(to_pose(T.cast<float>()).isApprox(T, 1e-6));
}

TEST_CASE("16 numbers in the wrong order are refused with this reason") {
  CHECK_THROWS_WITH(pose_from_row_major(kColumns.data()),
                    "16 numbers read as a row-major pose have the translation in the last row: "
                    "they are column-major");
  CHECK_THROWS_WITH(pose_from_column_major(kRows.data()), ContainsSubstring("they are row-major"));
}

TEST_CASE("16 numbers that are no pose are refused") {
  std::array<double, 16> values = kRows;
  SECTION("scaled") {
    values[1] = -1.1;
    CHECK_THROWS_WITH(pose_from_row_major(values.data()), ContainsSubstring("is not rigid"));
  }
  SECTION("NaN") {
    values[3] = std::numeric_limits<double>::quiet_NaN();
    CHECK_THROWS_WITH(pose_from_row_major(values.data()), ContainsSubstring("NaN"));
  }
  SECTION("left-handed") {
    values[10] = -1;
    CHECK_THROWS_AS(pose_from_row_major(values.data()), PoseError);
  }
}

TEST_CASE("Sophus poses are converted in both directions") {
  const Eigen::Isometry3d T = expected();
  const Sophus::SE3d pose(Eigen::Quaterniond(T.linear()), T.translation());
  CHECK(to_isometry(pose).isApprox(T, 1e-12));
  const Sophus::SE3f narrow(Eigen::Quaternionf(T.linear().cast<float>()),
                            T.translation().cast<float>());
  CHECK(to_isometry(narrow).isApprox(T, 1e-6));
  CHECK(to_isometry(to_sophus(T)).isApprox(T, 1e-12));

  Eigen::Isometry3d scaled = T;
  scaled.linear() *= 2.0;
  CHECK_THROWS_AS(to_sophus(scaled), PoseError);
}

}  // namespace
}  // namespace dynains::test
