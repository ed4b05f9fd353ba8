// Beliefs of the free-space evidence, compared with values by hand and with a slow sum.
#include "dynains/evidence/instance_beliefs.hpp"

#include "dynains/evidence/instance_judge.hpp"
#include "dynains/evidence/reference_scans.hpp"
#include "support/catch.hpp"
#include "support/random.hpp"
#include "support/visibility.hpp"

namespace dynains::test {
namespace {

using namespace detail;

using Belief = InstanceBeliefs::Belief;

constexpr float kFreeStep = 0.8472979F;  // log-odds of p_free = 0.7
constexpr float kHitStep = -1.6959109F;  // log-odds of p_hit = 0.155

// Supervoxels of each instance, by their numbers of samples.
using Instances = std::vector<std::vector<std::uint32_t>>;

// All samples lie 10 m ahead of the sensor.
InstanceSamples samples_of(const Instances& instances) {
  InstanceSamples samples;
  samples.sample_begin = {0};
  samples.supervoxel_begin = {0};
  std::uint32_t instance = 0;
  for (const std::vector<std::uint32_t>& supervoxels : instances) {
    for (const std::uint32_t count : supervoxels) {
      for (std::uint32_t i = 0; i < count; ++i) samples.points.push_back(10.0F, 0.0F, 0.0F);
      samples.sample_begin.push_back(samples.sample_begin.back() + count);
      samples.instance_of.push_back(instance);
      samples.place.push_back(voxel_key(0, 0, 0));
    }
    samples.supervoxel_begin.push_back(static_cast<std::uint32_t>(samples.supervoxel_count()));
    ++instance;
  }
  return samples;
}

// One scan and the results of references on it.
struct Scan {
  explicit Scan(const Instances& instances)
      : updater(FreeSpaceConfig()), samples(samples_of(instances)) {
    updater.begin(samples, beliefs);
  }

  // By supervoxel: number of samples seen free, then number of samples hit, beginning with the
  // first sample.
  struct Seen {
    std::size_t free, hit;
  };
  void see(const std::vector<Seen>& seen,
           const Eigen::Vector3f& reference = Eigen::Vector3f::Zero()) {
    std::vector<BeamResult> visibility(samples.size(), BeamResult::kUnknown);
    for (std::size_t s = 0; s < seen.size(); ++s) {
      const auto begin = visibility.begin() + samples.sample_begin[s];
      std::fill_n(begin, seen[s].free, BeamResult::kFree);
      std::fill_n(begin + static_cast<std::ptrdiff_t>(seen[s].free), seen[s].hit, BeamResult::kHit);
    }
    updater.update(samples, visibility_of(visibility), reference, beliefs);
  }
  const Belief& belief(std::size_t supervoxel = 0) const { return beliefs.supervoxels[supervoxel]; }
  bool is_free(std::size_t supervoxel = 0) const { return updater.is_free(belief(supervoxel)); }

