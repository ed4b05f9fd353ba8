// Verdicts that are written by runs and groups of points, compared with a simple model by point.

#include "dynains/pipeline/decisions.hpp"
#include "dynains/pipeline/scan_ring.hpp"
#include "dynains/pipeline/verdict_writer.hpp"
#include "support/catch.hpp"
#include "support/random.hpp"

namespace dynains::test {
namespace {

using detail::DecisionStage;
using detail::WindowVerdict;
using PointRun = ClusterSet::PointRun;

constexpr std::uint32_t kClusters = 6;

constexpr std::array<DecisionStage, 4> kStages = {
    DecisionStage::kNoCluster, DecisionStage::kTooFewScans, DecisionStage::kSimilar,
    DecisionStage::kProposed};

// A cluster or none.
std::uint32_t random_cluster(Random& random) {
  const auto cluster = static_cast<std::uint32_t>(random.index(kClusters + 1));
  return cluster == kClusters ? kNoCluster : cluster;
}

// PointRuns of random length, mostly short, each with one cluster or none.
std::vector<PointRun> random_runs(Random& random, std::uint32_t points) {
  std::vector<PointRun> point_runs;
  for (std::uint32_t begin = 0; begin < points;) {
    const auto length = static_cast<std::uint32_t>(1 + random.index(random.index(4) == 0 ? 50 : 9));
    const std::uint32_t end = std::min(points, begin + length);
    point_runs.push_back({begin, end, random_cluster(random)});
    begin = end;
  }
  return point_runs;
}

std::vector<std::uint32_t> by_point(const std::vector<PointRun>& point_runs) {
  std::vector<std::uint32_t> cluster_of;
  for (const PointRun& point_run : point_runs) {
    cluster_of.insert(cluster_of.end(), point_run.end - point_run.begin, point_run.cluster);
  }
  return cluster_of;
}

std::vector<WindowVerdict> random_verdicts(Random& random) {
  std::vector<WindowVerdict> verdicts(kClusters);
  for (WindowVerdict& verdict : verdicts) {
    verdict.stage = kStages[1 + random.index(3)];
    if (verdict.stage != DecisionStage::kProposed) continue;
    verdict.votes = static_cast<std::uint8_t>(random.index(2));
    verdict.belief = random.uniform_float(0.0, 1.0);
  }
  return verdicts;
}

// Votes of all windows so far on one point, by the documentation.
struct Votes {
  DecisionStage stage = DecisionStage::kNoCluster;
  int votes = 0;
  float belief = 0.0F;

