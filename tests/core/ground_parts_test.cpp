// Parts of ingest and ground segmentation compared with simple implementations.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "dynains/ground/ground_segmenter.hpp"
#include "dynains/pipeline/ingest.hpp"
#include "support/catch.hpp"
#include "support/random.hpp"

namespace dynains::test {
namespace {

TEST_CASE("Ingest takes good points in order and marks the others, in any mixture") {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  constexpr float kTiny = std::numeric_limits<float>::denorm_min();
  const std::vector<std::array<float, 3>> kinds = {
      {3.0F, 4.0F, -1.0F},  {0.0F, 0.0F, 0.0F},       {kNan, 1.0F, 1.0F},  {1.0F, 1.0F, kInfinity},
      {60.0F, 0.0F, 0.0F},  {0.0F, 10.0F, 60.0F},     {0.0F, 0.0F, kTiny}, {-0.0F, 0.0F, -0.0F},
      {1e30F, 1e30F, 0.0F}, {0.0F, -kInfinity, 0.0F}, {0.0F, 0.0F, -2.0F}};
  Random random(3);
  detail::Ingest ingest;
  detail::UnjudgedPoints unjudged;
  for (const std::size_t stride : {3U, 4U, 6U}) {
    for (const float min_range : {0.0F, 1.0F}) {
      for (const std::size_t count : {0U, 1U, 7U, 8U, 200U, 1000U}) {
        const double share_of_bad = random.uniform(0.0, 1.0) < 0.5 ? 0.02 : 0.7;
        std::vector<float> cloud(stride * count, kNan);
        for (std::size_t i = 0; i < count; ++i) {
          const bool is_bad = random.uniform(0.0, 1.0) < share_of_bad;
          const auto kind = random.index(kinds.size());
          const std::array<float, 3>& p = kinds[is_bad ? kind : 0];
          std::copy(p.begin(), p.end(), cloud.begin() + static_cast<std::ptrdiff_t>(stride * i));
        }
        const RawPoints<float> points{cloud.data(), count, stride};
        ingest.read(detail::CloudView(points), {min_range, 50.0F}, nullptr, unjudged);

        CAPTURE(stride, min_range, count);
        REQUIRE(unjudged.size() == count);
        std::vector<PointLabel> labels(count, PointLabel::kGround);
        unjudged.for_each([&](std::size_t i, PointLabel label) {
          REQUIRE(i < count);
          labels[i] = label;
        });
        std::size_t taken = 0;
        for (std::size_t i = 0; i < count; ++i) {
          const Eigen::Vector3f p = PointCloudTraits<RawPoints<float>>::point(points, i);
          const bool is_missing = !p.allFinite() || p.isZero(0.0F);
          const float range = p.head<2>().norm();
          if (is_missing || range < min_range || range > 50.0F || std::abs(p.z()) > 50.0F) {
            REQUIRE(labels[i] == (is_missing ? PointLabel::kInvalid : PointLabel::kOutOfRange));
            continue;
          }
          REQUIRE(labels[i] == PointLabel::kGround);
          REQUIRE(taken < ingest.points().size());
          REQUIRE(ingest.input()[taken] == i);
          REQUIRE(ingest.points().x[taken] == p.x());
          REQUIRE(ingest.points().y[taken] == p.y());
          REQUIRE(ingest.points().z[taken] == p.z());
          ++taken;
        }
        REQUIRE(ingest.points().size() == taken);
      }
    }
  }
}

}  // namespace
}  // namespace dynains::test
