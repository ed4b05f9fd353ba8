// The evidence of a few scans as a whole, on panels in front of a wall.
#include "dynains/evidence/free_space_evidence.hpp"

#include "support/catch.hpp"
#include "support/points.hpp"

namespace dynains::test {
namespace {

// Points on a rectangle across the x axis, at distance x (m).
PointBuffer panel(float x, float y_low, float y_high, float z_low, float z_high) {
  const float step = 0.006F * x;  // less than a cell of the images
  PointBuffer points;
  for (float y = y_low; y < y_high; y += step) {
    for (float z = z_low; z < z_high; z += step) points.push_back(x, y, z);
  }
  return points;
}
PointBuffer wall() { return panel(20.0F, -7.0F, 7.0F, -3.5F, 1.5F); }
PointBuffer car() { return panel(10.0F, -1.0F, 1.0F, -1.5F, 0.5F); }

PointBuffer both(const PointBuffer& a, const PointBuffer& b) {
  PointBuffer points = a;
  for (std::size_t i = 0; i < b.size(); ++i) points.push_back(b.x[i], b.y[i], b.z[i]);
  return points;
}

// Scans of a sensor that stands still: at most one instance, and a wall without an instance.
class Watch {
 public:
  explicit Watch(const FreeSpaceConfig& config) : evidence_(config) {
    SensorModel sensor = SensorModel::typical();
    sensor.azimuth_step = sensor.elevation_gap = sensor.elevation_gap_wide = 0.5;
    evidence_.adapt(sensor, {&sensor, 1});
  }

  Watch& see(const PointBuffer& instance, const PointBuffer& background = wall(),
             std::uint64_t epoch = 0) {
    const GroundSplit split = split_of(both(instance, background));
    std::vector<std::uint32_t> instance_of(split.count, kNoCluster);
    std::fill_n(instance_of.begin(), instance.size(), 0U);
    evidence_.observe(splits_.size(), epoch, Eigen::Isometry3d::Identity(), split, instance_of,
                      instance.size() > 0 ? 1 : 0);
    evidence_.judge(splits_.size(), false);
    if (evidence_.is_reference()) evidence_.make_reference(split);
    splits_.push_back(split);
    sizes_.push_back(instance.size());
    return *this;
  }

  // Causes of all points of the instance.
  std::set<Cause> causes(std::size_t scan, bool is_final = true) {
    evidence_.judge(scan, is_final);
    const EvidenceVerdict said = evidence_.verdict(is_final, splits_[scan]);
    std::set<Cause> result;
    for (std::size_t i = 0; i < sizes_[scan]; ++i) {
      result.insert(said.groups[said.group_of[i]].cause);
    }
    return result;
  }
  bool removes(std::size_t scan) {
    const std::set<Cause> all = causes(scan);
    return std::all_of(all.begin(), all.end(), is_dynamic);
  }
  std::uint32_t predecessor() const { return evidence_.predecessors()[0]; }