  void add(std::uint32_t cluster, const std::vector<WindowVerdict>& verdicts) {
    if (cluster == kNoCluster) return;
    const WindowVerdict& verdict = verdicts[cluster];
    stage = std::max(stage, verdict.stage);
    votes += verdict.votes;
    belief = std::max(belief, verdict.belief);
  }
};

Cause static_cause(DecisionStage stage) {
  return stage == DecisionStage::kNoCluster     ? Cause::kNotJudged
         : stage == DecisionStage::kTooFewScans ? Cause::kTooFewScans
         : stage == DecisionStage::kSimilar     ? Cause::kSimilar
                                                : Cause::kReverted;
}

// The answer for one point; an instance has the number of its cluster and 100.
void require_answer(const ScanVerdict& verdict, std::size_t point, PointLabel label, Cause cause,
                    float belief, std::uint32_t cluster) {
  REQUIRE(verdict.labels[point] == label);
  REQUIRE(verdict.causes[point] == cause);
  REQUIRE(verdict.beliefs[point] == belief);
  REQUIRE(verdict.instances[point] == (cluster == kNoCluster ? kNoInstance : 100 + cluster));
}

TEST_CASE("verdicts by point run equal those by point, at once and after more windows") {
  // One set of objects for all scans, as in the pipeline.
  detail::ScanSlot scan;
  detail::VerdictWriter writer;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    INFO("seed " << seed);
    Random random(seed);
    const auto points = static_cast<std::uint32_t>(random.index(120));
    const auto ground = static_cast<std::uint32_t>(random.index(20));
    const std::uint32_t bad = 3;
    scan.split.resize(ground + points);
    scan.split.ground_count = ground;
    const std::vector<std::size_t> numbers = random.permutation(ground + points + bad);
    const std::vector<std::uint32_t> order(numbers.begin(), numbers.end());
    scan.input.assign(order);
    scan.valid = ground + points;
    scan.ids.resize(kClusters);
    for (std::uint32_t c = 0; c < kClusters; ++c) scan.ids[c] = 100 + c;

    const std::vector<PointRun> first_runs = random_runs(random, points);
    const std::vector<std::uint32_t> cluster_of = by_point(first_runs);
    std::vector<Votes> expected(points);
    const auto add = [&](const std::vector<PointRun>& point_runs,
                         const std::vector<WindowVerdict>& verdicts) {
      const std::vector<std::uint32_t> clusters = by_point(point_runs);
      for (std::size_t i = 0; i < points; ++i) expected[i].add(clusters[i], verdicts);
    };
    const auto check = [&](int votes) {
      std::vector<EvidenceVerdict::Group> groups(1);
      std::vector<std::uint32_t> group_of, first_cluster;
      detail::for_each_common_run(
          scan.windows.runs, scan.windows.point_runs,
          [&](std::uint32_t begin, std::uint32_t end, const auto& run, const auto& point_run) {
            REQUIRE(begin == group_of.size());
            group_of.resize(end, static_cast<std::uint32_t>(groups.size()));
            groups.push_back(detail::point_verdict(run.verdict, votes));
            first_cluster.push_back(point_run.cluster);
          });
      REQUIRE(group_of.size() == points);
      const EvidenceVerdict evidence = {groups, first_cluster, group_of, {}};
      const ScanVerdict verdict = writer.write(scan, evidence);
      writer.write_flags(scan, evidence);
      for (std::size_t i = 0; i < points; ++i) {
        const std::uint32_t to = order[ground + i];
        const bool dynamic = expected[i].votes >= votes;
        require_answer(verdict, to, dynamic ? PointLabel::kDynamic : PointLabel::kStatic,
                       dynamic ? Cause::kProposed : static_cause(expected[i].stage),
                       expected[i].belief, cluster_of[i]);
        REQUIRE(writer.is_kept()[ground + i] == (dynamic ? 0 : 1));
      }
      for (std::size_t i = 0; i < ground; ++i) {
        require_answer(verdict, order[i], PointLabel::kGround, Cause::kGround, 0.0F, kNoCluster);
        REQUIRE(writer.is_kept()[i] == 1);
      }
      for (std::size_t i = ground + points; i < order.size(); ++i) {
        require_answer(verdict, order[i], PointLabel::kInvalid, Cause::kNotJudged, 0.0F,
                       kNoCluster);
      }
    };

    const std::vector<WindowVerdict> first = random_verdicts(random);
    add(first_runs, first);
    std::vector<detail::WindowVotes::Run> merged;
    scan.windows.begin(first_runs);
    scan.windows.record(first_runs, first, merged);
    check(1);

    const std::size_t windows = random.index(4);
    for (std::size_t k = 0; k < windows; ++k) {
      const std::vector<PointRun> point_runs = random_runs(random, points);
      const std::vector<WindowVerdict> verdicts = random_verdicts(random);
      add(point_runs, verdicts);
      scan.windows.record(point_runs, verdicts, merged);
    }
    check(1 + static_cast<int>(random.index(3)));
  }
}

constexpr std::uint32_t kGroups = 9;

// Scans in which some groups, and the points without a group, are in no cluster.
struct JudgedScan {
  detail::ScanSlot slot;
  std::size_t ground;
  std::vector<std::uint32_t> order, cluster_of, group_of;

