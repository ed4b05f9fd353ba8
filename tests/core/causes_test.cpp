// The cause of each verdict, on scenes with known causes.

#include "support/catch.hpp"
#include "support/runs.hpp"

namespace dynains::test {
namespace {

using Config = DynaInsRemover::Config;

// Number of points of `object` with each cause.
struct Causes {
  std::array<std::size_t, kCauseCount> of{};
  std::size_t total = 0;

  Causes(const Scan& scan, const Verdict& verdict, int object = kAnyObject) {
    add(scan, verdict, object);
  }
  Causes(const std::vector<Scan>& scans, const std::vector<Verdict>& verdicts,
         int object = kAnyObject) {
    for (const Verdict& verdict : verdicts) add(scans.at(verdict.scan), verdict, object);
  }

  std::size_t operator[](Cause cause) const { return of[static_cast<std::size_t>(cause)]; }
  double share(Cause cause) const {
    return static_cast<double>((*this)[cause]) / static_cast<double>(total);
  }

 private:
  void add(const Scan& scan, const Verdict& verdict, int object) {
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      if (object != kAnyObject && scan.object[i] != object) continue;
      ++of.at(static_cast<std::size_t>(verdict.causes[i]));
      ++total;
    }
  }
};

TEST_CASE("a cause is one of movement if and only if the label is, in newest and final verdicts") {
  const Config config = GENERATE(Config::paper(), Config());
  const std::vector<Scan> scans = drive(oncoming(), 12, 5.0);
  const Run result = run(config, scans);
  std::size_t moving = 0;
  for (const std::vector<Verdict>* verdicts : {&result.newest, &result.final}) {
    for (const Verdict& verdict : *verdicts) {
      REQUIRE(verdict.causes.size() == verdict.labels.size());
      for (std::size_t i = 0; i < verdict.labels.size(); ++i) {
        const Cause cause = verdict.causes[i];
        const PointLabel label = verdict.labels[i];
        REQUIRE(is_dynamic(cause) == (label == PointLabel::kDynamic));
        REQUIRE((cause == Cause::kGround) == (label == PointLabel::kGround));
        if (!is_static(label) && !is_dynamic(cause)) REQUIRE(cause == Cause::kNotJudged);
        moving += is_dynamic(cause) ? 1 : 0;
      }
    }
  }
  CHECK(moving > 5000);
}

TEST_CASE("which causes remove a point") {
  std::size_t count = 0;
  for (std::size_t i = 0; i < kCauseCount; ++i) count += is_dynamic(static_cast<Cause>(i)) ? 1 : 0;
  CHECK(count == 8);
  CHECK(is_dynamic(Cause::kProposed));
  CHECK(is_dynamic(Cause::kCameOrWent));
  CHECK_FALSE(is_dynamic(Cause::kReverted));
  CHECK_FALSE(is_dynamic(Cause::kStands));
}

TEST_CASE("paper: similar, proposed, reverted by belief, by votes") {
  const std::vector<Scan> scans = drive(oncoming(), 10, 0.0);
  Config config = Config::paper();
  const Run as_published = run(config, scans);
  const Causes pillar(scans, as_published.final, 0);
  REQUIRE(pillar.total > 5000);
  CHECK(pillar.share(Cause::kSimilar) > 0.95);
  const Causes moving(scans, as_published.final, kAddedBox);
  CHECK(moving.share(Cause::kProposed) > 0.9);
  CHECK(moving[Cause::kReverted] == 0);

  config.belief.tau_p = 0.9999999;
  const Causes doubted(scans, run(config, scans).final, kAddedBox);
  CHECK(doubted[Cause::kProposed] == 0);
  CHECK(doubted[Cause::kReverted] == moving[Cause::kProposed]);

  config = Config::paper();
  config.votes = 4;
  // Only three windows compare the first scan with another one.
  const Causes outvoted(scans[0], run(config, scans).final[0], kAddedBox);
  CHECK(outvoted[Cause::kProposed] == 0);
  CHECK(outvoted.share(Cause::kReverted) > 0.5);
}

TEST_CASE("paper: an object in one scan only is static, seen by too few scans") {
  std::vector<Scan> scans = drive(yard(), 9, 0.0);
  scans[4] = yard_with(van(12.0, 3.0)).scan(sensor_at(0.0), scans[4].time);
  const Run result = run_paper(scans);
  const Causes lone(scans[4], result.final[4], kAddedBox);
  REQUIRE(lone.total > 500);
  CHECK(lone[Cause::kTooFewScans] + lone[Cause::kGround] == lone.total);
  CHECK(lone.share(Cause::kTooFewScans) > 0.8);
}

TEST_CASE("not judged: bad points, points out of range, points beyond the range of clusters") {
  Config config = GENERATE(Config::paper(), Config());
  config.clusterer.cluster_range = 12.0;
  std::vector<Scan> scans = drive(yard(), 5, 0.0);
  for (Scan& scan : scans) {
    scan.points.emplace_back(std::numeric_limits<float>::quiet_NaN(), 0.0F, 0.0F);
    scan.object.push_back(100);
    scan.points.emplace_back(0.5F, 0.0F, -1.0F);
    scan.object.push_back(100);
  }
  const std::vector<Verdict> verdicts = run(config, scans).final;
  const Causes bad(scans, verdicts, 100);
  CHECK(bad[Cause::kNotJudged] == bad.total);
  for (const Verdict& verdict : verdicts) {
    const Scan& scan = scans[verdict.scan];
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      const float range = scan.points[i].norm();
      if (scan.object[i] < 0 || !(range > 2.8F) || verdict.labels[i] != PointLabel::kStatic) {
        continue;
      }
      if (std::abs(range - 12.0F) < 0.01F) continue;
      REQUIRE((verdict.causes[i] == Cause::kNotJudged) == (range > 12.0F));
    }
  }
}

