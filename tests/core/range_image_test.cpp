// Range images and the beams that are tested against them, compared with slow and simple ones.
#include "dynains/evidence/range_image.hpp"

#include "dynains/evidence/visibility.hpp"
#include "support/catch.hpp"
#include "support/points.hpp"
#include "support/scene.hpp"

namespace dynains::test {
namespace {

constexpr double kDegrees = 180.0 / M_PI;

RangeImageGrid small_grid() {
  SensorModel sensor = SensorModel::typical();
  sensor.azimuth_step = 0.5;
  return RangeImageGrid::for_sensor(sensor);
}

std::int32_t cell_of(const RangeImageGrid& grid, float x, float y, float z) {
  std::int32_t cells[detail::kPackWidth];
  const detail::Float8 px(x), py(y), pz(z);
  ImageLocator(grid)
      .locate<detail::BaselinePacks>(px, py, pz, sqrt((px * px + py * py) + pz * pz))
      .cell.store(cells);
  return cells[0];
}

TEST_CASE("columns follow the azimuth within 1e-4 rad, rows the elevation within 0.2 deg") {
  for (double azimuth = -179.9; azimuth < 180.0; azimuth += 0.37) {
    float values[detail::kPackWidth];
    const double angle = azimuth / kDegrees;
    coarse_azimuth(detail::Float8(static_cast<float>(7.0 * std::cos(angle))),
                   detail::Float8(static_cast<float>(7.0 * std::sin(angle))))
        .store(values);
    REQUIRE(std::abs(values[0] - angle) < 1e-4);
  }
  double before = -10.0;
  for (double elevation = -90.0; elevation <= 90.0; elevation += 0.1) {
    const double level = RangeImageGrid::level(static_cast<float>(std::sin(elevation / kDegrees)));
    REQUIRE(level > before);
    if (std::abs(elevation) < 50.0) REQUIRE(std::abs(level * kDegrees - elevation) < 0.2);
    before = level;
  }
}

TEST_CASE("cells of an image are derived from the beams of a sensor, within limits") {
  SensorModel sensor;
  sensor.azimuth_step = 0.3;
  sensor.elevation_gap = 0.5;
  sensor.elevation_gap_wide = 1.0;
  sensor.elevation_min = -20.0;
  sensor.elevation_max = 10.0;
  const RangeImageGrid grid = RangeImageGrid::for_sensor(sensor);
  CHECK(grid.columns == 1000);                    // 0.36 deg
  CHECK(std::abs(grid.rows - 34.0 / 0.3) < 2.0);  // 2 deg more than the beams on each side
  CHECK(std::abs(grid.lowest * kDegrees + 22.0) < 0.2);
  CHECK(grid.hole_rows == 4);  // 1.2 deg
  sensor.azimuth_step = 0.05;
  CHECK(RangeImageGrid::for_sensor(sensor).columns == 1800);
  sensor.azimuth_step = 2.0;
  CHECK(RangeImageGrid::for_sensor(sensor).columns == 450);
  sensor.elevation_gap = 0.1;
  CHECK(std::abs(RangeImageGrid::for_sensor(sensor).rows - 34.0 / 0.2) < 3.0);
  sensor.elevation_gap = 3.0;
  CHECK(std::abs(RangeImageGrid::for_sensor(sensor).rows - 34.0 / 0.4) < 2.0);
  CHECK(RangeImageGrid::for_sensor(sensor, 8).columns == 900);
}

TEST_CASE("a direction outside the image has cell 0") {
  const RangeImageGrid grid = small_grid();
  CHECK(cell_of(grid, 0.0F, 0.0F, 0.0F) == 0);
  CHECK(cell_of(grid, 1.0F, 0.0F, 1.0F) == 0);
  CHECK(cell_of(grid, 1.0F, 0.0F, -1.0F) == 0);
  CHECK(cell_of(grid, 1.0F, 0.0F, 0.0F) > 0);
  // Straight backwards, on both sides of the seam.
  const auto stride = static_cast<std::int32_t>(grid.stride());
  const auto border = static_cast<std::int32_t>(detail::kPackWidth);
  CHECK(cell_of(grid, -1.0F, 1e-9F, 0.0F) % stride == border + grid.columns - 1);
  CHECK(cell_of(grid, -1.0F, -1e-9F, 0.0F) % stride == border);
}

// In centimetres. Even numbers are static points, odd ones moving points.
int marked_range(float x, float y, float z, bool moving) {
  const float range = std::sqrt((x * x + y * y) + z * z);
  return (static_cast<int>(range * 100.0F) & ~1) | (moving ? 1 : 0);
}
bool is_moving(int range) { return range % 2 != 0; }

// The image by its definition: nearest return per cell, gaps between two returns of a column
// closed, nearest of the 3x3 cells around. `moving`: by point.
class ReferenceImage {
 public:
  ReferenceImage(const RangeImageGrid& grid, const PointBuffer& points,
                 const std::vector<std::uint8_t>& moving)
      : grid_(grid), cells_(grid.cell_count(), kNothing) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const std::int32_t cell = cell_of(grid, points.x[i], points.y[i], points.z[i]);
      if (cell == 0) continue;
      int& nearest = cells_[static_cast<std::size_t>(cell)];
      nearest =
          std::min(nearest, marked_range(points.x[i], points.y[i], points.z[i], moving[i] != 0));
    }
    const std::vector<int> returns = cells_;
    for (int column = 0; column < grid.columns; ++column) {
      for (int low = 0; low < grid.rows; ++low) {
        for (int high = low + 2; high < grid.rows; ++high) {
          const int a = returns[at(low, column)], b = returns[at(high, column)];
          bool empty = high - low - 1 <= grid.hole_rows && a != kNothing && b != kNothing;
          for (int row = low + 1; row < high; ++row) {
            empty = empty && returns[at(row, column)] == kNothing;
          }
          for (int row = low + 1; empty && row < high; ++row) {
            cells_[at(row, column)] = std::min(a, b);
          }
        }
      }
    }
  }

