#include "evaluation/point_protocol.hpp"

#include <nlohmann/json.hpp>

#include "dynains/errors.hpp"
#include "dynains/evaluation/evaluate.hpp"
#include "reference.hpp"
#include "scenes.hpp"
#include "support/catch.hpp"

namespace dynains::evaluation::testing {
namespace {

constexpr std::size_t kFirst = kFirstEstimate;
constexpr std::uint32_t kCar = 10, kBuilding = 50, kPerson = 30;

std::uint32_t label(std::uint32_t kind, std::uint32_t instance) { return kind | instance << 16U; }

/// Adds `points` points of an object, of which estimate 0 keeps the first `kept`.
void add_object(OwnedScan& scan, std::uint32_t of, int points, int kept, float range = 10) {
  for (int i = 0; i < points; ++i) {
    scan.add(range, 0.01F * static_cast<float>(i), 0.5F, of, i < kept ? 1 : 0);
  }
}

PointProtocol protocol_of(const OwnedScan& scan) {
  PointProtocol protocol(EvaluationConfig(), 1);
  protocol.add(scan.view());
  return protocol;
}

}  // namespace

TEST_CASE("A static object is kept with 90 % of its points, a moving one removed without 95 %") {
  OwnedScan scan;
  add_object(scan, label(kCar, 1), 100, 90);
  add_object(scan, label(kCar, 2), 100, 89);
  add_object(scan, label(kMovingCar, 3), 100, 5);
  add_object(scan, label(kMovingCar, 4), 100, 6);
  const Score score = protocol_of(scan).objects(kFirst);
  CHECK(same(score, {2, 1, 2, 1}));
  CHECK(score.kept() == 50.0);
  CHECK(score.removed() == 50.0);
}

TEST_CASE("Objects have 50 points and more within the range, in all scans together") {
  OwnedScan scan;
  add_object(scan, label(kCar, 1), 49, 0);
  add_object(scan, label(kCar, 2), 50, 0);
  add_object(scan, label(kCar, 3), 500, 0, 51.0F);  // out of range
  PointProtocol protocol(EvaluationConfig(), 1);
  protocol.add(scan.view());
  CHECK(protocol.objects(kFirst).static_total == 1);
  protocol.add(scan.view());
  CHECK(protocol.objects(kFirst).static_total == 2);
}

TEST_CASE("People, ground and points without an instance are no static objects") {
  OwnedScan scan;
  add_object(scan, label(kPerson, 1), 100, 0);
  add_object(scan, label(kRoad, 2), 100, 0);
  add_object(scan, kBuilding, 100, 25);
  add_object(scan, 0, 100, 0);
  const PointProtocol protocol = protocol_of(scan);
  CHECK(protocol.objects(kFirst).static_total == 0);
  CHECK(std::isnan(protocol.objects(kFirst).kept()));
  // By class, all are listed with their points.
  const auto classes = protocol.by_class(kFirst);
  REQUIRE(classes.size() == 3);
  CHECK(classes[0].id == kPerson);
  CHECK(classes[0].objects == 1);
  CHECK(classes[1].id == kRoad);
  CHECK(classes[2].id == kBuilding);
  CHECK(classes[2].objects == 0);
  CHECK(classes[2].points == 100);
  CHECK(classes[2].points_kept == 25);
}

TEST_CASE("Objects that move at times are one object for each class") {
  OwnedScan scan;
  add_object(scan, label(kCar, 7), 100, 100);
  add_object(scan, label(kMovingCar, 7), 100, 0);
  const Score score = protocol_of(scan).objects(kFirst);
  CHECK(score.static_kept == 1);
  CHECK(score.dynamic_removed == 1);
}

TEST_CASE("Estimates are judged apart, beside identity and oracle") {
  OwnedScan scan;
  add_object(scan, label(kCar, 1), 100, 100);
  add_object(scan, label(kMovingCar, 3), 100, 100);
  for (std::size_t i = 0; i < 100; ++i) scan.in_map[i] = i < 50 ? 3 : 1;  // estimate 1 keeps half
  PointProtocol protocol(EvaluationConfig(), 2);
  protocol.add(scan.view());
  const std::size_t rows[] = {kFirst, kFirst + 1, kIdentity, kOracle};
  for (const std::size_t row : rows) {
    CAPTURE(row);
    CHECK(protocol.objects(row).kept() == (row == kFirst + 1 ? 0.0 : 100.0));
    CHECK(protocol.objects(row).removed() == (row == kFirst || row == kIdentity ? 0.0 : 100.0));
  }
}

TEST_CASE("Table, JSON and CSV of an evaluation have the objects") {
  std::vector<OwnedScan> scans(1);
  add_object(scans[0], label(kCar, 1), 100, 90);
  add_object(scans[0], label(kCar, 2), 100, 20);
  add_object(scans[0], label(kMovingCar, 3), 100, 0);
  const std::vector<Eigen::Vector3d> map = {{10, 0, 0.5}};
  const Evaluation result = evaluate(source_of(scans), {"run"}, {{"map.ply", map}});
  REQUIRE(result.rows.size() == 4);
  CHECK(result.rows[2].objects->kept() == 50.0);
  CHECK_FALSE(result.rows[3].objects);

  const auto json = nlohmann::json::parse(to_json(result));
  const auto& row = json["rows"][2];
  CHECK(row["objects"]["static_kept_percent"] == 50.0);
  CHECK(row["objects"]["dynamic_removed_percent"] == 100.0);
  CHECK(row["object_classes"][0]["name"] == "car");
  CHECK(row["object_classes"][0]["kept_percent"] == 55.0);
  CHECK(row["object_classes"][1]["objects_right"] == 1);
  CHECK_FALSE(json["rows"][3].contains("objects"));

  CHECK(to_table(result).find("objects, run") != std::string::npos);
  CHECK(to_table(result).find("55.00") != std::string::npos);
  CHECK(to_csv(result).find(",2,1,1,1\n") != std::string::npos);
  CHECK(to_csv(result).find(",,,,\n") != std::string::npos);
}

}  // namespace dynains::evaluation::testing
