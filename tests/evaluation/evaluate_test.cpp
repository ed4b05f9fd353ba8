#include "dynains/evaluation/evaluate.hpp"

#include <nlohmann/json.hpp>

#include "dynains/errors.hpp"
#include "evaluation/point_protocol.hpp"
#include "reference.hpp"
#include "scenes.hpp"
#include "support/catch.hpp"

namespace dynains::evaluation::testing {
namespace {

/// Road and a car (class 252, instance 7) that drives 1 m per scan of 0.1 s. Estimate 0 misses the
/// car in scan 1 and loses half of the road in scan 2.
std::vector<OwnedScan> street() {
  std::vector<OwnedScan> scans(3);
  for (std::size_t s = 0; s < scans.size(); ++s) {
    for (int i = 0; i < 10; ++i) {
      const auto y = 5.0F + static_cast<float>(i);
      scans[s].add(4.0F, y, 0.5F, kRoad, s == 2 && i < 5 ? 0 : 1);
    }
    for (int i = 0; i < 4; ++i) {
      scans[s].add(20.0F + static_cast<float>(s), 0.25F * static_cast<float>(i), 0.5F,
                   kMovingCar | 7U << 16U, s == 1 ? 1 : 0);
    }
  }
  return scans;
}

}  // namespace

TEST_CASE("Point-wise accuracies are shares of the static and of the dynamic points") {
  PointProtocol protocol(EvaluationConfig(), 1);
  for (const OwnedScan& scan : street()) protocol.add(scan.view());
  const Score score = protocol.points(kFirstEstimate);
  CHECK(same(score, {30, 25, 12, 8}));
  CHECK(score.kept() == Approx(83.3333333));
  CHECK(score.removed() == Approx(66.6666667));
  CHECK(score.associated() == Approx(74.5355992));  // sqrt(83.33 * 66.67)
  CHECK(score.harmonic() == Approx(74.0740741));    // 2 * 83.33 * 66.67 / 150
  CHECK(protocol.points(kIdentity).kept() == 100.0);
  CHECK(protocol.points(kIdentity).removed() == 0.0);
  CHECK(protocol.points(kOracle).harmonic() == 100.0);
}

TEST_CASE("Every evaluation carries identity and oracle") {
  const auto scans = street();
  const Evaluation result = evaluate(source_of(scans), {"run"}, {});
  REQUIRE(result.rows.size() == 3);
  CHECK(result.scans == 3);
  CHECK(result.points == 42);
  CHECK(result.rows[0].name == "identity");
  CHECK(result.rows[0].voxels.kept() == 100.0);
  CHECK(result.rows[0].voxels.removed() == 0.0);
  CHECK(result.rows[1].name == "oracle");
  CHECK(result.rows[1].voxels.f1() == 1.0);
  CHECK(result.rows[1].points.harmonic() == 100.0);
  // The road's voxels contain points of other scans. The four voxels of the car in scan 1 are kept.
  CHECK(result.rows[2].voxels.kept() == 100.0);
  CHECK(result.rows[2].voxels.dynamic_total == 12);
  CHECK(result.rows[2].voxels.dynamic_total - result.rows[2].voxels.dynamic_removed == 4);
}

TEST_CASE("A map of the kept points gets the score of the labels if voxels do not mix classes") {
  const auto scans = street();
  std::vector<Eigen::Vector3d> map;
  for (const OwnedScan& scan : scans) {
    for (std::size_t i = 0; i < scan.truth.size(); ++i) {
      if (scan.in_map[i] != 0) map.push_back(scan.view().point(i));
    }
  }
  const Evaluation result = evaluate(source_of(scans), {"run"}, {{"map.ply", map}});
  REQUIRE(result.rows.size() == 4);
  CHECK(result.rows[3].voxels.kept() == result.rows[2].voxels.kept());
  CHECK(result.rows[3].voxels.removed() == result.rows[2].voxels.removed());
  // Point-wise, the map covers the road that scan 2 lost.
  CHECK(result.rows[3].points.kept() == 100.0);
  CHECK(*result.rows[3].foreign_points == 0);
}

TEST_CASE("Errors are counted by class and cause") {
  auto scans = street();
  for (std::size_t s = 0; s < scans.size(); ++s) {
    scans[s].causes.assign(14, static_cast<std::uint8_t>(Cause::kNoEvidence));
  }
  // The car of scan 1 was missed.
  for (std::size_t i = 10; i < 14; ++i) {
    scans[1].causes[i] = static_cast<std::uint8_t>(Cause::kSimilar);
  }

  const Evaluation result = evaluate(source_of(scans), {"run"}, {});
  const auto& classes = result.rows[2].classes;
  REQUIRE(classes.size() == 2);
  CHECK(classes[0].id == 40);
  CHECK(classes[0].removed() == 5);
  CHECK(classes[1].id == 252);
  CHECK(classes[1].points == 12);
  CHECK(classes[1].removed() == 8);

  const auto& causes = result.causes;
  CHECK(causes[static_cast<std::size_t>(Cause::kSimilar)].missed_dynamic == 4);
  CHECK(causes[static_cast<std::size_t>(Cause::kNoEvidence)].lost_static == 5);
  CHECK(causes[static_cast<std::size_t>(Cause::kNoEvidence)].right == 33);

  const std::string text = errors_to_table(result);
  CHECK(text.find("moving-car") != std::string::npos);
  CHECK(text.find("similarity too high") != std::string::npos);
}

TEST_CASE("All reports have equal numbers") {
  const auto scans = street();
  const Evaluation result = evaluate(source_of(scans), {"my \"run\""}, {});
  const auto json = nlohmann::json::parse(to_json(result));
  CHECK(json["rows"].size() == 3);
  CHECK(json["rows"][2]["name"] == "my \"run\"");
  CHECK(json["rows"][2]["voxels"]["rr"].get<double>() == result.rows[2].voxels.removed());
  CHECK(json["settings"]["voxel"] == 0.2);
  CHECK(json["settings"]["unlabeled"] == "ignore");
  CHECK(json["errors"]["by_class"].size() == 2);
  const std::string csv = to_csv(result);
  CHECK(csv.find("\"my \"\"run\"\"\",100.000000,66.666667,0.800000,") != std::string::npos);
  CHECK(to_table(result).find("66.667") != std::string::npos);

  // A share of zero points is not a number.
  const Evaluation nothing = evaluate([](std::size_t, LabelledScan&) { return false; }, {}, {});
  CHECK(nlohmann::json::parse(to_json(nothing))["rows"][0]["voxels"]["pr"].is_null());
  CHECK(to_csv(nothing).find("nan") == std::string::npos);
  CHECK(errors_to_table(nothing).empty());
}

TEST_CASE("Malformed scans and settings are refused with their name") {
  auto scans = street();
  scans[1].in_map.pop_back();
  CHECK_THROWS_WITH(evaluate(source_of(scans), {"run"}, {}),
                    "scan 1 has 14 points but 13 verdicts");
  scans = street();
  scans[0].causes.assign(3, 0);
  CHECK_THROWS_AS(evaluate(source_of(scans), {"run"}, {}), std::invalid_argument);

  const auto narrow = [](std::size_t, LabelledScan& scan) {
    scan.stride = 2;
    return true;
  };
  CHECK_THROWS_WITH(evaluate(narrow, {}, {}),
                    "scan 0 has a stride of 2 floats, expected at least 3");

  EvaluationConfig config;
  config.voxel = 0;
  CHECK_THROWS_AS(evaluate(source_of(scans), {}, {}, config), ConfigError);
  config = {};
  config.max_range = 2.0;
  CHECK_THROWS_AS(evaluate(source_of(scans), {}, {}, config), ConfigError);
  const std::vector<std::string> many(kMaxEstimates + 1);
  CHECK_THROWS_AS(evaluate(source_of(street()), many, {}), ConfigError);
}

TEST_CASE("Class lists are ids and ranges, with a short text form that can be read back") {
  const TruthClasses moving;
  for (const std::uint32_t label : {251U, 252U, 258U, 259U | 5U << 16U}) {
    CHECK(moving(label) == Truth::kDynamic);
  }
  for (const std::uint32_t label : {250U, 260U}) CHECK(moving(label) == Truth::kStatic);
  for (const std::uint32_t label : {0U, 1U}) CHECK(moving(label) == Truth::kIgnored);
  CHECK(TruthClasses(Unlabeled::kStatic)(1) == Truth::kStatic);
  CHECK(moving.dynamic_classes() == "251-259");

  const TruthClasses own("9,3-5", Unlabeled::kIgnore);
  CHECK(own(4) == Truth::kDynamic);
  CHECK(own(6) == Truth::kStatic);
  for (const char* list : {"251-259", "3-5,9", "0", "65535", "1,3,5-6"}) {
    CHECK(TruthClasses(list, Unlabeled::kIgnore).dynamic_classes() == list);
  }
  CHECK(TruthClasses("9,3,4,5,5", Unlabeled::kIgnore).dynamic_classes() == "3-5,9");
  for (const char* list : {"", "x", "5-3", "1,", "1;2", "65536", "-1", "1-"}) {
    CHECK_THROWS_AS(TruthClasses(list, Unlabeled::kIgnore), ConfigError);
  }
}

TEST_CASE("Moving classes are named after the classes at rest") {
  // The pairs by which SemanticKITTI maps moving classes to classes at rest.
  const std::vector<std::pair<std::uint16_t, std::uint16_t>> pairs = {
      {252, 10}, {253, 31}, {254, 30}, {255, 32}, {256, 16}, {257, 13}, {258, 18}, {259, 20}};
  for (const auto& [moving, still] : pairs) {
    CHECK(semantic_class_name(moving) == "moving-" + semantic_class_name(still));
  }
}

TEST_CASE("Every class has a unique name, known or not") {
  std::set<std::string> names;
  for (std::uint16_t id = 0; id < 300; ++id) names.insert(semantic_class_name(id));
  CHECK(names.size() == 300);
  CHECK(semantic_class_name(40) == "road");
  CHECK(semantic_class_name(50) == "building");
  CHECK(semantic_class_name(70) == "vegetation");
  CHECK(semantic_class_name(260) == "class 260");
  CHECK(semantic_class_name(65535) == "class 65535");
}

}  // namespace dynains::evaluation::testing
