#include "dynains/detail/write_verdict.hpp"

#include <algorithm>
#include <map>
#include <vector>

#include "dynains/detail/instance_ids.hpp"
#include "support/catch.hpp"
#include "support/random.hpp"

namespace dynains::test {
namespace {

using detail::ClusterVerdict;
using detail::Reach;
using Streak = ClusterSet::Streak;

constexpr std::uint32_t kClusters = 6;

// Streaks of random length, a cluster each or none.
std::vector<Streak> random_streaks(Random& random, std::uint32_t points) {
  std::vector<Streak> streaks;
  for (std::uint32_t begin = 0; begin < points;) {
    const auto length = static_cast<std::uint32_t>(1 + random.index(9));
    const std::uint32_t end = std::min(points, begin + length);
    const std::size_t cluster = random.index(kClusters + 1);
    streaks.push_back(
        {begin, end, cluster == kClusters ? kNoCluster : static_cast<std::uint32_t>(cluster)});
    begin = end;
  }
  return streaks;
}

std::vector<std::uint32_t> by_point(const std::vector<Streak>& streaks) {
  std::vector<std::uint32_t> cluster_of;
  for (const Streak& streak : streaks) {
    cluster_of.insert(cluster_of.end(), streak.end - streak.begin, streak.cluster);
  }
  return cluster_of;
}

std::vector<ClusterVerdict> random_verdicts(Random& random) {
  std::vector<ClusterVerdict> verdicts(kClusters);
  for (ClusterVerdict& verdict : verdicts) {
    verdict.reach = static_cast<Reach>(1 + random.index(3));
    if (verdict.reach != Reach::kProposed) continue;
    verdict.dynamic = static_cast<std::uint8_t>(random.index(2));
    verdict.belief = random.uniform_float(0.0, 1.0);
  }
  return verdicts;
}

// What all windows so far said of one point, by the words of the documentation.
struct Said {
  Reach reach = Reach::kNoCluster;
  int votes = 0;
  float belief = 0.0F;

