#include "dynains/simulation/statistics.hpp"

#include <limits>

#include "dynains/errors.hpp"
#include "support/catch.hpp"

namespace dynains::simulation {
namespace {

constexpr std::uint32_t kRoad = 40;
constexpr std::uint32_t kCar = 10;
constexpr std::uint32_t kMovingCar = 252;

struct LabelledScan {
  std::vector<float> xyzi;
  std::vector<std::uint32_t> labels;

  void add(float x, float y, float z, std::uint32_t label = kRoad, std::uint32_t instance = 0) {
    xyzi.insert(xyzi.end(), {x, y, z, 0.5F});
    labels.push_back(label | instance << 16U);
  }
  void add_car(float x, std::size_t points, std::uint32_t label, std::uint32_t instance) {
    for (std::size_t i = 0; i < points; ++i) add(x, 0.0F, -0.5F, label, instance);
  }
};

}  // namespace

TEST_CASE("Points are counted by range, and a limit belongs to the upper bin") {
  LabelledScan scan;
  for (const float x : {4.9F, 5.0F, 9.9F, 15.0F, 79.0F, 80.0F, 200.0F, 300.0F}) {
    scan.add(x, 0.0F, 0.0F);
  }
  ScanStatistics statistics;
  statistics.add(scan.xyzi, scan.labels);
  const std::array<double, 7> expected = {0.125, 0.25, 0.125, 0, 0, 0.125, 0.375};
  CHECK(statistics.range_shares() == expected);
  CHECK(statistics.points_per_scan() == 8);
}

TEST_CASE("A beam without return is not counted as a point") {
  LabelledScan scan;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  scan.add(0.0F, 0.0F, 0.0F);
  scan.add(nan, nan, nan);
  scan.add(10.0F, 0.0F, -1.7F);
  ScanStatistics statistics;
  statistics.add(scan.xyzi, scan.labels);
  CHECK(statistics.points_per_scan() == 1);
  CHECK(statistics.ground_share() == 1.0);
  CHECK(statistics.range_shares()[2] == 1.0);

  // Empty scans count as scans.
  statistics.add({}, {});
  CHECK(statistics.points_per_scan() == 0.5);
}

TEST_CASE("Labels are one per point, or none") {
  LabelledScan scan;
  scan.add(10.0F, 0.0F, -1.7F);
  scan.add(11.0F, 0.0F, -1.7F);
  ScanStatistics statistics;
  CHECK_THROWS_AS(statistics.add(scan.xyzi, Span<const std::uint32_t>(scan.labels).subspan(0, 1)),
                  CloudError);
  statistics.add(scan.xyzi, {});
  CHECK(statistics.points_per_scan() == 2);
  CHECK(statistics.moving_share() == 0.0);
}

TEST_CASE("Ground is low in its surroundings and far below the sensor") {
  LabelledScan scan;
  scan.add(10.0F, 0.0F, -1.7F);    // ground
  scan.add(10.5F, 0.0F, -1.55F);   // ground: 0.15 m above it
  scan.add(10.5F, 0.5F, -1.4F);    // 0.3 m above it
  scan.add(30.0F, 0.0F, 1.0F);     // a roof, with nothing below it
  scan.add(0.0F, 60.0F, 0.5F);     // ground of a hill: the limit rises with the distance
  scan.add(500.0F, 0.0F, -20.0F);  // beyond the range of the statistics
  ScanStatistics statistics;
  statistics.add(scan.xyzi, {});
  CHECK(statistics.ground_share() == Approx(3.0 / 6.0));
  CHECK(statistics.moving_share() == 0.0);
}

TEST_CASE("The points of a car are the median over the cars at about its distance") {
  ScanStatistics statistics;
  LabelledScan first;
  first.add_car(9.0F, 70, kCar, 1);
  first.add_car(11.0F, 50, kMovingCar, 2);
  first.add_car(19.0F, 30, kCar, 3);
  first.add_car(14.0F, 45, kCar, 4);  // neither about 10 nor about 20 m away
  first.add_car(40.0F, 5, kCar, 0);   // no instance: may be several cars
  statistics.add(first.xyzi, first.labels);
  LabelledScan second;
  second.add_car(10.0F, 20, kCar, 1);
  statistics.add(second.xyzi, second.labels);

  const std::array<std::size_t, 3> cars = {3, 1, 0};
  const std::array<double, 3> points = {50, 30, 0};
  CHECK(statistics.cars() == cars);
  CHECK(statistics.points_per_car() == points);
  CHECK(statistics.moving_share() == Approx(50.0 / 220.0));
}

}  // namespace dynains::simulation
