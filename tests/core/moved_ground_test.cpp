// Ground under removed instances: points of objects on it are removed, the ground itself stays.
#include "dynains/evidence/moved_ground.hpp"

#include <Eigen/Dense>

#include "dynains/evidence/ground_samples.hpp"
#include "support/catch.hpp"
#include "support/points.hpp"
#include "support/random.hpp"
#include "support/visibility.hpp"

namespace dynains::test {
namespace {

using namespace detail;

constexpr float kUnknown = SurroundingGround::kUnknown;

// A street that falls to the right and rises ahead.
float street(float x, float y) { return -1.7F + 0.1F * x - 0.05F * y; }

// Points of the street, one in 0.5 m, except those where `leave_out(x, y)`.
template <class LeaveOut>
PointBuffer street_about(float x, float y, float reach, LeaveOut&& leave_out) {
  PointBuffer points;
  for (float px = x - reach; px <= x + reach; px += 0.5F) {
    for (float py = y - reach; py <= y + reach; py += 0.5F) {
      if (!leave_out(px, py)) points.push_back(px, py, street(px, py));
    }
  }
  return points;
}
constexpr auto kNothing = [](float, float) { return false; };

// Height over the plane through all points in the nine cells around a place, by Eigen.
float reference_height(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& at) {
  const auto cell = [](double coordinate) { return std::floor(coordinate / 2.0); };
  std::vector<Eigen::Vector3d> around;
  for (const Eigen::Vector3d& p : points) {
    if (std::abs(cell(p.x()) - cell(at.x())) <= 1 && std::abs(cell(p.y()) - cell(at.y())) <= 1) {
      around.push_back(p);
    }
  }
  if (around.size() < 8) return kUnknown;
  Eigen::Matrix3Xd off(3, around.size());
  for (std::size_t i = 0; i < around.size(); ++i) off.col(static_cast<Eigen::Index>(i)) = around[i];
  const Eigen::Vector3d mean = off.rowwise().mean();
  off.colwise() -= mean;
  const Eigen::Matrix3d covariance = off * off.transpose() / static_cast<double>(around.size());
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> horizontal(covariance.topLeftCorner<2, 2>());
  if (horizontal.eigenvalues()[0] < 0.4) return kUnknown;
  const Eigen::Vector3d normal =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvectors().col(0);
  return static_cast<float>(normal.dot(at - mean) / normal.z());
}

TEST_CASE("heights equal those of a fit by total least squares") {
  Random random(71);
  SurroundingGround ground;
  std::size_t known = 0, unknown = 0;
  for (int round = 0; round < 40; ++round) {
    const double x = random.uniform(-60.0, 60.0), y = random.uniform(-60.0, 60.0);
    const double reach = random.uniform(0.5, 6.0);
    const std::size_t count = 4 + random.index(60);
    PointBuffer points;
    std::vector<Eigen::Vector3d> all;
    for (std::size_t i = 0; i < count; ++i) {
      Eigen::Vector3d p =
          random.vector({x - reach, y - reach, -0.02}, {x + reach, y + reach, 0.02});
      p.z() += 0.08 * p.x() + (random.index(5) == 0 ? 0.2 : 0.0);
      add_point(points, p);
      all.push_back(p.cast<float>().cast<double>());
    }
    ground.assign(points);
    for (int query = 0; query < 20; ++query) {
      const Eigen::Vector3d at =
          random.vector({x - reach, y - reach, -3.0}, {x + reach, y + reach, 3.0});
      const Eigen::Vector3f q = at.cast<float>();
      const float expected = reference_height(all, q.cast<double>());
      const float height = ground.height(q.x(), q.y(), q.z());
      (expected == kUnknown ? unknown : known) += 1;
      if (expected == kUnknown) {
        CHECK(height == kUnknown);
      } else {
        CHECK(height == Approx(expected).margin(2e-4));
      }
    }
  }
  CHECK(known > 200);
  CHECK(unknown > 100);
}

// A box of 2 m that was removed, `rise` (m) above the street.
struct RemovedBox {
  explicit RemovedBox(float over = 0.2F) {
    for (float x = 19.0F; x <= 21.0F; x += 0.1F) {
      for (float y = -1.0F; y <= 1.0F; y += 0.1F) {
        points.push_back(x, y, street(x, y) + over);
      }
    }
    group_of.assign(points.size(), 1);
  }
  static bool is_below(float x, float y) { return x > 18.9F && x < 21.1F && y > -1.1F && y < 1.1F; }

