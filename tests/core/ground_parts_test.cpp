// Parts of ingest and ground segmentation compared with simple implementations.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "dynains/ground/lowest_mean.hpp"
#include "dynains/ground/patch_sort.hpp"
#include "dynains/pipeline/ingest.hpp"
#include "support/catch.hpp"
#include "support/random.hpp"

namespace dynains::test {
namespace {

TEST_CASE("PatchSort is a stable sort by patch for all numbers of points") {
  constexpr std::size_t kPatches = 5;
  Random random(1);
  detail::PatchSort<kPatches> sort;
  for (const std::size_t count : {0U, 1U, 3U, 15U, 16U, 17U, 31U, 64U, 1000U, 10U}) {
    PointBuffer points;
    std::vector<std::uint32_t> input(count);
    std::vector<std::int32_t> patch_of(count);
    for (std::size_t i = 0; i < count; ++i) {
      points.push_back(static_cast<float>(i), -static_cast<float>(i), 0.5F * static_cast<float>(i));
      input[i] = static_cast<std::uint32_t>(3 * i);
      patch_of[i] = static_cast<std::int32_t>(random.index(kPatches));
    }
    sort.sort(points, input.data(), patch_of.data());

    std::vector<std::size_t> expected(count);
    std::iota(expected.begin(), expected.end(), std::size_t{0});
    std::stable_sort(expected.begin(), expected.end(),
                     [&](std::size_t a, std::size_t b) { return patch_of[a] < patch_of[b]; });
    REQUIRE(sort.begin(0) == 0);
    REQUIRE(sort.end(kPatches - 1) == count);
    for (std::size_t patch = 0; patch < kPatches; ++patch) {
      for (std::size_t at = sort.begin(patch); at < sort.end(patch); ++at) {
        const std::size_t i = expected[at];
        const detail::PointRecord& record = sort.records()[at];
        REQUIRE(patch_of[i] == static_cast<std::int32_t>(patch));
        REQUIRE((record.x == points.x[i] && record.y == points.y[i] && record.z == points.z[i]));
        REQUIRE(record.input == input[i]);
      }
    }
  }
}

float mean_by_sorting(std::vector<float> values, std::size_t wanted, float floor) {
  values.erase(std::remove_if(values.begin(), values.end(), [&](float v) { return v < floor; }),
               values.end());
  std::sort(values.begin(), values.end());
  values.resize(std::min(values.size(), wanted));
  if (values.empty()) return floor;
  float total = 0.0F;
  for (const float value : values) total += value;
  return total / static_cast<float>(values.size());
}

TEST_CASE("LowestMean gives the bits of sorting for few values, ties, rising and falling values") {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  Random random(2);
  for (const std::size_t count : {1U, 7U, 8U, 9U, 40U, 129U, 3000U}) {
    for (const std::size_t wanted : {1U, 8U, 10U, 64U}) {
      for (int kind = 0; kind < 5; ++kind) {
        std::vector<float> values(count);
        for (std::size_t i = 0; i < count; ++i) {
          const auto at = static_cast<float>(i);
          const float any = random.uniform_float(-2.0, 3.0);
          values[i] = std::array<float, 5>{any, 0.25F, std::floor(any), at,
                                           -at}[static_cast<std::size_t>(kind)];
        }
        std::vector<float> padded = values;
        padded.resize(count + detail::kPackWidth, kInfinity);
        for (const float floor : {-kInfinity, -1.0F, 5000.0F}) {
          const float expected = mean_by_sorting(values, wanted, floor);
          CAPTURE(count, wanted, kind, floor);
          float found = 0.0F;
          detail::with_packs([&](auto packs) {
            detail::LowestMean<64, decltype(packs)> lowest(wanted);
            found = lowest.of(padded.data(), count, floor);
          });
          REQUIRE(found == expected);
          detail::LowestMean<64, detail::BaselinePacks> lowest(wanted);
          REQUIRE(lowest.of(padded.data(), count, floor) == expected);
        }
      }
    }
  }
}

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