  InstanceBeliefUpdater updater;
  InstanceSamples samples;
  InstanceBeliefs beliefs;
};

TEST_CASE("a place that was hit needs more evidence, and starts again from zero") {
  Scan scan(Instances{{4}});
  scan.see({{4, 0}});
  CHECK(scan.is_free());  // 1.69 is above the 0.62 of tau_free
  scan.see({{0, 2}});
  CHECK_FALSE(scan.is_free());  // below the 2.20 of tau_contested
  CHECK(scan.belief().level == Approx(std::max(0.0F, 2.0F * kFreeStep + kHitStep)).margin(1e-6));
  scan.see({{0, 4}});
  CHECK(scan.belief().level == 0.0F);  // never below zero
  CHECK(scan.belief().peak == Approx(2.0F * kFreeStep));

  Scan hit(Instances{{4}});
  hit.see({{0, 4}});
  hit.see({{3, 1}});
  CHECK_FALSE(hit.is_free());
  hit.see({{4, 0}});
  CHECK(hit.is_free());  // 2.54
  hit.see({{0, 4}});
  CHECK(hit.is_free());  // the peak of the belief decides
  CHECK(hit.belief().level == Approx(3.0F * kFreeStep + kHitStep));
}

TEST_CASE("free samples of an instance that is mostly hit count half") {
  const std::vector<Scan::Seen> standing = {{0, 5}, {0, 12}}, part = {{5, 0}, {0, 12}},
                                more = {{5, 0}, {0, 11}};  // 0.29 and 0.31 of the instance
  Scan left(Instances{{5, 12}});
  left.see(standing);
  left.see(more);
  left.see(more);
  CHECK(left.belief().peak == Approx(4.0F * kFreeStep));
  left.see(standing);
  CHECK(left.is_free());

  Scan stands(Instances{{5, 12}});
  stands.see(standing);
  stands.see(part);
  stands.see(part);
  CHECK(stands.belief().level == Approx(2.0F * kFreeStep));
  CHECK_FALSE(stands.is_free());
  stands.see(part);
  CHECK(stands.is_free());
  CHECK(stands.belief().peak == Approx(3.0F * kFreeStep));

  // Five of 20 samples are enough for the whole, four are not.
  for (const std::size_t seen : {4U, 5U}) {
    Scan partly(Instances{{5, 15}});
    partly.see({{seen, 0}, {0, 0}});
    CHECK(partly.belief().peak == Approx(seen == 5 ? 2.0F * kFreeStep : kFreeStep));
  }
}

// Cause of the last supervoxel of a scan with one instance. `others`: samples in other scans of its
// track.
Cause last_cause(const Scan& scan, const TrackedInstances::Seen& others = {}) {
  InstanceEvidence evidence;
  evidence.samples = scan.samples;
  evidence.beliefs = scan.beliefs;
  const auto moved = static_cast<float>(scan.beliefs.counts[0].moved);
  const auto stood = static_cast<float>(scan.beliefs.counts[0].stood());
  evidence.tracked.instances.resize(1);
  evidence.tracked.instances[0].past.seen = {moved + others.moved, stood + others.stood};
  evidence.tracked.instances[0].future.seen = {moved, stood};
  evidence.tracked.shapes.resize(1);
  InstanceJudge judge{FreeSpaceConfig()};
  std::vector<InstanceJudge::Verdict> verdicts;
  judge.judge(evidence, scan.updater, false, verdicts);
  return verdicts.back().cause;
}

TEST_CASE("an instance is removed if .22 of its known samples moved") {
  Scan enough(Instances{{22, 78}});
  enough.see({{22, 0}, {0, 78}});
  CHECK(enough.beliefs.counts[0].moved == 22);
  CHECK(enough.beliefs.counts[0].decided == 100);
  CHECK(last_cause(enough) == Cause::kWithInstance);

  Scan too_little(Instances{{22, 79}});
  too_little.see({{22, 0}, {0, 79}});
  CHECK(too_little.beliefs.counts[0].decided == 101);
  CHECK(last_cause(too_little) == Cause::kOccupied);

  // A supervoxel without results does not count as known.
  Scan hidden(Instances{{22, 79, 200}});
  hidden.see({{22, 0}, {0, 78}, {0, 0}});
  CHECK(hidden.beliefs.counts[0].decided == 101);
  CHECK(hidden.beliefs.counts[0].total == 301);
}

TEST_CASE("the samples of all scans of a track count") {
  Scan stands(Instances{{10, 10}});
  stands.see({{0, 10}, {0, 10}});
  CHECK(last_cause(stands) == Cause::kOccupied);
  CHECK(last_cause(stands, {6.0F, 0.0F}) == Cause::kAlongTrack);  // 6 of 26
  CHECK(last_cause(stands, {5.0F, 0.0F}) == Cause::kOccupied);
  CHECK(last_cause(stands, {6.0F, 2.0F}) == Cause::kOccupied);

  Scan moves(Instances{{10, 10}});
  moves.see({{10, 0}, {0, 10}});
  CHECK(last_cause(moves, {0.0F, 25.0F}) == Cause::kWithInstance);  // 10 of 45
  CHECK(last_cause(moves, {0.0F, 26.0F}) == Cause::kOccupied);

  CHECK(last_cause(Scan(Instances{{10, 10}})) == Cause::kNoEvidence);
  CHECK(last_cause(Scan(Instances{{10, 10}}), {1.0F, 3.0F}) == Cause::kAlongTrack);
}

TEST_CASE("a place that is hit again twice after it was free is seen through by chance") {
  const auto see = [](const std::string& references) {
    Scan scan(Instances{{4}});
    for (const char reference : references) {
      if (reference == 'F') scan.see({{4, 0}});
      if (reference == 'H') scan.see({{0, 4}});
    }
    return scan.is_free();
  };
  CHECK(see("HFFFF"));
  CHECK(see("HFFFFHH"));  // another object came to the place
  CHECK(see("HFFFFHHFF"));
  CHECK_FALSE(see("HFFFFHHFFH"));
  CHECK_FALSE(see("HFFFFHHFFHFFFF"));
}

// Reference at an angle (deg), seen from the samples, to the direction to the sensor.
Eigen::Vector3f beside(double angle, double range = 6.0) {
  const double radians = angle * M_PI / 180.0;
  return {static_cast<float>(10.0 - range * std::cos(radians)),
          static_cast<float>(range * std::sin(radians)), 0.0F};
}

TEST_CASE("what is hit from its own side is not free because another side sees through it") {
  const auto is_free = [](int hits, double angle, bool was_free = false) {
    Scan scan(Instances{{4, 4}});
    for (int i = 0; i < hits; ++i) scan.see({{0, 4}, {0, 4}}, beside(10.0));
    if (was_free) scan.see({{4, 0}, {1, 3}}, beside(10.0));
    for (int i = 0; i < 4; ++i) scan.see({{4, 0}, {4, 0}}, beside(angle));
    CHECK(scan.is_free(0) == scan.is_free(1));
    CHECK(is_dynamic(last_cause(scan)) == scan.is_free());
    return scan.is_free();
  };
  CHECK(is_free(6, 90.0));
  CHECK_FALSE(is_free(7, 90.0));
  CHECK(is_free(7, 19.9));
  CHECK_FALSE(is_free(7, 20.1));
  CHECK_FALSE(is_free(7, 180.0));
  CHECK(is_free(7, 90.0, true));  // five of eight samples were free from its own side, too
}

TEST_CASE("references that see little of an instance do not tell that it stands") {
  for (const std::size_t seen : {2U, 1U}) {  // of eight; a quarter is enough
    Scan scan(Instances{{8}});
    for (int i = 0; i < 7; ++i) scan.see({{0, seen}}, beside(0.0));
    for (int i = 0; i < 4; ++i) scan.see({{8, 0}}, beside(90.0));
    CHECK(scan.is_free() == (seen < 2U));
  }
}

TEST_CASE("a part that seven references hit and none saw free stays when its instance moves") {
  const auto cause = [&](int hits, bool was_free, float moved_in_others) {
    Scan scan(Instances{{8, 4}});
    const bool with_instance = moved_in_others <= 0.0F;
    scan.see({{with_instance ? 8U : 0U, 0}, {was_free ? 4U : 0U, 0}});
    for (int i = 0; i < hits; ++i) scan.see({{0, 0}, {0, 4}});
    return last_cause(scan, {moved_in_others, 0.0F});
  };
  CHECK(cause(6, false, 0.0F) == Cause::kWithInstance);
  CHECK(cause(7, false, 0.0F) == Cause::kOccupied);
  CHECK(cause(7, true, 0.0F) == Cause::kWithInstance);
  CHECK(cause(6, false, 9.0F) == Cause::kAlongTrack);
  CHECK(cause(7, false, 9.0F) == Cause::kOccupied);
  CHECK(cause(40, false, 9.0F) == Cause::kOccupied);
}

// Slow reference sum: recounts each supervoxel and instance for every reference.
void add_slowly(const InstanceSamples& samples, const std::vector<BeamResult>& visibility,
                std::vector<Belief>& supervoxels) {
  const FreeSpaceConfig config;
  const auto increment = static_cast<float>(log_odds(config.p_free));
  const auto decrement = static_cast<float>(log_odds(config.p_hit));
  const auto count = [&](std::size_t begin, std::size_t end, BeamResult result) {
    return static_cast<float>(std::count(visibility.begin() + static_cast<std::ptrdiff_t>(begin),
                                         visibility.begin() + static_cast<std::ptrdiff_t>(end),
                                         result));
  };
  const auto add = [&](Belief& belief, float share, bool stands, bool raises, bool lowers) {
    if (raises) {
      belief.turns |= 1U;
      belief.level += (share > 0.9F ? 2.0F : 1.0F) * (stands ? 0.5F : 1.0F) * increment;
      belief.peak = std::max(belief.peak, belief.level);
    } else if (lowers) {
      belief.contested = 1;
      belief.level = std::max(0.0F, belief.level + decrement);
      if (belief.turns % 2 == 1 && belief.turns < 4) ++belief.turns;
    }
  };
  for (std::size_t s = 0; s < supervoxels.size(); ++s) {
    const std::size_t begin = samples.sample_begin[s], end = samples.sample_begin[s + 1];
    const auto size = static_cast<float>(end - begin);
    const float free = count(begin, end, BeamResult::kFree),
                hit = count(begin, end, BeamResult::kHit);
    if (free + hit == 0.0F) continue;
    const float share = free / (free + hit);
    const std::uint32_t instance = samples.instance_of[s];
    const std::size_t first = samples.sample_begin[samples.supervoxel_begin[instance]];
    const std::size_t last = samples.sample_begin[samples.supervoxel_begin[instance + 1]];
    const float all_free = count(first, last, BeamResult::kFree);
    const float all_seen = all_free + count(first, last, BeamResult::kHit);
    const bool stands =
        all_seen < 0.25F * static_cast<float>(last - first) || all_free / all_seen <= 0.3F;
    add(supervoxels[s], share, stands, share >= 0.6F, share <= 0.3F);
    if (share <= 0.3F && hit >= std::min(2.0F, size)) {
      supervoxels[s].hits = std::min<std::uint8_t>(supervoxels[s].hits + 1, 7);
    }
  }
}

TEST_CASE("beliefs equal those of the slow reference sum") {
  Random random(29);
  for (int round = 0; round < 40; ++round) {
    Instances instances(1 + random.index(12));
    for (std::vector<std::uint32_t>& supervoxels : instances) {
      supervoxels.resize(random.index(20));  // some have none
      for (std::uint32_t& count : supervoxels) {
        count =
            static_cast<std::uint32_t>(1 + random.index(round % 2 == 0 ? 4 : Visibility::kMaxBits));
      }
    }
    Scan scan(instances);
    std::vector<Belief> supervoxels(scan.samples.supervoxel_count());
    for (int reference = 0; reference < 24; ++reference) {
      // Whole supervoxels often have equal results.
      std::vector<BeamResult> visibility(scan.samples.size());
      for (std::size_t s = 0; s < scan.samples.supervoxel_count(); ++s) {
        const double free = random.uniform(-0.5, 1.5), seen = random.uniform(-0.5, 1.5);
        for (std::size_t i = scan.samples.sample_begin[s]; i < scan.samples.sample_begin[s + 1];
             ++i) {
          const bool is_seen = random.uniform(0.0, 1.0) < seen;
          const bool is_free = random.uniform(0.0, 1.0) < free;
          visibility[i] = !is_seen  ? BeamResult::kUnknown
                          : is_free ? BeamResult::kFree
                                    : BeamResult::kHit;
        }
      }
      scan.updater.update(scan.samples, visibility_of(visibility), Eigen::Vector3f::Zero(),
                          scan.beliefs);
      add_slowly(scan.samples, visibility, supervoxels);
    }
    for (std::size_t s = 0; s < supervoxels.size(); ++s) {
      REQUIRE(scan.belief(s).level == supervoxels[s].level);
      REQUIRE(scan.belief(s).peak == supervoxels[s].peak);
      REQUIRE(scan.belief(s).contested == supervoxels[s].contested);
      REQUIRE(scan.belief(s).hits == supervoxels[s].hits);
      REQUIRE(scan.belief(s).turns == supervoxels[s].turns);
    }
    for (std::size_t i = 0; i < instances.size(); ++i) {
      std::uint32_t total = 0, moved = 0, decided = 0;
      for (std::uint32_t s = scan.samples.supervoxel_begin[i];
           s < scan.samples.supervoxel_begin[i + 1]; ++s) {
        const std::uint32_t size = scan.samples.sample_begin[s + 1] - scan.samples.sample_begin[s];
        total += size;
        moved += scan.is_free(s) ? size : 0;
        decided += scan.is_free(s) || supervoxels[s].hits != 0 ? size : 0;
      }
      REQUIRE(scan.beliefs.counts[i].total == total);
      REQUIRE(scan.beliefs.counts[i].moved == moved);
      REQUIRE(scan.beliefs.counts[i].decided == decided);
    }
  }
}

// A wall in all directions at `range` (m).
GroundSplit wall(float range) {
  constexpr std::size_t kColumns = 360, kRows = 3;
  GroundSplit split;
  split.resize(kColumns * kRows);
  for (std::size_t i = 0; i < split.count; ++i) {
    const double angle = static_cast<double>(i / kRows) * M_PI / 180.0;
    split.points.x[i] = range * static_cast<float>(std::cos(angle));
    split.points.y[i] = range * static_cast<float>(std::sin(angle));
    split.points.z[i] = 0.05F * range * (static_cast<float>(i % kRows) - 1.0F);
  }
  return split;
}

// A sensor of which each reference takes six scans if the gap (deg) is 3.
SensorModel sparse_sensor(double gap = 3.0) {
  SensorModel sensor = SensorModel::typical();
  sensor.azimuth_step = 1.0;
  sensor.elevation_gap = gap;
  sensor.elevation_gap_wide = 3.0;
  return sensor;
}

ReferenceScans references_of_sparse_sensor() {
  const SensorModel sensor = sparse_sensor();
  ReferenceScans references{FreeSpaceConfig()};
  references.adapt({&sensor, 1});
  return references;
}

// What the newest reference tells of points straight ahead of a scan at these ranges (m).
Visibility::Bits seen_ahead(ReferenceScans& views, std::uint64_t scan,
                            const std::vector<float>& ranges) {
  PointBuffer points;
  for (const float range : ranges) points.push_back(range, 0.0F, 0.0F);
  points.grow(ranges.size() + kPackWidth);  // padded for packs
  Visibility memory;
  return views.test(points, ranges.size(), scan, Pose::Identity(), views.newest(), memory)
      .bits(0, ranges.size());
}

TEST_CASE("a scan is not tested against its own beams in a reference of several scans") {
  ReferenceScans views = references_of_sparse_sensor();
  views.add(0, 0, 0, Eigen::Isometry3d::Identity(), wall(10.0F), {});
  for (const std::uint64_t scan : {0U, 1U, 2U}) {
    const auto seen = seen_ahead(views, scan, {5.0F, 10.0F});
    CHECK(seen.free == (scan < 2 ? 0U : 1U));
    CHECK(seen.hit == (scan < 2 ? 0U : 2U));
  }
}

TEST_CASE("scans of a reference share an image while the sensor stays near") {
  ReferenceScans views = references_of_sparse_sensor();
  REQUIRE(views.span().step == 6);
  Eigen::Isometry3d T_world_level = Eigen::Isometry3d::Identity();
  const auto add = [&](std::uint64_t scan, double step) {
    T_world_level.translation().x() += step;
    views.add(scan, 0, scan, T_world_level, wall(10.0F - static_cast<float>(T_world_level(0, 3))),
              {});
  };
  add(0, 0.0);
  for (std::uint64_t scan = 1; scan <= 6; ++scan) add(scan, 0.15);
  REQUIRE(views.newest().count == 3);  // two scans each
  CHECK(views.newest().views[2].first == 5);
  CHECK(views.newest().views[2].last == 6);
  for (std::uint64_t scan = 7; scan <= 12; ++scan) add(scan, 0.04);
  REQUIRE(views.newest().count == 1);
  const ReferenceView& view = views.newest().views.front();
  CHECK(view.first == 7);
  CHECK(view.T_world_beams(0, 3) == Approx(1.06));  // of scan 10
  CHECK(view.image.grid().columns > 450);
  // The walls of all scans lie at x = 10 m.
  const auto seen = seen_ahead(views, 1000, {6.0F, 10.0F});
  CHECK(seen.free == 1U);
  CHECK(seen.hit == 2U);
}

TEST_CASE("a reference is found as long as scans need it, and every scan finds its references") {
  // A reference of a sparse sensor takes 6 scans, and so do its steps.
  for (const auto& [given_step, lookback, lookahead, scans] :
       {std::array{1, 12, 6, 1}, std::array{2, 100, 30, 1}, std::array{3, 75, 0, 1},
        std::array{2, 20, 60, 1}, std::array{2, 100, 30, 6}, std::array{8, 75, 0, 6}}) {
    const int step = std::max(given_step, scans);
    INFO("step " << step << ", lookback " << lookback << ", lookahead " << lookahead);
    FreeSpaceConfig config;
    config.reference_step = given_step;
    config.lookback_scans = lookback;
    config.lookahead_scans = lookahead;
    ReferenceScans views(config);
    const ReferenceSpan& span = views.span();
    const SensorModel sensor = sparse_sensor(scans > 1 ? 3.0 : 0.5);
    REQUIRE(scans_to_see_things(sensor, 10) == scans);
    views.adapt({&sensor, 1});
    REQUIRE(span.step == step);
    constexpr std::uint64_t kScans = 240, kBreak = 17;  // another epoch begins at kBreak
    const auto epoch_of = [](std::uint64_t scan) { return scan < kBreak ? 0U : 1U; };
    const auto since_begin = [](std::uint64_t scan) {
      return scan < kBreak ? scan : scan - kBreak;
    };
    for (std::uint64_t scan = 0; scan < kScans; ++scan) {
      const bool is_newest = since_begin(scan) % static_cast<std::uint64_t>(step) == 0;
      REQUIRE((views.takes(since_begin(scan)) || !is_newest));
      if (views.takes(since_begin(scan))) {
        REQUIRE(views.find(scan, epoch_of(scan)) == nullptr);
        views.add(scan, epoch_of(scan), since_begin(scan), Eigen::Isometry3d::Identity(),
                  wall(5.0F + 0.1F * static_cast<float>(scan)), {});
        REQUIRE((views.newest().scan == scan) == is_newest);
        if (is_newest) {
          REQUIRE(views.newest().count == 1);  // the sensor stands
        }
      }
      for (int age = 1; age <= 200; ++age) {
        if (static_cast<std::uint64_t>(age) > since_begin(scan)) break;
        if (!span.compares(since_begin(scan), age)) continue;
        REQUIRE(age <= lookback);
        REQUIRE(views.find(scan - static_cast<std::uint64_t>(age), epoch_of(scan)) != nullptr);
      }
      // The references of scans without a final verdict.
      for (int lag = 0; lag <= std::min(lookahead, static_cast<int>(since_begin(scan))); ++lag) {
        const std::uint64_t other = scan - static_cast<std::uint64_t>(lag);
        const bool is_reference = since_begin(other) % static_cast<std::uint64_t>(step) == 0;
        REQUIRE((views.find(other, epoch_of(scan)) != nullptr) == is_reference);
      }
      REQUIRE(views.find(scan, epoch_of(scan) + 1) == nullptr);
    }
    // A beam of the last reference passes points nearer than its walls, and hits the nearest one.
    const auto nearest = 5.0F + 0.1F * static_cast<float>(views.newest().views.front().first);
    const auto seen = seen_ahead(views, 1000, {nearest - 2.0F, nearest, nearest + 2.0F});
    CHECK(seen.free == 1);
    CHECK(seen.hit == 2);
    const std::uint64_t newest_scan = views.newest().scan;
    REQUIRE(views.find(newest_scan, 1) != nullptr);
    views.forget();
    CHECK(views.find(newest_scan, 1) == nullptr);
  }
}

}  // namespace
}  // namespace dynains::test
