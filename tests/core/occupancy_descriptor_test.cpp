#include "dynains/descriptors/occupancy_descriptor.hpp"

#include "polar_test_points.hpp"
#include "support/catch.hpp"
#include "support/random.hpp"

namespace dynains::test {
namespace {

// Direct implementation of Eq. 5-11: sets of points, double precision, the smallest arc by sorting.

struct ReferenceDescriptor {
  std::size_t radial_cells = 0;              // N_r
  std::size_t azimuth_cells = 0;             // N_theta
  std::vector<std::vector<double>> heights;  // H_k of each scan, then of scans 0 to k together
  double similarity = 0.0;                   // d
};

/// Empty if a point or an extent is so near to a border that float and double may differ, or if two
/// gaps between the points have almost equal widths.
std::optional<ReferenceDescriptor> describe(const OccupancyDescriptor::Config& config,
                                            const ClusterView& cluster) {
  constexpr double kMargin = 1e-3;
  const double s_r = config.cell_range;
  const double s_theta = config.cell_azimuth * kRadiansPerDegree;
  const PolarBuffer all = gathered(cluster.window, cluster.ranges);
  const PolarView points = all.view();
  const double r_min = *std::min_element(points.range.begin(), points.range.end());
  const double r_max = *std::max_element(points.range.begin(), points.range.end());
  const double z_min = *std::min_element(points.z.begin(), points.z.end());

  // The smallest arc that contains all points begins after the widest gap between neighbours.
  std::vector<double> sorted(points.azimuth.begin(), points.azimuth.end());
  std::sort(sorted.begin(), sorted.end());
  double theta_min = sorted.front();
  double widest = sorted.front() + 2.0 * M_PI - sorted.back();
  double second = 0.0;
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    const double gap = sorted[i] - sorted[i - 1];
    if (gap > widest) {
      second = widest;
      widest = gap;
      theta_min = sorted[i];
    } else {
      second = std::max(second, gap);
    }
  }
  constexpr double kClear = 3.0 * 2.0 * M_PI / 1024.0;
  if (widest < M_PI && widest - second < kClear) return {};
  const double arc = 2.0 * M_PI - widest;

  ReferenceDescriptor result;
  const auto cells = [&](double extent) {
    return static_cast<std::size_t>(std::max(1.0, std::ceil(extent)));
  };
  if (points.size() > 1 &&
      (off_integer((r_max - r_min) / s_r) < kMargin || off_integer(arc / s_theta) < kMargin)) {
    return {};
  }
  result.radial_cells = cells((r_max - r_min) / s_r);
  result.azimuth_cells = cells(arc / s_theta);
  const std::size_t count = result.radial_cells * result.azimuth_cells;
  const std::size_t scans = cluster.scan_count();
  result.heights.assign(2 * scans, std::vector<double>(count, 0.0));
  for (std::size_t k = 0; k < scans; ++k) {
    const PolarBuffer observed = gathered(cluster.window, cluster.scan(k));
    const PolarView scan = observed.view();
    for (std::size_t p = 0; p < scan.size(); ++p) {
      double offset = scan.azimuth[p] - theta_min;
      if (offset < 0.0) offset += 2.0 * M_PI;
      const double i = (scan.range[p] - r_min) / s_r;
      const double j = offset / s_theta;
      if ((i > 0.0 && off_integer(i) < kMargin) || (j > 0.0 && off_integer(j) < kMargin)) return {};
      const std::size_t cell =
          static_cast<std::size_t>(i) * result.azimuth_cells + static_cast<std::size_t>(j);
      const auto raise = [&](std::size_t set) {
        double& height = result.heights[set][cell];
        height = std::max(height, scan.z[p] - z_min);
      };
      raise(k);
      for (std::size_t later = k; later < scans; ++later) raise(scans + later);
    }
  }
  double dot = 0.0, aa = 0.0, bb = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    const double a = result.heights[0][i];
    const double b = result.heights[scans - 1][i];
    dot += a * b;
    aa += a * a;
    bb += b * b;
  }
  result.similarity = dot / std::sqrt(aa * bb);
  return result;
}