  int nearest(int row, int column) const {
    int result = kNothing;
    for (const int value : about(row, column)) {
      if (is_moving(value)) result = std::min(result, value);
    }
    return result == kNothing ? cells_[at(row, column)] : result;
  }
  int around(int row, int column) const {
    int least = kNothing;
    int count = 0;
    for (const int value : about(row, column)) {
      if (!is_static_return(value)) continue;
      least = std::min(least, value);
      ++count;
    }
    const int here = cells_[at(row, column)];
    if (count < 2 || !is_crossed(row, column)) {
      return is_moving(here) ? here : RangeImage::kUnknown;
    }
    return is_moving(here) ? std::min(least, here) : least;
  }
  std::size_t at(int row, int column) const {
    return static_cast<std::size_t>(row) * grid_.stride() + detail::kPackWidth +
           static_cast<std::size_t>(column);
  }

 private:
  static constexpr int kNothing = RangeImage::kNothing;

  static bool is_static_return(int value) { return value != kNothing && !is_moving(value); }

  // The cell, or both cells beside it, have a return.
  bool is_crossed(int row, int column) const {
    const auto returns = [&](int c) {
      return cells_[at(row, (c + grid_.columns) % grid_.columns)] != kNothing;
    };
    return returns(column) || (returns(column - 1) && returns(column + 1));
  }

  // The 3x3 cells.
  std::vector<int> about(int row, int column) const {
    std::vector<int> values;
    for (int r = std::max(0, row - 1); r <= std::min(grid_.rows - 1, row + 1); ++r) {
      for (int c = column - 1; c <= column + 1; ++c) {
        values.push_back(cells_[at(r, (c + grid_.columns) % grid_.columns)]);
      }
    }
    return values;
  }

  const RangeImageGrid& grid_;
  std::vector<int> cells_;
};

// Objects nearer than reach / (k - 1/2) cells (in rad) protect k cells in every direction, k >= 2.
int around_with_objects(const RangeImageGrid& grid, const ReferenceImage& all,
                        const std::vector<int>& objects, float reach, int row, int column) {
  int result = all.around(row, column);
  if (result == RangeImage::kUnknown) return result;
  for (int k = 2; k <= 4; ++k) {
    const float limit = reach * grid.columns_per_radian / (static_cast<float>(k) - 0.5F);
    for (int r = std::max(0, row - k); r <= std::min(grid.rows - 1, row + k); ++r) {
      for (int c = column - k; c <= column + k; ++c) {
        const int value = objects[all.at(r, (c + grid.columns) % grid.columns)];
        if (value >= static_cast<int>(std::min(limit, 320.0F) * 100.0F)) continue;
        result = std::min(result, value);
      }
    }
  }
  return result;
}