TEST_CASE("evidence: a moved object was seen free, a static one was seen occupied") {
  const std::vector<Scan> scans = drive(oncoming(), 10, 5.0);
  const Run result = run(Config(), scans);
  const Causes moving(scans, result.final, kAddedBox);
  CHECK(moving.share(Cause::kFreeSpace) > 0.5);
  CHECK(moving.share(Cause::kFreeSpace) + moving.share(Cause::kWithInstance) +
            moving.share(Cause::kUnderInstance) + moving.share(Cause::kAlongTrack) >
        0.9);
  CHECK(moving[Cause::kWithInstance] > 0);
  const Causes pillar(scans, result.final, 0);
  CHECK(pillar.share(Cause::kOccupied) > 0.7);
  const Causes ground(scans, result.final, kGroundObject);
  CHECK(ground.share(Cause::kGround) + ground.share(Cause::kNotJudged) > 0.97);
  CHECK(ground[Cause::kUnderInstance] == 0);
  CHECK(moving[Cause::kUnderInstance] > 0);
}

// As fast as the sensor and scanned from behind, so that no earlier scan covers its place.
TEST_CASE("evidence: a lead vehicle is presumed to move until its place was seen") {
  const std::vector<Scan> scans = drive(yard_with(van(9.0, 0.0, {10.0, 0.0, 0.0})), 16, 10.0);
  Config config;
  const Run result = run(config, scans);
  CHECK(Causes(scans[1], result.newest[1], kAddedBox)[Cause::kPresumed] == 0);  // first scans
  CHECK(Causes(scans[2], result.newest[2], kAddedBox).share(Cause::kPresumed) > 0.8);
  const Causes final(scans, result.final, kAddedBox);
  CHECK(final[Cause::kPresumed] == 0);
  CHECK(final.share(Cause::kFreeSpace) + final.share(Cause::kWithInstance) > 0.5);

  config.evidence.presume_dynamic = false;
  const Causes silent(scans[2], run(config, scans).newest[2], kAddedBox);
  CHECK(silent.share(Cause::kNoEvidence) > 0.8);
}

}  // namespace
}  // namespace dynains::test