// A cluster with its own window. Scans are added oldest first. The points are in ranges of 1, 2, 3
// and so on up to 19, with points of another cluster in between.
class Cluster {
 public:
  using Scan = std::vector<std::array<double, 3>>;  // range (m), azimuth (deg), z (m)

  Cluster(std::initializer_list<Scan> scans) {
    for (const Scan& scan : scans) add_scan(scan);
  }
  void add_scan(const Scan& scan) {
    for (const auto& [range, azimuth, z] : scan) {
      if (left_ == 0) begin_range();
      add(window_, range, azimuth, z);
      ++ranges_.back().end;
      --left_;
    }
    first_range_.push_back(static_cast<std::uint32_t>(ranges_.size()));
    left_ = 0;
  }
  ClusterView view() const { return {window_.view(), ranges_, first_range_}; }

 private:
  void begin_range() {
    add(window_, 99.0, -123.0, -40.0);
    const auto begin = static_cast<std::uint32_t>(window_.size());
    ranges_.push_back({begin, begin});
    length_ = length_ % 19 + 1;
    left_ = length_;
  }

  PolarBuffer window_;
  std::vector<PointRange> ranges_;
  std::vector<std::uint32_t> first_range_ = {0};
  int length_ = 0;
  int left_ = 0;  // points until the range ends
};

OccupancyDescriptor::Config make(double cell_range, double cell_azimuth, double tau_s = 0.6) {
  OccupancyDescriptor::Config config;
  config.cell_range = cell_range;
  config.cell_azimuth = cell_azimuth;
  config.tau_s = tau_s;
  return config;
}

OccupancyDescriptor described(const OccupancyDescriptor::Config& config, const Cluster& cluster) {
  OccupancyDescriptor descriptor(config);
  descriptor.describe(cluster.view());
  descriptor.describe_rest();
  return descriptor;
}

void check_heights(Span<const float> heights, const std::vector<double>& expected) {
  REQUIRE(heights.size() == expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    INFO("cell " << i);
    CHECK(heights[i] == Approx(expected[i]).margin(1e-6));
  }
}

TEST_CASE("Eq. 5-12 of a cluster worked by hand") {
  // s_r = 0.5 m, s_theta = 10 deg. All points: r in [10, 10.6], theta in [0, 12] deg, z from -1.
  //   N_r = ceil(0.6 / 0.5) = 2, N_theta = ceil(12 / 10) = 2                        (Eq. 6, 7)
  // Oldest: (10.0,  0) z = -1.0 -> cell (1,1), h = 0.0    (10.6, 12) z = 0.5 -> (2,2), h = 1.5
  // Newest: (10.0,  0) z =  0.0 -> cell (1,1), h = 1.0    (10.6, 12) z = 1.0 -> (2,2), h = 2.0
  //   h_old = (0, 0, 0, 1.5), h_new = (1, 0, 0, 2)                                  (Eq. 8-10)
  //   d = 1.5 * 2 / (1.5 * sqrt(1 + 4)) = 2 / sqrt(5) = 0.894427                    (Eq. 11)
  const Cluster cluster = {{{10.0, 0.0, -1.0}, {10.6, 12.0, 0.5}},
                           {{10.0, 0.0, 0.0}, {10.6, 12.0, 1.0}}};
  const OccupancyDescriptor descriptor = described(make(0.5, 10.0), cluster);
  CHECK(descriptor.radial_cells() == 2);
  CHECK(descriptor.azimuth_cells() == 2);
  check_heights(descriptor.heights(0), {0.0, 0.0, 0.0, 1.5});
  check_heights(descriptor.heights(1), {1.0, 0.0, 0.0, 2.0});
  check_heights(descriptor.cluster_heights(0), {0.0, 0.0, 0.0, 1.5});
  check_heights(descriptor.cluster_heights(1), {1.0, 0.0, 0.0, 2.0});
  CHECK(descriptor.similarity() == Approx(0.894427).epsilon(1e-6));
  CHECK_FALSE(descriptor.proposes_dynamic());

  // Eq. 12 on both sides of tau_s.
  CHECK_FALSE(described(make(0.5, 10.0, 0.8944), cluster).proposes_dynamic());
  CHECK(described(make(0.5, 10.0, 0.8945), cluster).proposes_dynamic());
}