void build_objects(RangeImage& image, const RangeImageGrid& grid, PointsView objects,
                   RangeImage::Scratch& scratch) {
  const RangeImage::Scan scan = {{}, objects, {}, {}};
  image.build(grid, {&scan, 1}, 0.0F, scratch);
}

TEST_CASE("an image equals its definition: near objects protect more cells around them") {
  Random random(6);
  SensorModel sensor = SensorModel::typical();
  sensor.elevation_min = -10.0;
  RangeImage image;
  RangeImage::Scratch scratch;
  // Steps with other numbers of columns in the last group, and numbers of points.
  for (const auto& [step, count] : {std::pair(0.25, 6000), {0.3, 3}, {0.35, 30000}, {0.5, 6000}}) {
    sensor.azimuth_step = step;
    const RangeImageGrid grid = RangeImageGrid::for_sensor(sensor);
    REQUIRE(grid.hole_rows >= 2);
    PointBuffer points[3];  // ground, objects, both
    std::vector<std::uint8_t> moving_objects, moving;
    for (int i = 0; i < count; ++i) {
      const bool object = i % 3 == 0;
      const double azimuth = random.uniform(-M_PI, M_PI);
      const double elevation = random.uniform(-14.0, 8.0) / kDegrees;
      const double range = object ? random.uniform(0.5, 40.0) : random.uniform(3.0, 300.0);
      const Eigen::Vector3d point = range * ray_of(elevation, azimuth);
      add_point(points[object ? 1 : 0], point);
      add_point(points[2], point);
      moving.push_back(object && random.index(4) == 0 ? 1 : 0);
      if (object) moving_objects.push_back(moving.back());
    }
    const ReferenceImage all(grid, points[2], moving);
    std::vector<int> objects(grid.cell_count(), RangeImage::kNothing);
    for (std::size_t i = 0; i < points[1].size(); ++i) {
      const float x = points[1].x[i], y = points[1].y[i], z = points[1].z[i];
      const auto cell = static_cast<std::size_t>(cell_of(grid, x, y, z));
      objects[cell] = std::min(objects[cell], marked_range(x, y, z, moving_objects[i] != 0));
    }
    for (int& range : objects) range = is_moving(range) ? RangeImage::kNothing : range;
    for (const float reach : {0.0F, 0.05F, 0.4F, 1.0F}) {
      const RangeImage::Scan scan = {points[0], points[1], moving_objects, {}};
      image.build(grid, {&scan, 1}, reach, scratch);
      for (int row = 0; row < grid.rows; ++row) {
        for (int column = 0; column < grid.columns; ++column) {
          const RangeImage::Cell cell = image[all.at(row, column)];
          const int expected = around_with_objects(grid, all, objects, reach, row, column);
          if (cell.nearest != all.nearest(row, column) || cell.around != expected) {
            FAIL("step " << step << " reach " << reach << " row " << row << " column " << column
                         << ": " << cell.around << " instead of " << expected);
          }
        }
      }
    }
  }
}

// A scan with beams 0.8 deg apart in the middle of the cells of `grid`, which end at `range` m.
PointBuffer coarse_wall(const RangeImageGrid& grid, double range) {
  PointBuffer wall;
  for (int column = -5; column < 5; ++column) {
    for (int row = 0; row < grid.rows; ++row) {
      const double azimuth = (column + 0.5) / static_cast<double>(grid.columns_per_radian);
      const double elevation =
          static_cast<double>(grid.lowest) + (row + 0.5) / static_cast<double>(grid.rows_per_level);
      add_point(wall, range * ray_of(elevation, azimuth));
    }
  }
  return wall;
}

