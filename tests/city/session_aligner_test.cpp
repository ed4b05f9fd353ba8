// Alignment of a session with a map of many sessions: known displacements, and refusals.
#include "dynains/city/session_aligner.hpp"

#include "dynains/city/session_writer.hpp"
#include "dynains/errors.hpp"
#include "dynains/pose.hpp"
#include "io/files.hpp"
#include "support/box_street.hpp"
#include "support/catch.hpp"

using namespace dynains;

namespace {

const std::vector<test::StreetBox> kHouses = {
    {{-25, 7, 0}, {-18, 11, 5}, 50}, {{-4, 8, 0}, {1, 12, 4}, 50},
    {{14, 6, 0}, {22, 10, 6}, 50},   {{-14, -11, 0}, {-9, -7, 5}, 50},
    {{5, -12, 0}, {8, -8, 4}, 50},   {{26, -9, 0}, {33, -6, 5}, 50}};
/// A truck that stands there on the second day only.
const test::StreetBox kTruck = {{3, 3, 0}, {9, 5.5, 3}, 10};

using Scans = std::vector<test::BoxScan>;

Scans first_day() { return test::drive_along(kHouses, -8.0, 8.0); }
Scans second_day() {
  std::vector<test::StreetBox> boxes = kHouses;
  boxes.push_back(kTruck);
  Scans scans;
  for (double x = -7.0; x <= 8.0; x += 2.5) scans.push_back(test::scan_boxes(boxes, x, 1.0));
  return scans;
}

void add(City& city, const std::string& name, const Scans& scans,
         const Eigen::Isometry3d& T_city_session = Eigen::Isometry3d::Identity()) {
  SessionInfo info;
  info.name = name;
  SessionWriter writer(city, info);
  std::uint32_t number = 0;
  for (const test::BoxScan& scan : scans) {
    writer.add(scan.points, scan.verdicts, scan.labels, T_city_session * scan.T_world_sensor,
               number++);
  }
  writer.commit();
  city.reload();
}

SessionAlignment align(const City& city, const Scans& scans,
                       const Eigen::Isometry3d& T_session_world,
                       const Eigen::Isometry3d& T_city_start = Eigen::Isometry3d::Identity()) {
  SessionAligner aligner(city);
  for (const test::BoxScan& scan : scans) {
    aligner.add(scan.points, T_session_world * scan.T_world_sensor);
  }
  return aligner.align(T_city_start);
}

/// A motion of `way` m and `angle` deg in a random direction about `position`.
Eigen::Isometry3d displacement(std::mt19937& random, double way, double angle,
                               const Eigen::Vector3d& position) {
  std::normal_distribution<double> normal;
  const auto direction = [&](double upright) {
    Eigen::Vector3d v(normal(random), normal(random), normal(random));
    return Eigen::Vector3d(v.x(), v.y(), upright * v.z()).normalized().eval();
  };
  const Eigen::Vector3d offset = way * direction(0.3);
  const Eigen::AngleAxisd rotation(angle * M_PI / 180.0, direction(3.0));
  return Eigen::Translation3d(position + offset) * rotation * Eigen::Translation3d(-position);
}

/// A map of the first day.
struct FirstDay {
  FirstDay() { add(city, "first", first_day()); }

  test::TemporaryFolder folder;
  City city = City::open_or_make(folder / "city", {});
};

/// Largest distance (m) of a sensor from its place.
double largest_error(const Eigen::Isometry3d& T_world_aligned, const Scans& scans) {
  double most = 0.0;
  for (const test::BoxScan& scan : scans) {
    const Eigen::Vector3d place = scan.T_world_sensor.translation();
    most = std::max(most, (T_world_aligned * place - place).norm());
  }
  return most;
}

}  // namespace

TEST_CASE("alignment: displacements up to 2 m and 5 degrees are found to 5 cm") {
  const FirstDay map;
  const Scans scans = second_day();
  std::mt19937 random(7);
  std::uniform_real_distribution<double> part(0.0, 1.0);
  for (int trial = 0; trial < 12; ++trial) {
    // The first trials are at the limits.
    const double way = trial < 4 ? 2.0 : 2.0 * part(random);
    const double angle = trial < 4 ? 5.0 : 5.0 * part(random);
    CAPTURE(trial, way, angle);
    const Eigen::Isometry3d T =
        displacement(random, way, angle, scans.front().T_world_sensor.translation());
    const SessionAlignment alignment = align(map.city, scans, T);
    CHECK(largest_error(alignment.T_city_session * T, scans) < 0.05);
    CHECK(alignment.residual < 0.1);
    CHECK(alignment.fitting > 0.7);
    CHECK(alignment.sessions == std::vector<std::string>{"first"});
  }
}