TEST_CASE("a similarity of exactly tau_s is no proposal") {
  // h_old = (3, 0, 4), h_new = (3, 0, 0) over a lowest point of its own cell: d = 9 / (5 * 3) =
  // 0.6.
  const auto make_cluster = [](double z) {
    return Cluster({{{10.0, 0.0, 3.0}, {10.6, 0.0, 0.0}, {11.2, 0.0, z}}, {{10.0, 0.0, 3.0}}});
  };
  CHECK(described(make(0.5, 10.0), make_cluster(4.0)).similarity() == 0.6);
  CHECK_FALSE(described(make(0.5, 10.0), make_cluster(4.0)).proposes_dynamic());
  CHECK(described(make(0.5, 10.0), make_cluster(4.001)).proposes_dynamic());
}

TEST_CASE("the low share of tall objects has no height") {
  // z from -1 to `top`: over 1 m, the lowest 20 % do not count.
  const auto cluster = [](double top) {
    const double low = -1.0 + 0.19 * (top + 1.0), high = -1.0 + 0.21 * (top + 1.0);
    return Cluster({{{10.0, 0.0, -1.0}, {10.6, 0.0, low}, {11.2, 0.0, high}}, {{11.7, 0.0, top}}});
  };
  OccupancyDescriptor::Config config = make(0.5, 10.0);
  config.ignored_low = 0.2;
  check_heights(described(config, cluster(0.01)).heights(0), {0.0, 0.0, 0.21 * 1.01, 0.0});
  check_heights(described(config, cluster(-0.01)).heights(0), {0.0, 0.19 * 0.99, 0.21 * 0.99, 0.0});
  config.ignored_low = 0.0;
  check_heights(described(config, cluster(0.01)).heights(0), {0.0, 0.19 * 1.01, 0.21 * 1.01, 0.0});
}

TEST_CASE(
    "bounds of the ends leave out observations between them, and the belief has its own grid") {
  // No observation in the oldest scan.
  const Cluster cluster = {
      {}, {{10.0, 0.0, 0.0}, {10.9, 0.0, 1.0}}, {{5.0, 90.0, -3.0}}, {{10.2, 4.0, 2.0}}};
  OccupancyDescriptor::Config config = make(0.5, 10.0);
  CHECK_FALSE(config.of_belief());
  config.bounds_of_ends = true;
  OccupancyDescriptor descriptor(config);
  descriptor.describe(cluster.view());
  CHECK(descriptor.oldest() == 1);
  CHECK(descriptor.radial_cells() == 2);
  CHECK(descriptor.azimuth_cells() == 1);
  check_heights(descriptor.heights(1), {0.0, 1.0});
  check_heights(descriptor.heights(3), {2.0, 0.0});
  CHECK(descriptor.similarity() == 0.0);

  config.belief_cells = 2.0;
  const auto of_belief = config.of_belief();
  REQUIRE(of_belief);
  const OccupancyDescriptor belief = described(*of_belief, cluster);
  CHECK(belief.radial_cells() == 6);   // 5.9 m in cells of 1 m
  CHECK(belief.azimuth_cells() == 5);  // 90 deg in cells of 20 deg
  check_heights(belief.heights(0), std::vector<double>(30, 0.0));
  CHECK(*std::max_element(belief.heights(3).begin(), belief.heights(3).end()) == Approx(5.0));
}