TEST_CASE("a sample is free only if a beam passes within 5 cm and 4 mm per metre") {
  SensorModel sensor = SensorModel::typical();
  sensor.azimuth_step = 2.0;
  const RangeImageGrid grid = RangeImageGrid::for_sensor(sensor);
  RangeImage image;
  RangeImage::Scratch scratch;
  build_objects(image, grid, coarse_wall(grid, 60.0), scratch);
  const double azimuth = 0.5 / static_cast<double>(grid.columns_per_radian);  // of a beam
  PointBuffer samples;
  const double distances[] = {0.0, 0.10, 0.15, 0.18, 0.19, -0.15, -0.19};  // m, 30 m away: 17 cm
  for (const double distance : distances) {
    add_point(samples, 30.0 * ray_of(0.0, azimuth + distance / 30.0));
  }
  const std::size_t count = samples.size();
  samples.resize(count + detail::kPackWidth);
  detail::Visibility visibility;
  // Measured from here or from a place aside: a beam on the side of that place crosses what is free
  // anyway.
  for (const double side : {0.0, 1.0, -1.0}) {
    const Eigen::Vector3d viewpoint =
        side == 0.0 ? Eigen::Vector3d(Eigen::Vector3d::Zero())
                    : Eigen::Vector3d(30.0 * ray_of(0.0, azimuth) +
                                      30.0 * side * ray_of(0.0, azimuth + 0.5 * M_PI));
    detail::test_visibility(image, Eigen::Isometry3d::Identity(), samples, count, 0.25F, 0.01F,
                            visibility, viewpoint.cast<float>());
    for (std::size_t i = 0; i < count; ++i) {
      INFO("sample " << i << " side " << side);
      const bool is_before = -side * distances[i] > 0.25 * 0.17;
      CHECK((visibility.bits(i, i + 1).free == 1) == (std::abs(distances[i]) < 0.17 && !is_before));
      CHECK(visibility.bits(i, i + 1).hit == 0);
    }
  }
  // Samples of objects so thin that a beam must pass within 0.12 m.
  const std::vector<float> reach(count + detail::kPackWidth, 0.12F);
  visibility.clear(count);
  detail::add_visibility(image, Eigen::Isometry3d::Identity(), samples, count, 0.25F, 0.01F,
                         visibility, Eigen::Vector3f::Zero(), reach.data());
  for (std::size_t i = 0; i < count; ++i) {
    CHECK((visibility.bits(i, i + 1).free == 1) == (std::abs(distances[i]) < 0.12));
  }
  detail::test_visibility(image, Eigen::Isometry3d::Identity(), samples, count, 0.25F, 0.01F,
                          visibility);
  // Another view of the same reference adds what it sees; its hits count more.
  build_objects(image, grid, coarse_wall(grid, 30.0), scratch);
  detail::add_visibility(image, Eigen::Isometry3d::Identity(), samples, count, 0.25F, 0.01F,
                         visibility);
  REQUIRE(visibility.count(0, count).free > 0);
  visibility.settle(count);
  CHECK(visibility.count(0, count).free == 0);
  CHECK(visibility.count(0, count).hit == count);
}

TEST_CASE("the beam of a cell is the direction of its nearest return") {
  const RangeImageGrid grid = small_grid();
  RangeImage image;
  RangeImage::Scratch scratch;
  Random random(11);
  for (int round = 0; round < 200; ++round) {
    // Two returns in one cell; the other cells have none.
    const auto column = static_cast<double>(100 + random.index(200));
    const auto row = static_cast<double>(20 + random.index(20));
    PointBuffer points;
    double places[2][2];
    for (auto& place : places) {
      place[0] = random.uniform(0.02, 0.98);
      place[1] = random.uniform(0.02, 0.98);
      const double azimuth =
          (column + place[0]) / static_cast<double>(grid.columns_per_radian) - M_PI;
      const double level = static_cast<double>(grid.lowest) +
                           (row + place[1]) / static_cast<double>(grid.rows_per_level);
      double sine = level;  // inverse of level() by bisection
      for (double low = -1.0, high = 1.0; high - low > 1e-12;) {
        sine = 0.5 * (low + high);
        (RangeImageGrid::level(static_cast<float>(sine)) < static_cast<float>(level) ? low : high) =
            sine;
      }
      add_point(points, (points.size() == 0 ? 20.0 : 10.0) * ray_of(std::asin(sine), azimuth));
    }
    build_objects(image, grid, points, scratch);
    const std::size_t cell =
        grid.cell(static_cast<std::int32_t>(row), static_cast<std::int32_t>(column));
    REQUIRE(image[cell].nearest < 1002);
    const RangeImage::Beam beam = image.beams()[cell];
    CHECK(std::abs((beam >> 8) - 256.0 * places[1][0]) < 8.0);
    CHECK(std::abs((beam & 255) - 256.0 * places[1][1]) < 8.0);
    CHECK(image.beams()[cell + 2] == RangeImage::kCentre);
  }
}