  void hear(std::uint32_t cluster, const std::vector<ClusterVerdict>& verdicts) {
    if (cluster == kNoCluster) return;
    const ClusterVerdict& verdict = verdicts[cluster];
    reach = std::max(reach, verdict.reach);
    votes += verdict.dynamic;
    belief = std::max(belief, verdict.belief);
  }
};

TEST_CASE("verdicts by streak are those by point, at once and after more windows") {
  detail::ScanSlot scan;  // the same object for all, as in the pipeline
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    INFO("seed " << seed);
    Random random(seed);
    const auto points = static_cast<std::uint32_t>(random.index(120));
    const auto ground = static_cast<std::uint32_t>(random.index(20));
    const std::uint32_t bad = 3;
    scan.split.resize(ground + points);
    scan.split.ground_count = ground;
    scan.labels.assign(ground + points + bad, PointLabel::kInvalid);
    const std::vector<std::size_t> order = random.permutation(ground + points + bad);
    for (std::size_t i = 0; i < ground + points; ++i) {
      scan.split.input[i] = static_cast<std::uint32_t>(order[i]);
    }
    scan.ids.resize(kClusters);
    for (std::uint32_t c = 0; c < kClusters; ++c) scan.ids[c] = 100 + c;

    scan.streaks = random_streaks(random, points);
    const std::vector<std::uint32_t> first_cluster = by_point(scan.streaks);
    std::vector<Said> said(points);
    const auto hear = [&](const std::vector<Streak>& streaks,
                          const std::vector<ClusterVerdict>& verdicts) {
      const std::vector<std::uint32_t> cluster_of = by_point(streaks);
      for (std::size_t i = 0; i < points; ++i) said[i].hear(cluster_of[i], verdicts);
    };
    const auto check = [&](int votes) {
      for (std::size_t i = 0; i < points; ++i) {
        const std::uint32_t to = scan.split.input[ground + i];
        const bool dynamic = said[i].votes >= votes;
        REQUIRE(scan.labels[to] == (dynamic ? PointLabel::kDynamic : PointLabel::kStatic));
        REQUIRE(scan.causes[to] ==
                (dynamic ? Cause::kProposed : detail::cause_to_stay(said[i].reach)));
        REQUIRE(scan.beliefs[to] == said[i].belief);
        REQUIRE(scan.is_kept[ground + i] == (dynamic ? 0 : 1));
        REQUIRE(scan.instances[to] ==
                (first_cluster[i] == kNoCluster ? kNoInstance : 100 + first_cluster[i]));
      }
      for (std::size_t i = 0; i < ground; ++i) {
        const std::uint32_t to = scan.split.input[i];
        REQUIRE(scan.labels[to] == PointLabel::kGround);
        REQUIRE(scan.causes[to] == Cause::kGround);
        REQUIRE(scan.beliefs[to] == 0.0F);
        REQUIRE(scan.instances[to] == kNoInstance);
        REQUIRE(scan.is_kept[i] == 1);
      }
      for (std::size_t i = ground + points; i < order.size(); ++i) {
        REQUIRE(scan.labels[order[i]] == PointLabel::kInvalid);
        REQUIRE(scan.causes[order[i]] == Cause::kNotJudged);
        REQUIRE(scan.instances[order[i]] == kNoInstance);
      }
    };

    const std::vector<ClusterVerdict> first = random_verdicts(random);
    hear(scan.streaks, first);
    detail::record_first(scan, first);
    detail::begin_verdict(scan);
    detail::write_by_windows(scan, first);
    check(1);

    const std::size_t windows = random.index(4);
    for (std::size_t k = 0; k < windows; ++k) {
      const std::vector<Streak> streaks = random_streaks(random, points);
      const std::vector<ClusterVerdict> verdicts = random_verdicts(random);
      hear(streaks, verdicts);
      detail::record_again(scan, streaks, verdicts);
    }
    const int votes = 1 + static_cast<int>(random.index(3));
    detail::rewrite_by_windows(scan, votes);
    check(votes);
  }
}

TEST_CASE("ids go to the cluster that got most points, whatever the streaks") {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    INFO("seed " << seed);
    Random random(seed);
    const auto points = static_cast<std::uint32_t>(random.index(200));
    const std::vector<Streak> old_streaks = random_streaks(random, points);
    const std::vector<Streak> streaks = random_streaks(random, points);
    const std::vector<std::uint32_t> old_ids = {11, 12, 13, 14, 15, 16};
    detail::InstanceIds instance_ids;
    std::vector<std::uint32_t> ids;
    instance_ids.assign(old_streaks, old_ids, streaks, kClusters, ids);
    REQUIRE(ids.size() == kClusters);

    const std::vector<std::uint32_t> old_cluster = by_point(old_streaks);
    const std::vector<std::uint32_t> cluster = by_point(streaks);
    std::vector<bool> taken(kClusters, false);
    for (std::uint32_t c = 0; c < kClusters; ++c) {
      std::map<std::uint32_t, std::size_t> votes;
      std::size_t all = 0;
      for (std::size_t i = 0; i < points; ++i) {
        if (cluster[i] != c || old_cluster[i] == kNoCluster) continue;
        ++votes[old_cluster[i]];
        ++all;
      }
      for (const auto& [old, count] : votes) {
        if (2 * count <= all) continue;  // the vote is sure of majorities alone
        if (!taken[old]) REQUIRE(ids[c] == old_ids[old]);
      }
      for (std::uint32_t old = 0; old < kClusters; ++old) {
        if (ids[c] == old_ids[old]) taken[old] = true;
      }
      REQUIRE(std::count(ids.begin(), ids.end(), ids[c]) == 1);
    }
  }
}

}  // namespace
}  // namespace dynains::test