TEST_CASE("descriptors are those of Eq. 5-11 in double on random clusters") {
  struct Case {
    const char* why;
    double azimuth_min, azimuth_max;  // deg, may run over 180
    double range_max;
    std::size_t points;
  };
  const auto c = GENERATE(values<Case>({
      {"a car ahead", -4.0, 6.0, 14.0, 60},
      {"a car behind, across the seam", 174.0, 187.0, 14.0, 60},
      {"a wall on one side", 20.0, 160.0, 20.0, 200},
      {"more than half a turn, free ahead", 20.0, 330.0, 20.0, 200},
      {"more than half a turn, free behind", -170.0, 130.0, 20.0, 200},
      {"more than half a turn, free on the left", 110.0, 395.0, 20.0, 200},
      {"more than half a turn, free on the right", -50.0, 220.0, 20.0, 200},
  }));
  INFO(c.why);
  const OccupancyDescriptor::Config config = make(0.25, 1.5);
  OccupancyDescriptor descriptor(config);  // one object for all clusters, as in the pipeline
  int compared = 0;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    Random random(seed);
    const int scans = 2 + static_cast<int>(seed % 4);
    Cluster cluster{};
    for (int k = 0; k < scans; ++k) {
      Cluster::Scan scan;
      for (std::size_t i = 0; i < c.points / static_cast<std::size_t>(scans); ++i) {
        const Eigen::Vector3d p =
            random.vector({10.0, c.azimuth_min, -1.7}, {c.range_max, c.azimuth_max, 2.0});
        scan.push_back({p.x(), p.y() > 180.0 ? p.y() - 360.0 : p.y(), p.z()});
      }
      cluster.add_scan(scan);
    }
    const auto expected = describe(config, cluster.view());
    if (!expected) continue;
    ++compared;
    INFO("seed " << seed);
    descriptor.describe(cluster.view());
    descriptor.describe_rest();
    REQUIRE(descriptor.radial_cells() == expected->radial_cells);
    REQUIRE(descriptor.azimuth_cells() == expected->azimuth_cells);
    for (std::size_t k = 0; k < 2 * static_cast<std::size_t>(scans); ++k) {
      const Span<const float> heights = descriptor.heights(k);
      double worst = 0.0;
      for (std::size_t i = 0; i < heights.size(); ++i) {
        worst = std::max(worst, std::abs(heights[i] - expected->heights[k][i]));
      }
      REQUIRE(worst < 1e-6);
    }
    REQUIRE(descriptor.similarity() == Approx(expected->similarity).margin(1e-6));
  }
  CHECK(compared >= 50);
}

TEST_CASE("a point on the outer border belongs to the last cell") {
  // Extent 1.0 m of 0.5 m cells: N_r = 2, and r_max would be in a third cell by Eq. 8.
  const Cluster cluster = {{{10.0, 0.0, 0.0}, {11.0, 0.0, 2.0}}, {{10.0, 0.0, 1.0}}};
  const OccupancyDescriptor descriptor = described(make(0.5, 10.0), cluster);
  CHECK(descriptor.radial_cells() == 2);
  check_heights(descriptor.heights(0), {0.0, 2.0});
}

TEST_CASE("observations without any height are equal to each other and unlike all others") {
  const Cluster flat = {{{10.0, 0.0, 1.0}}, {{12.0, 0.0, 1.0}}};
  CHECK(described(make(0.25, 1.5), flat).similarity() == 1.0);
  const Cluster half = {{{10.0, 0.0, 0.0}}, {{10.0, 0.0, 0.0}, {12.0, 0.0, 1.0}}};
  CHECK(described(make(0.25, 1.5), half).similarity() == 0.0);
  CHECK(described(make(0.25, 1.5), half).proposes_dynamic());
}

}  // namespace
}  // namespace dynains::test