TEST_CASE("bits of visibility are counted over any range") {
  Random random(9);
  constexpr std::size_t kCount = 400;
  detail::Visibility visibility;
  visibility.resize(kCount);
  for (std::size_t first = 0; first < kCount; first += detail::kPackWidth) {
    float values[detail::kPackWidth];
    for (float& value : values) value = random.uniform_float(-1.0, 1.0);
    const detail::Float8 random_values = detail::Float8::load(values);
    const detail::Visibility::Bytes bytes = visibility.bytes();
    bytes.free[first / 8] =
        static_cast<std::uint8_t>((random_values > detail::Float8(0.5F)).bits());
    bytes.hit[first / 8] =
        static_cast<std::uint8_t>((random_values < detail::Float8(-0.3F)).bits());
  }
  for (int round = 0; round < 2000; ++round) {
    const std::size_t begin = random.index(kCount);
    const std::size_t end = begin + random.index(std::min<std::size_t>(kCount - begin, 130) + 1);
    std::uint64_t free = 0, hit = 0;
    for (std::size_t i = begin; i < end; ++i) {
      free += visibility.bits(i, i + 1).free;
      hit += visibility.bits(i, i + 1).hit;
    }
    const detail::Visibility::Count counted = visibility.count(begin, end);
    REQUIRE(counted.free == free);
    REQUIRE(counted.hit == hit);
  }
}

TEST_CASE(
    "a sample is free where all beams around it go farther, hit where one ends, else unknown") {
  // A wall 20 m ahead, seen by beams 0.2 deg apart in both directions.
  const RangeImageGrid grid = RangeImageGrid::for_sensor(SensorModel::typical());
  PointBuffer wall;
  for (double azimuth = -20.0; azimuth <= 20.0; azimuth += 0.2) {
    for (double elevation = -10.0; elevation <= 3.0; elevation += 0.2) {
      const double y = 20.0 * std::tan(azimuth / kDegrees);
      const double z = std::hypot(20.0, y) * std::tan(elevation / kDegrees);
      add_point(wall, Eigen::Vector3d(20.0, y, z));
    }
  }
  RangeImage image;
  RangeImage::Scratch scratch;
  build_objects(image, grid, wall, scratch);

  // The margin at 20 m is 0.25 + 0.01 * 20 = 0.45 m. Samples are in the frame of a sensor 5 m
  // behind this one.
  PointBuffer samples;
  for (const float x : {24.4F, 24.6F, 25.0F, 25.4F, 25.6F, 15.0F}) samples.push_back(x, 0.0F, 0.0F);
  samples.push_back(5.0F, 0.0F, 20.0F);  // above all beams
  samples.push_back(0.0F, 20.0F, 0.0F);  // beside all beams
  const std::size_t count = samples.size();
  samples.resize(count + detail::kPackWidth);
  Eigen::Isometry3d T_reference_sample = Eigen::Isometry3d::Identity();
  T_reference_sample.translation().x() = -5.0;
  detail::Visibility visibility;
  detail::test_visibility(image, T_reference_sample, samples, count, 0.25F, 0.01F, visibility);
  const std::vector<std::uint64_t> free = {1, 0, 0, 0, 0, 1, 0, 0};
  const std::vector<std::uint64_t> hit = {0, 1, 1, 1, 0, 0, 0, 0};
  for (std::size_t i = 0; i < count; ++i) {
    INFO("sample " << i);
    CHECK(visibility.bits(i, i + 1).free == free[i]);
    CHECK(visibility.bits(i, i + 1).hit == hit[i]);
  }
}

}  // namespace
}  // namespace dynains::test