TEST_CASE("alignment: a start leads to a map far away, and the same input to the same bits") {
  const test::TemporaryFolder folder;
  City city = City::open_or_make(folder / "city", {});
  Eigen::Isometry3d T_city_world(Eigen::AngleAxisd(2.0, Eigen::Vector3d::UnitZ()));
  T_city_world.translation() = Eigen::Vector3d(433210.5, 5401234.25, 210.0);
  add(city, "first", first_day(), T_city_world);
  const Scans scans = second_day();
  Eigen::Isometry3d T_city_start = T_city_world;
  T_city_start.translation() += Eigen::Vector3d(-1.1, 0.9, 0.3);
  const SessionAlignment alignment =
      align(city, scans, Eigen::Isometry3d::Identity(), T_city_start);
  CHECK(largest_error(T_city_world.inverse() * alignment.T_city_session, scans) < 0.05);
  CHECK(alignment.T_city_start.matrix() == T_city_start.matrix());
  const SessionAlignment again = align(city, scans, Eigen::Isometry3d::Identity(), T_city_start);
  CHECK(again.T_city_session.matrix() == alignment.T_city_session.matrix());
  CHECK(again.residual == alignment.residual);
}

TEST_CASE("alignment: a session of another place is refused") {
  const FirstDay map;
  const Eigen::Isometry3d kIdentity = Eigen::Isometry3d::Identity();
  std::vector<test::StreetBox> other = {
      {{-20, 3, 0}, {-16, 9, 5}, 50}, {{1, 5, 0}, {4, 7, 4}, 50}, {{-6, -9, 0}, {2, -5, 6}, 50}};
  Scans elsewhere;
  for (double x = -7.0; x <= 8.0; x += 2.5) {
    elsewhere.push_back(test::scan_boxes(other, x, 4.0));
  }
  CHECK_THROWS_WITH(align(map.city, elsewhere, kIdentity), ContainsSubstring("cannot be aligned"));
  Eigen::Isometry3d far = kIdentity;
  far.translation().x() = 5.5;
  CHECK_THROWS_AS(align(map.city, second_day(), far), ConfigError);
  far.translation().x() = 4000.0;
  CHECK_THROWS_WITH(align(map.city, second_day(), far), ContainsSubstring("no points"));
}

TEST_CASE("alignment: a street that looks alike along its way is refused") {
  const test::TemporaryFolder folder;
  City city = City::open_or_make(folder / "city", {});
  const Scans scans = test::drive_along({}, -8.0, 8.0);
  add(city, "first", scans);
  CHECK_THROWS_WITH(align(city, scans, Eigen::Isometry3d::Identity()),
                    ContainsSubstring("uncertain"));
}

TEST_CASE("alignment: an empty map and a session without scans are refused") {
  const test::TemporaryFolder folder;
  City city = City::open_or_make(folder / "city", {});
  const Eigen::Isometry3d kIdentity = Eigen::Isometry3d::Identity();
  CHECK_THROWS_WITH(align(city, second_day(), kIdentity), ContainsSubstring("no points"));
  add(city, "first", first_day());
  CHECK_THROWS_AS(align(city, {}, kIdentity), ConfigError);
}

TEST_CASE("alignment: the file of the session keeps it") {
  const test::TemporaryFolder folder;
  City city = City::open_or_make(folder / "city", {});
  SessionInfo info;
  info.name = "aligned";
  SessionAlignment alignment;
  std::mt19937 random(3);
  alignment.T_city_session = displacement(random, 1.5, 4.0, {1000.0, 2.0, 3.0});
  alignment.T_city_start = displacement(random, 0.5, 1.0, {1000.0, 2.0, 3.0});
  alignment.residual = 0.0312;
  alignment.fitting = 0.91;
  alignment.uncertainty = 0.0071;
  alignment.sessions = {"friday", "monday"};
  info.alignment = alignment;
  SessionWriter(city, info).commit();
  city.reload();
  const auto read = city.sessions().front().alignment;
  REQUIRE(read);
  CHECK(read->T_city_session.matrix() == alignment.T_city_session.matrix());
  CHECK(read->T_city_start.matrix() == alignment.T_city_start.matrix());
  CHECK(read->residual == alignment.residual);
  CHECK(read->fitting == alignment.fitting);
  CHECK(read->uncertainty == alignment.uncertainty);
  CHECK(read->sessions == alignment.sessions);
}
