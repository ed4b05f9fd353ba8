#include "evaluation/map_protocol.hpp"

#include "reference.hpp"
#include "scenes.hpp"
#include "support/catch.hpp"

namespace dynains::evaluation::testing {
namespace {

struct Result {
  Score voxels;
  Score points;
  std::uint64_t foreign;
};

Result run(const std::vector<OwnedScan>& scans, const std::vector<Eigen::Vector3d>& map,
           const EvaluationConfig& with) {
  VoxelProtocol raw(with, 0);
  MapProtocol protocol(with, map);
  for (const OwnedScan& scan : scans) {
    raw.add(scan.view());
    protocol.add(scan.view());
  }
  for (const OwnedScan& scan : scans) {
    raw.resolve(scan.view());
    protocol.resolve(scan.view());
  }
  return {protocol.voxel_score(raw), protocol.point_score(), protocol.foreign_points()};
}

EvaluationConfig map_settings(double voxel, double radius) {
  return {voxel, 0, 0, 0, radius, TruthClasses()};
}

}  // namespace

TEST_CASE("Map points far from all measured points are left out and counted") {
  OwnedScan scan;
  scan.add(0.5F, 0.5F, 0.5F, kRoad);
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<Eigen::Vector3d> map = {{0.5, 0.5, 0.5}, {9, 9, 9}, {1e30, 0, 0}, {0, kNan, 0}};
  const Result result = run({scan}, map, map_settings(1.0, 0.05));
  CHECK(result.foreign == 3);
  CHECK(result.voxels.static_kept == 1);
}

TEST_CASE("A measured point is in the map up to the radius, inclusive") {
  OwnedScan scan;
  scan.add(0.5F, 0.5F, 0.5F, kRoad);       // map point 0.25 away
  scan.add(4.5F, 0.5F, 0.5F, kRoad);       // 0.2578
  scan.add(8.5F, 0.5F, 0.5F, kMovingCar);  // none
  scan.add(12.5F, 0.5F, 0.5F, kMovingCar);
  const std::vector<Eigen::Vector3d> map = {
      {0.75, 0.5, 0.5}, {4.7578125, 0.5, 0.5}, {12.5, 0.5, 0.5}};
  const Score score = run({scan}, map, map_settings(1.0, 0.25)).points;
  CHECK(same(score, {2, 1, 2, 1}));
  CHECK(score.kept() == Approx(50.0));
  CHECK(score.associated() == Approx(50.0));
  CHECK(score.harmonic() == Approx(50.0));
}

TEST_CASE("Map files get the score of the simple reference implementation", "[reference]") {
  for (const std::uint64_t seed : {21U, 22U, 23U}) {
    const auto scans = mixed_scans(seed, 4, 700);
    Random random(seed);
    // A map of the kept points of estimate 0, some with rounding errors of another tool.
    std::vector<Eigen::Vector3d> map;
    for (const OwnedScan& scan : scans) {
      for (std::size_t i = 0; i < scan.truth.size(); ++i) {
        if ((scan.in_map[i] & 1U) == 0) continue;
        const double shift = chance(random, 0.5) ? 0.06 : 0.0;
        map.push_back(scan.T_world_sensor * scan.view().point(i) +
                      shift * random.vector({-1, -1, -1}, {1, 1, 1}));
      }
    }
    EvaluationConfig with = map_settings(0.2, 0.05);
    with.min_range = 0.8;
    with.point_max_range = 2.5;
    const Result result = run(scans, map, with);

    std::vector<VoxelPoint> measured;
    Score points;
    for (const OwnedScan& scan : scans) {
      for (std::size_t i = 0; i < scan.truth.size(); ++i) {
        const Eigen::Vector3d p = scan.view().point(i);
        const Truth truth = with.truth(scan.truth[i]);
        const Eigen::Vector3d p_world = scan.T_world_sensor * p;
        if (in_range(p, with.min_range, 0)) measured.push_back({p_world, truth});
        if (truth == Truth::kIgnored || !in_range(p, with.min_range, with.point_max_range))
          continue;
        bool kept = false;
        for (const Eigen::Vector3d& m : map) kept = kept || (m - p_world).norm() <= 0.05;
        count(truth, kept, points);
      }
    }
    std::vector<VoxelPoint> labelled;
    for (const Eigen::Vector3d& m : map) {
      double nearest = 0.2 * 0.2;  // all lie nearer than an edge
      Truth truth = Truth::kIgnored;
      for (const VoxelPoint& candidate : measured) {
        const double distance = (candidate.p_world - m).squaredNorm();
        if (distance < nearest) {
          nearest = distance;
          truth = candidate.truth;
        }
      }
      if (truth != Truth::kIgnored) labelled.push_back({m, truth});
    }
    const auto raw =
        reference_map(scans, with, [](const OwnedScan&, std::size_t, Truth) { return true; });
    CHECK(same(result.voxels, reference_score(raw, voxelise(labelled, with.voxel), with.voxel)));
    CHECK(same(result.points, points));
    CHECK(points.static_kept < points.static_total);
    CHECK(points.dynamic_removed < points.dynamic_total);
  }
}

}  // namespace dynains::evaluation::testing
