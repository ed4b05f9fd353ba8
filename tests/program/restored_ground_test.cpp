#include "run/restored_ground.hpp"

#include <vector>

#include "support/catch.hpp"

using namespace dynains;
using namespace dynains::program;

namespace {

/// Whether a removed point comes back to flat ground, with another removed point beside it.
bool comes_back(float rise, float foot_distance, float foot_rise, Cause cause) {
  RestoredGround ground;
  PointBuffer flat;
  for (int i = 0; i < 100; ++i) flat.push_back(5.0F + 0.01F * static_cast<float>(i), 5.05F, -1.7F);
  const std::vector<PointLabel> labels(flat.size(), PointLabel::kGround);
  ground.add(flat, labels, Pose::Identity());
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
    CHECK(comes_back(0.008F, 0.35F, 0.3F, cause));
    CHECK_FALSE(comes_back(0.012F, 0.35F, 0.3F, cause));
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
