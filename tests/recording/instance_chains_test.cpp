// Instances that the first pass saw move and stand.
#include "dynains/recording/instance_chains.hpp"

#include <cstdint>
#include <vector>

#include "support/catch.hpp"

using namespace dynains;

namespace {

constexpr std::uint32_t kId = 7;

/// A car in successive scans.
struct Tracked {
  void see(double x, bool is_removed, double length = 4.0, std::uint32_t id = kId) {
    PointBuffer points;
    for (int i = 0; i < 20; ++i) {
      points.push_back(static_cast<float>(x + length * i / 19.0), 5.0F,
                       0.05F * static_cast<float>(i));
    }
    const std::vector<PointLabel> labels(points.size(),
                                         is_removed ? PointLabel::kDynamic : PointLabel::kStatic);
    const std::vector<std::uint32_t> ids(points.size(), id);
    chains.add(points, labels, ids, Pose::Identity());
  }
  /// Moves by `way` m in 10 scans.
  void move(double from, double way, bool is_removed = true) {
    for (int i = 1; i <= 10; ++i) see(from + way * i / 10.0, is_removed);
  }
  void stand(double x, int scans) {
    for (int i = 0; i < scans; ++i) see(x, false);
  }

  InstanceChains chains;
};

}  // namespace

TEST_CASE("what moved and then stands was elsewhere before") {
  for (const double way : {0.8, 5.0}) {
    Tracked car;
    car.move(10.0, way);
    car.stand(10.0 + way, 30);
    car.chains.find_moves();
    const InstanceChains::Move* const move = car.chains.move_of(39, kId);
    REQUIRE((move != nullptr) == (way > 1.0));
    if (move == nullptr) continue;
    CHECK(move->elsewhere.first == 0);
    CHECK(move->elsewhere.last == 7);  // 1 m before its place
    CHECK_FALSE(move->is_later);
    CHECK(car.chains.move_of(39, kId + 1) == nullptr);
    CHECK(car.chains.move_of(40, kId) == nullptr);
  }
}

TEST_CASE("what stands and then moves is elsewhere afterwards") {
  Tracked car;
  car.stand(10.0, 30);
  car.move(10.0, 5.0);
  car.stand(15.0, 5);
  car.chains.find_moves();
  const InstanceChains::Move* const move = car.chains.move_of(0, kId);
  REQUIRE(move != nullptr);
  CHECK(move->elsewhere.first == 32);
  CHECK(move->elsewhere.last == UINT32_MAX);
  CHECK(move->is_later);
  REQUIRE(car.chains.move_of(44, kId) != nullptr);
  CHECK_FALSE(car.chains.move_of(44, kId)->is_later);
}

TEST_CASE("a box that grows, a way that was kept, and another id are no moves") {
  Tracked grows;  // one end stays: more of it is seen
  for (int i = 0; i < 10; ++i) grows.see(10.0, true, 4.0 + 0.5 * i);
  grows.stand(10.0, 5);
  Tracked kept;
  kept.move(10.0, 5.0, false);
  kept.stand(15.0, 5);
  Tracked other;
  other.move(10.0, 5.0);
  for (int i = 0; i < 5; ++i) other.see(15.0, false, 4.0, kId + 1);
  for (Tracked* const car : {&grows, &kept, &other}) {
    car->chains.find_moves();
    CHECK(car->chains.move_of(14, kId) == nullptr);
    CHECK(car->chains.move_of(14, kId + 1) == nullptr);
  }
}