  explicit JudgedScan(Random& random) : ground(random.index(40)) {
    const std::size_t above = random.index(200);
    const std::size_t all = ground + above + random.index(20);
    const std::vector<std::size_t> numbers = random.permutation(all);
    order.assign(numbers.begin(), numbers.end());
    slot.split.resize(ground + above);
    slot.split.ground_count = ground;
    slot.input.assign(order);
    slot.valid = all;
    for (std::uint32_t c = 0; c < kClusters; ++c) slot.ids.push_back(100 + c);
    for (std::size_t g = 1; g < kGroups; ++g) {
      cluster_of.push_back(random_cluster(random));
    }
    for (std::size_t i = 0; i < above; ++i) {
      group_of.push_back(static_cast<std::uint32_t>(random.index(kGroups)));
    }
  }
};

EvidenceVerdict::Group random_group(Random& random) {
  constexpr Cause kCauses[] = {Cause::kOccupied, Cause::kNoEvidence, Cause::kFreeSpace,
                               Cause::kWithInstance};
  return {kCauses[random.index(4)], random.index(2) == 0 ? 0.5F : random.uniform_float(0.5, 1.0)};
}

TEST_CASE("verdicts by evidence are those of the point's group, at once and again") {
  detail::VerdictWriter writer;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    INFO("seed " << seed);
    Random random(seed);
    JudgedScan scan(random);
    detail::ScanSlot& slot = scan.slot;
    const std::size_t above = scan.group_of.size();
    std::vector<EvidenceVerdict::Group> groups(kGroups);
    groups[0] = {Cause::kNotJudged, 0.0F};
    std::vector<EvidenceVerdict::GroundPoint> moved;
    const auto change = [&] {
      for (std::uint32_t g = 1; g < kGroups; ++g) {
        if (random.index(2) == 0) groups[g] = random_group(random);
      }
      moved.clear();
      for (std::uint32_t i = 0; i < scan.ground; ++i) {
        if (random.index(5) == 0) moved.push_back({i, {Cause::kUnderInstance, 0.75F}});
      }
    };
    const auto check = [&] {
      const EvidenceVerdict evidence = {groups, scan.cluster_of, scan.group_of, moved};
      const ScanVerdict verdict = writer.write(slot, evidence);
      writer.write_flags(slot, evidence);
      for (std::size_t i = 0; i < above; ++i) {
        const std::uint32_t to = scan.order[scan.ground + i];
        const std::uint32_t group = scan.group_of[i];
        const std::uint32_t cluster = group == 0 ? kNoCluster : scan.cluster_of[group - 1];
        const EvidenceVerdict::Group& expected = groups[group];
        const bool dynamic = is_dynamic(expected.cause);
        require_answer(verdict, to, dynamic ? PointLabel::kDynamic : PointLabel::kStatic,
                       expected.cause, expected.belief, cluster);
        REQUIRE(writer.is_kept()[scan.ground + i] == (dynamic ? 0 : 1));
      }
      for (std::uint32_t i = 0; i < scan.ground; ++i) {
        const bool dynamic = std::any_of(moved.begin(), moved.end(),
                                         [i](const auto& point) { return point.point == i; });
        require_answer(verdict, scan.order[i], dynamic ? PointLabel::kDynamic : PointLabel::kGround,
                       dynamic ? Cause::kUnderInstance : Cause::kGround, dynamic ? 0.75F : 0.0F,
                       kNoCluster);
        REQUIRE(writer.is_kept()[i] == (dynamic ? 0 : 1));
      }
      std::size_t outside = 0;
      for (std::size_t i = 0; i < verdict.labels.size(); ++i) {
        if (verdict.labels[i] != PointLabel::kOutOfRange) continue;
        ++outside;
        require_answer(verdict, i, PointLabel::kOutOfRange, Cause::kNotJudged, 0.0F, kNoCluster);
      }
      REQUIRE(outside == verdict.labels.size() - slot.split.count);
    };

    for (int time = 0; time < 3; ++time) {
      change();
      check();
    }
  }
}

TEST_CASE("ids go to the cluster that has most points, for any point_runs") {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    INFO("seed " << seed);
    Random random(seed);
    const auto points = static_cast<std::uint32_t>(random.index(200));
    const std::vector<PointRun> old_runs = random_runs(random, points);
    const std::vector<PointRun> point_runs = random_runs(random, points);
    const std::vector<std::uint32_t> old_ids = {11, 12, 13, 14, 15, 16};
    detail::InstanceIds instance_ids;
    std::vector<std::uint32_t> ids;
    detail::ClusterPredecessors predecessors;
    instance_ids.propagate(predecessors.find(old_runs, point_runs, kClusters), old_ids, ids);
    REQUIRE(ids.size() == kClusters);

    const std::vector<std::uint32_t> old_cluster = by_point(old_runs);
    const std::vector<std::uint32_t> cluster = by_point(point_runs);
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
        if (2 * count <= all) continue;  // only a majority certainly wins the vote
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