  PointBuffer points;
  std::vector<std::uint32_t> group_of;
  std::vector<EvidenceVerdict::Group> groups = {{}, {Cause::kWithInstance, 0.9F}};
};

GroundSamples samples_of(const FreeSpaceConfig& config, const PointBuffer& ground) {
  GroundSamples samples;
  GroundSampler(config).sample(ground, samples);
  return samples;
}

// Indices of the ground points that are removed with the box, all for this cause.
std::set<std::uint32_t> removed_with_box(MovedGround&& moved, const PointBuffer& ground,
                                         const GroundSamples& samples, Cause cause,
                                         const RemovedBox& box = RemovedBox()) {
  moved.add(box.points, box.group_of, box.groups);
  std::set<std::uint32_t> found;
  for (const EvidenceVerdict::GroundPoint& point : moved.find(ground, samples)) {
    CHECK(point.verdict.cause == cause);
    CHECK(found.insert(point.point).second);
  }
  return found;
}

// Indices of the ground points that are removed under a box, if no reference saw the ground.
std::set<std::uint32_t> ground_that_goes(const FreeSpaceConfig& config, const PointBuffer& ground) {
  return removed_with_box(MovedGround(config), ground, samples_of(config, ground),
                          Cause::kUnderInstance);
}

TEST_CASE("under a removed box, what rises above the street is removed, and the street stays") {
  FreeSpaceConfig config;
  PointBuffer ground = street_about(20.0F, 0.0F, 5.0F, kNothing);
  const auto street_size = static_cast<std::uint32_t>(ground.size());
  CHECK(ground_that_goes(config, ground).empty());

  const auto rise = static_cast<float>(config.footprint_rise);
  ground.push_back(20.25F, 0.15F, street(20.25F, 0.15F) + rise + 0.005F);
  ground.push_back(20.20F, 0.10F, street(20.20F, 0.10F));
  ground.push_back(19.65F, 0.75F, street(19.65F, 0.75F) + rise - 0.005F);
  // At equal height, but without a removed point above it.
  ground.push_back(24.15F, 0.15F, street(24.15F, 0.15F) + rise + 0.005F);
  CHECK(ground_that_goes(config, ground) == std::set<std::uint32_t>{street_size});

  // Without a limit for heights, all ground points below the box are removed.
  config.footprint_rise = 0.0;
  const std::set<std::uint32_t> all = ground_that_goes(config, ground);
  CHECK(all.count(street_size + 2) == 1);
  CHECK(all.count(street_size + 3) == 0);
  for (std::uint32_t i = 0; i < street_size; ++i) {
    const bool below = RemovedBox::is_below(ground.x[i], ground.y[i]);
    if (below) CHECK(all.count(i) == 1);
  }
}

TEST_CASE("an object on the ground may begin higher above it where beams are farther apart") {
  FreeSpaceConfig config;
  config.footprint_rise = 0.0;
  const PointBuffer ground = street_about(20.0F, 0.0F, 5.0F, kNothing);
  // At 20 m, beams 2 deg apart are 0.70 m apart, and beams 3 deg apart 1.05 m.
  for (const double gap : {0.0, 2.0, 3.0}) {
    MovedGround moved(config);
    SensorModel sensor = SensorModel::typical();
    sensor.elevation_gap_wide = gap;
    moved.adapt(sensor);
    const auto found = removed_with_box(std::move(moved), ground, samples_of(config, ground),
                                        Cause::kUnderInstance, RemovedBox(0.95F));
    CAPTURE(gap);
    CHECK(found.empty() == (gap < 2.5));
  }
}

// Result of a reference for a ground point at x.
using Reference = std::function<BeamResult(float x)>;

// For a sensor with this gap (deg) between two beams.
MovedGround moved_ground_of(double gap) {
  MovedGround moved{FreeSpaceConfig()};
  SensorModel sensor = SensorModel::typical();
  sensor.elevation_gap_wide = gap;
  moved.adapt(sensor);
  return moved;
}

// Indices of the ground points beside a removed box that are removed by the results of references.
// `gap`: deg, between two beams.
std::set<std::uint32_t> ground_seen_free(const PointBuffer& ground,
                                         const std::vector<Reference>& references,
                                         double gap = 0.1) {
  GroundSamples samples = samples_of(FreeSpaceConfig(), ground);
  for (const Reference& reference : references) {
    std::vector<BeamResult> seen;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      seen.push_back(reference(samples.points.x[i]));
    }
    samples.add(visibility_of(seen));
  }
  return removed_with_box(moved_ground_of(gap), ground, samples, Cause::kFreeSpace);
}

TEST_CASE("ground is removed if it is free in two references, however many hit it") {
  // Two voxels of 1.2 m beside the box, visited alternately, and one point far from both.
  PointBuffer ground;
  for (const float x : {22.1F, 22.2F, 22.3F, 23.1F, 23.2F, 23.3F, 22.4F, 22.5F, 30.0F}) {
    ground.push_back(x, 0.1F, street(x, 0.1F));
  }
  const std::set<std::uint32_t> near = {0, 1, 2, 6, 7}, far = {3, 4, 5, 8};
  std::set<std::uint32_t> all = near;
  all.insert(far.begin(), far.end());
  const Reference free = [](float) { return BeamResult::kFree; };
  const Reference hit = [](float) { return BeamResult::kHit; };
  CHECK(ground_seen_free(ground, {}).empty());
  CHECK(ground_seen_free(ground, {free}).empty());
  CHECK(ground_seen_free(ground, {free, free}) == all);
  CHECK(ground_seen_free(ground, {free, hit, hit, hit, hit, hit, hit, hit, free}) == all);
  // Where beams are far apart, one reference is sufficient without a hit.
  CHECK(ground_seen_free(ground, {free}, 2.0) == all);
  CHECK(ground_seen_free(ground, {free, hit}, 2.0).empty());
  CHECK(ground_seen_free(ground, {free, hit, free}, 2.0) == all);
  const Reference near_free = [](float x) {
    return x < 22.8F ? BeamResult::kFree : BeamResult::kUnknown;
  };
  const Reference far_free = [](float x) {
    return x < 22.8F ? BeamResult::kUnknown : BeamResult::kFree;
  };
  CHECK(ground_seen_free(ground, {near_free, near_free}) == near);
  CHECK(ground_seen_free(ground, {far_free, near_free, far_free}) == far);
}

TEST_CASE("a pavement that references hit stays under a removed person") {
  // Points of one voxel of 1.2 m, on a pavement between lower streets. A foot is in their run.
  PointBuffer ground;
  for (const float x : {4.9F, 5.1F, 5.3F, 5.5F}) ground.push_back(x, 0.3F, -1.65F);
  ground.push_back(5.4F, 0.3F, -1.60F);
  const std::set<std::uint32_t> all = {0, 1, 2, 3, 4}, foot = {4};
  for (float x = 3.0F; x < 8.0F; x += 0.25F) {
    for (const float y : {-1.5F, -1.3F, 1.5F, 1.7F}) ground.push_back(x, y, -1.7F);
  }
  RemovedBox person;
  for (std::size_t i = 0; i < person.points.size(); ++i) {
    person.points.x[i] = 5.2F;
    person.points.y[i] = 0.3F;
    person.points.z[i] = -1.4F;
  }
  const auto removed = [&](const std::vector<BeamResult>& references, double gap) {
    GroundSamples samples = samples_of(FreeSpaceConfig(), ground);
    for (const BeamResult result : references) {
      samples.add(visibility_of(std::vector<BeamResult>(samples.size(), result)));
    }
    return removed_with_box(moved_ground_of(gap), ground, samples, Cause::kUnderInstance, person);
  };
  constexpr BeamResult kHit = BeamResult::kHit;
  CHECK(removed({}, 0.6) == all);
  CHECK(removed({kHit, kHit}, 0.6) == all);
  CHECK(removed({kHit, kHit, kHit}, 0.6) == foot);
  CHECK(removed({kHit, kHit, kHit, BeamResult::kFree}, 0.6) == all);
  // At 5 m, beams 2 deg apart are 0.17 m apart: a hit may lie beside the sample.
  CHECK(removed({kHit, kHit, kHit}, 2.0) == all);
}

TEST_CASE("where the ground around is not known, all of it is removed from under a removed box") {
  FreeSpaceConfig config;
  // Ground points exist below the box only.
  const PointBuffer ground =
      street_about(20.0F, 0.0F, 5.0F, [](float x, float y) { return !RemovedBox::is_below(x, y); });
  CHECK(ground_that_goes(config, ground).size() == ground.size());
}

}  // namespace
}  // namespace dynains::test