 private:
  FreeSpaceEvidence evidence_;
  std::vector<GroundSplit> splits_;
  std::vector<std::size_t> sizes_;
};

using Causes = std::set<Cause>;

FreeSpaceConfig every_scan_a_reference() {
  FreeSpaceConfig config;
  config.reference_step = 1;
  return config;
}

TEST_CASE("only compact instances are presumed to move, from the third scan of an epoch on") {
  struct Case {
    float length, height;
    std::size_t scan = 5;
    std::size_t begin = 0;  // of its epoch
    bool presumed = false;
  };
  FreeSpaceConfig config = every_scan_a_reference();
  const auto causes = [&config](const Case& c, bool is_final) {
    Watch watch(config);
    for (std::size_t scan = 0; scan < c.scan; ++scan) {
      watch.see(PointBuffer(), PointBuffer(), scan < c.begin ? 0 : 1);
    }
    watch.see(panel(10.05F, 0.05F, c.length, 0.05F, c.height), PointBuffer(), 1);
    return watch.causes(c.scan, is_final);
  };
  const auto is_presumed = [&causes](const Case& c) {
    const Causes at_once = causes(c, false);
    CHECK(at_once.size() == 1);
    return at_once == Causes{Cause::kPresumed};
  };
  for (const Case& c : {
           Case{2.0F, 1.5F, 1, 0, false}, Case{2.0F, 1.5F, 2, 0, true},
           Case{2.0F, 1.5F, 6, 5, false}, Case{2.0F, 1.5F, 7, 5, true},
           Case{17.7F, 1.5F, 5, 0, true}, Case{18.6F, 1.5F, 5, 0, false},
           Case{2.0F, 4.4F, 5, 0, true}, Case{2.0F, 5.1F, 5, 0, false},
           Case{0.75F, 0.1F, 5, 0, false},  // twelve points of one supervoxel: four samples
           Case{0.78F, 0.1F, 5, 0, true},   // one more point in another supervoxel: five samples
       }) {
    CAPTURE(c.length, c.height, c.scan, c.begin);
    CHECK(is_presumed(c) == c.presumed);
    CHECK(causes(c, true) == Causes{Cause::kNoEvidence});
  }
  // Instances that are not carried along tracks are not presumed to move.
  config.track_length = 12.0;
  config.track_height = 3.0;
  CHECK(is_presumed({11.7F, 2.9F}));
  CHECK_FALSE(is_presumed({12.6F, 2.9F}));
  CHECK_FALSE(is_presumed({11.7F, 3.6F}));
}

TEST_CASE("an instance that was tracked for five scans is no longer presumed to move") {
  FreeSpaceConfig config;
  config.lookback_scans = 0;  // no evidence
  Watch watch(config);
  watch.see(PointBuffer()).see(PointBuffer());
  for (std::size_t scan = 2; scan < 8; ++scan) {
    watch.see(car());
    CHECK(watch.causes(scan, false) == Causes{scan < 7 ? Cause::kPresumed : Cause::kNoEvidence});
  }
}

TEST_CASE("the first scan of an epoch is evidence on the second one until a third one comes") {
  Watch watch(FreeSpaceConfig{});
  watch.see(PointBuffer()).see(car());
  CHECK(watch.causes(1, false).count(Cause::kFreeSpace) == 1);
  CHECK(watch.causes(1, true).count(Cause::kFreeSpace) == 1);
  watch.see(PointBuffer(), PointBuffer());
  CHECK(watch.causes(1, true) == Causes{Cause::kNoEvidence});

  Watch stays(FreeSpaceConfig{});
  stays.see(car()).see(car());
  CHECK(stays.causes(1, false) == Causes{Cause::kOccupied});
}

TEST_CASE("scans before an instance and scans after it are evidence") {
  FreeSpaceConfig config = every_scan_a_reference();
  config.lookback_scans = config.lookahead_scans = 2;
  // The only references are the first scan and the last one. Each has a wall
  // behind the place, or no points.
  const auto causes = [&config](bool before, bool after) {
    Watch watch(config);
    watch.see(PointBuffer(), before ? wall() : PointBuffer());
    watch.see(PointBuffer(), PointBuffer());
    watch.see(car(), PointBuffer());
    watch.see(PointBuffer(), PointBuffer());
    watch.see(PointBuffer(), after ? wall() : PointBuffer());
    return watch.causes(2);
  };
  // One reference in which the place is wholly free gives twice 0.847, a belief of 0.845.
  config.tau_free = 0.84;
  CHECK(causes(false, false) == Causes{Cause::kNoEvidence});
  CHECK(causes(true, false).count(Cause::kFreeSpace) == 1);
  CHECK(causes(false, true).count(Cause::kFreeSpace) == 1);
  config.tau_free = 0.86;
  CHECK(causes(true, false) == Causes{Cause::kTooLittleFree});
  CHECK(causes(false, true) == Causes{Cause::kTooLittleFree});
  CHECK(causes(true, true).count(Cause::kFreeSpace) == 1);
}

TEST_CASE("scans of another epoch give no evidence about an instance and no predecessor") {
  for (const std::uint64_t epoch : {0U, 1U}) {
    Watch left(every_scan_a_reference());
    left.see(car());
    for (int i = 0; i < 5; ++i) left.see(PointBuffer(), wall(), epoch);
    CAPTURE(epoch);
    CHECK(left.removes(0) == (epoch == 0));
    if (epoch != 0) CHECK(left.causes(0) == Causes{Cause::kNoEvidence});

    Watch stays(every_scan_a_reference());
    stays.see(car()).see(car(), wall(), epoch);
    CHECK(stays.predecessor() == (epoch == 0 ? 0 : kNoCluster));
  }
}

TEST_CASE("a standing object gives no evidence for a movement, however long it stands") {
  Watch watch(every_scan_a_reference());
  for (int i = 0; i < 12; ++i) watch.see(car());
  for (const std::size_t scan : {0U, 6U, 11U}) {
    CHECK(watch.causes(scan) == Causes{Cause::kOccupied});
  }
}

TEST_CASE("evidence from a later scan is carried along the track to scans beside") {
  FreeSpaceConfig config = every_scan_a_reference();
  const auto causes = [&config] {
    Watch watch(config);
    watch.see(PointBuffer(), PointBuffer());
    watch.see(car(), PointBuffer()).see(car(), PointBuffer());
    CHECK(watch.causes(1) == Causes{Cause::kNoEvidence});
    watch.see(PointBuffer());  // two scans after the first of both
    CHECK(watch.removes(1));
    return watch.causes(2);
  };
  CHECK(causes() == Causes{Cause::kAlongTrack});
}

// In one scan, both are one instance, and one supervoxel at the border has few samples to see.
TEST_CASE("an object that stood long before stays when an object that moved was merged with it") {
  FreeSpaceConfig config = every_scan_a_reference();
  config.lookahead_scans = 0;
  const PointBuffer passing = panel(10.0F, 1.2F, 3.2F, -1.5F, 0.5F);
  Watch watch(config);
  for (int i = 0; i < 21; ++i) watch.see(car());
  watch.see(both(car(), passing));
  CHECK(watch.causes(21) == Causes{Cause::kFreeSpace, Cause::kNoEvidence, Cause::kOccupied});
  watch.see(car());
  CHECK(watch.predecessor() == 0);
  CHECK(watch.causes(22) == Causes{Cause::kOccupied});
}

// The only references are the scans two and four back.
TEST_CASE("returns of a moved object do not contest a later object in its place") {
  FreeSpaceConfig config = every_scan_a_reference();
  config.lookback_scans = 4;
  config.lookahead_scans = 0;
  config.dynamic_grid_ratio = 1.0;
  Watch watch(config);
  for (int i = 0; i < 4; ++i) watch.see(PointBuffer());
  watch.see(car());
  CHECK(watch.causes(4) == Causes{Cause::kFreeSpace});
  for (int i = 0; i < 3; ++i) watch.see(PointBuffer());
  watch.see(car());
  CHECK(watch.causes(8) == Causes{Cause::kFreeSpace});
}

// An object stands beside a hedge in one scan and is merged with it. The scans beside tell that the
// hedge stands; without them, a part of the removed instance that was not seen free still contests.
TEST_CASE("a hedge stays when an object was merged with it, or contests later instances") {
  FreeSpaceConfig config = every_scan_a_reference();
  config.lookahead_scans = 0;
  config.dynamic_grid_ratio = 1.0;
  const PointBuffer hedge = panel(10.0F, -3.0F, 1.4F, -1.5F, 0.5F);
  const PointBuffer passing = panel(10.0F, 1.4F, 3.0F, -1.5F, 0.5F);
  for (const bool by_tracks : {true, false}) {
    if (!by_tracks) {
      config.lookback_scans = 2;
      config.track_overlap = 1.0;
    }
    Watch watch(config);
    for (int i = 0; i < 6; ++i) watch.see(hedge);
    watch.see(both(hedge, passing));
    CHECK(watch.causes(6) ==
          Causes{Cause::kFreeSpace, by_tracks ? Cause::kOccupied : Cause::kWithInstance});
    watch.see(hedge).see(hedge);
    CHECK(watch.causes(8) == Causes{Cause::kOccupied});
  }
}

TEST_CASE("returns of a static object contest, even if it was presumed to move") {
  Watch watch(every_scan_a_reference());
  for (int i = 0; i < 5; ++i) watch.see(PointBuffer(), PointBuffer());
  watch.see(car(), PointBuffer());
  CHECK(watch.causes(5, false) == Causes{Cause::kPresumed});
  for (int i = 0; i < 4; ++i) watch.see(car(), PointBuffer());
  CHECK(watch.causes(5) == Causes{Cause::kOccupied});
  CHECK(watch.causes(9) == Causes{Cause::kOccupied});
}

}  // namespace
}  // namespace dynains::test
