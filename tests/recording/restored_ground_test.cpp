#include "dynains/recording/restored_ground.hpp"

#include <vector>

#include "support/catch.hpp"

using namespace dynains;

namespace {

/// Whether a removed point comes back to flat ground, with another removed point beside it.
bool comes_back(float rise, float foot_distance, float foot_rise, Cause cause) {
  MemoryStore store;
  RestoredGround ground(store, 0);
  PointBuffer flat;
  for (int i = 0; i < 100; ++i) flat.push_back(5.0F + 0.01F * static_cast<float>(i), 5.05F, -1.7F);
  const std::vector<PointLabel> labels(flat.size(), PointLabel::kGround);
  ground.add(flat, labels, Pose::Identity());
  ground.complete();
  PointBuffer points;
  points.push_back(5.55F, 5.05F, -1.7F + rise);
  points.push_back(5.55F + foot_distance, 5.05F, -1.7F + foot_rise);
  VerdictArrays verdict;
  verdict.labels = {PointLabel::kDynamic, PointLabel::kDynamic};
  verdict.causes = {cause, Cause::kFreeSpace};
  verdict.instances = {7, 7};
  verdict.beliefs = {0.9F, 0.9F};
  const std::size_t count = ground.restore(points, Pose::Identity(), verdict);
  CHECK(verdict.labels[1] == PointLabel::kDynamic);
  const bool is_back = verdict.labels[0] == PointLabel::kGround;
  CHECK(count == (is_back ? 1U : 0U));
  CHECK(verdict.causes[0] == (is_back ? Cause::kGround : cause));
  CHECK(verdict.instances[0] == (is_back ? kNoInstance : 7U));
  CHECK(verdict.beliefs[0] == (is_back ? 0.0F : 0.9F));
  return is_back;
}

}  // namespace

TEST_CASE("removed ground comes back unless it rises above the ground of the recording") {
  for (const Cause cause : {Cause::kUnderInstance, Cause::kWithInstance}) {
    CHECK(comes_back(0.0F, 0.35F, 0.3F, cause));
    CHECK(comes_back(0.018F, 0.35F, 0.3F, cause));
    CHECK_FALSE(comes_back(0.022F, 0.35F, 0.3F, cause));
  }
}

TEST_CASE("feet stay removed with what stands on them") {
  const Cause cause = Cause::kUnderInstance;
  CHECK_FALSE(comes_back(0.0F, 0.05F, 0.3F, cause));
  CHECK(comes_back(0.0F, 0.22F, 0.3F, cause));
  CHECK(comes_back(0.0F, 0.05F, 0.65F, cause));  // a roof
  CHECK_FALSE(comes_back(0.0F, 0.05F, 0.55F, cause));
  CHECK_FALSE(comes_back(0.0F, 0.05F, 0.06F, cause));
  CHECK(comes_back(0.0F, 0.05F, 0.04F, cause));
}

TEST_CASE("ground that is a step above the ground around is none") {
  for (const float step : {0.1F, 0.3F}) {
    MemoryStore store;
    RestoredGround ground(store, 0);
    PointBuffer points;
    for (int i = 0; i < 100; ++i) {
      points.push_back(5.05F, 5.05F, -1.7F);
      points.push_back(5.45F, 5.05F, -1.7F + step);
    }
    const std::vector<PointLabel> labels(points.size(), PointLabel::kGround);
    ground.add(points, labels, Pose::Identity());
    ground.complete();
    PointBuffer removed;
    removed.push_back(5.45F, 5.05F, -1.7F + step);
    removed.push_back(5.05F, 5.05F, -1.7F);
    VerdictArrays verdict;
    verdict.labels.assign(2, PointLabel::kDynamic);
    verdict.causes.assign(2, Cause::kWithInstance);
    verdict.instances.assign(2, 7);
    ground.restore(removed, Pose::Identity(), verdict);
    CHECK((verdict.labels[0] == PointLabel::kGround) == (step < 0.2F));
    CHECK(verdict.labels[1] == PointLabel::kGround);
  }
}

TEST_CASE("points rise that are above the ground of their cell, or well above that around it") {
  const auto rises = [](float distance, float rise) {
    MemoryStore store;
    RestoredGround ground(store, 0);
    PointBuffer points;
    for (int i = 0; i < 20; ++i) {
      points.push_back(5.05F, 5.05F, -1.7F);
      points.push_back(5.05F + distance, 5.05F, -1.7F + rise);  // the ground of its own cell, too
    }
    const std::vector<PointLabel> labels(points.size(), PointLabel::kGround);
    ground.add(points, labels, Pose::Identity());
    ground.complete();
    std::vector<std::size_t> found;
    ground.for_each_rising(
        points, Pose::Identity(), [](std::size_t i) { return i == 1; },
        [&](std::size_t i, const WorldCell&) { found.push_back(i); });
    return !found.empty();
  };
  CHECK(rises(0.0F, 0.21F));  // half of it above their mean
  CHECK_FALSE(rises(0.0F, 0.19F));
  CHECK(rises(0.8F, 0.31F));
  CHECK_FALSE(rises(0.8F, 0.29F));
  CHECK_FALSE(rises(1.2F, 0.31F));
}
