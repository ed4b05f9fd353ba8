// Static points of a session: the first one of each voxel, against plain double precision.
#include "dynains/city/session_writer.hpp"
#include "support/catch.hpp"
#include "support/random.hpp"

using namespace dynains;
using test::Random;

namespace {

struct Scan {
  PointBuffer points;
  std::vector<PointLabel> verdicts;
  std::vector<std::uint32_t> labels;
  Eigen::Isometry3d T_world_sensor = Eigen::Isometry3d::Identity();
};

/// Points up to a little beyond `range`, many of them at faces of voxels or beside the one before.
/// `far`: m, coordinates of the sensor.
Scan random_scan(Random& random, double range, double voxel, double far) {
  Scan scan;
  const auto coordinate = [&](double most) { return random.uniform(-most, most); };
  const Eigen::Vector3d axis(coordinate(0.1), coordinate(0.1), 1.0);
  scan.T_world_sensor.linear() =
      Eigen::AngleAxisd(coordinate(3.0), axis.normalized()).toRotationMatrix();
  scan.T_world_sensor.translation() << coordinate(far), coordinate(far), coordinate(0.01 * far);
  Eigen::Vector3d last = Eigen::Vector3d::Zero();
  for (int i = 0; i < 3001; ++i) {
    if (i % 3 != 0) {
      last += Eigen::Vector3d(coordinate(0.01), coordinate(0.01), 0.0);
    } else if (i % 2 == 0) {
      last = voxel * Eigen::Vector3d(std::round(coordinate(20)), std::round(coordinate(20)), 0.0);
    } else {
      last = {coordinate(1.0) * coordinate(range), coordinate(range), coordinate(2.0)};
    }
    const bool is_invalid = random.index(10) == 0;
    scan.points.push_back(is_invalid ? std::nanf("") : static_cast<float>(last.x()),
                          static_cast<float>(last.y()), static_cast<float>(last.z()));
    constexpr PointLabel kLabels[] = {PointLabel::kStatic, PointLabel::kGround,
                                      PointLabel::kDynamic};
    scan.verdicts.push_back(is_invalid ? PointLabel::kInvalid : kLabels[random.index(3)]);
    scan.labels.push_back(static_cast<std::uint32_t>(random.index(100)));
  }
  return scan;
}

/// The rule of SessionPoints in double precision.
class Oracle {
 public:
  Oracle(const SessionGrid& grid, double range) : grid_(grid), range_(range) {}

  void add(const Scan& scan, std::uint32_t number) {
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      if (!is_static(scan.verdicts[i])) continue;
      const Eigen::Vector3d local(static_cast<double>(scan.points.x[i]),
                                  static_cast<double>(scan.points.y[i]),
                                  static_cast<double>(scan.points.z[i]));
      if (local.squaredNorm() > range_ * range_) continue;
      const Eigen::Vector3d world = scan.T_world_sensor * local;
      const TileIndex index = {static_cast<std::int64_t>(std::floor(world.x() / grid_.tile)),
                               static_cast<std::int64_t>(std::floor(world.y() / grid_.tile))};
      const Eigen::Vector3f in_tile = (world - tile_corner(grid_, index)).cast<float>();
      const SessionPoint point = {
          in_tile.x(), in_tile.y(),    in_tile.z(),
          number,      scan.labels[i], scan.verdicts[i] == PointLabel::kGround ? 1U : 0U};
      auto& [points, voxels] = tiles_[index];
      const std::size_t before = voxels.size();
      if (voxels.insert(session_voxel(grid_, point)) == before) points.push_back(point);
    }
  }

  const std::vector<SessionPoint>& points(const TileIndex& tile) { return tiles_[tile].first; }
  std::size_t tile_count() const { return tiles_.size(); }

 private:
  SessionGrid grid_;
  double range_;  // m
  std::map<TileIndex, std::pair<std::vector<SessionPoint>, VoxelHashTable<>>> tiles_;
};

bool is_equal(const SessionPoint& a, const SessionPoint& b) {
  return a.x == b.x && a.y == b.y && a.z == b.z && a.scan == b.scan && a.label == b.label &&
         a.is_ground == b.is_ground;
}

}  // namespace

TEST_CASE("points of a session: the first of each voxel, whatever floats round to") {
  const auto [voxel, tile, range, far] =
      GENERATE(std::array{0.2, 50.0, 60.0, 30.0}, std::array{0.2, 50.0, 60.0, 3e5},
               std::array{0.3, 37.7, 60.0, 1e3}, std::array{0.02, 10.0, 5.0, 30.0},
               std::array{5.0, 500.0, 300.0, 1e5}, std::array{0.02, 10.0, 300.0, 1e6});
  CAPTURE(voxel, tile, range, far);
  SessionGrid grid;
  grid.map_voxel = voxel;
  grid.tile = tile;
  ByteStore store(std::filesystem::temp_directory_path());
  SessionPoints session(grid, range, store);
  Oracle oracle(grid, range);
  Random random(7);
  for (std::uint32_t number = 0; number < 4; ++number) {
    const Scan scan = random_scan(random, range, voxel, far);
    session.add(scan.points, scan.verdicts, scan.labels, scan.T_world_sensor, number);
    // The same points again change nothing.
    session.add(scan.points, scan.verdicts, scan.labels, scan.T_world_sensor, number);
    oracle.add(scan, number);
  }
  std::size_t tiles = 0, points = 0;
  session.for_each_tile([&](const TileIndex& index, const std::vector<SessionPoint>& found) {
    ++tiles;
    points += found.size();
    const std::vector<SessionPoint>& expected = oracle.points(index);
    REQUIRE(found.size() == expected.size());
    for (std::size_t i = 0; i < found.size(); ++i) REQUIRE(is_equal(found[i], expected[i]));
  });
  CHECK(tiles == oracle.tile_count());
  CHECK(points == session.size());
}
