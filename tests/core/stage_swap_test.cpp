// Every stage can be replaced by a stage of the user.

#include "dynains/points.hpp"
#include "support/catch.hpp"
#include "support/own_stages.hpp"
#include "support/runs.hpp"

namespace dynains::test {
namespace {

struct NoParameters {
  template <class Self, class Visitor>
  static void visit(Self&, Visitor&&) {}
  void validate() const {}
};

// A map that counts inserted points and cannot remove any.
class CountingMap {
 public:
  using Config = NoParameters;
  explicit CountingMap(const Config&) {}
  void insert(PointsView points, Span<const std::uint8_t> keep, const Eigen::Isometry3d&) {
    count += keep.empty() ? points.size()
                          : static_cast<std::size_t>(std::count_if(
                                keep.begin(), keep.end(), [](std::uint8_t k) { return k != 0; }));
  }
  void clear() { count = 0; }

  std::size_t count = 0;
};

// Points below a height are ground.
class FlatGround {
 public:
  struct Config {
    double flat_ground_below = -1.5;  // m

    template <class Self, class Visitor>
    static void visit(Self& self, Visitor&& visitor) {
      visitor(Parameter{"flat_ground_below", self.flat_ground_below, closed(-100, 100), "m",
                        "everything lower is ground"});
    }
    void validate() const { validate_parameters("FlatGround", *this); }
  };
  explicit FlatGround(const Config& config) : config_(config) {}

  void segment(PointsView scan, Span<const std::uint32_t> input, GroundSplit& split) {
    split.resize(scan.size());
    std::size_t next = 0;
    for (const bool wanted : {true, false}) {
      for (std::size_t i = 0; i < scan.size(); ++i) {
        if ((scan.z[i] < config_.flat_ground_below) != wanted) continue;
        split.points.x[next] = scan.x[i];
        split.points.y[next] = scan.y[i];
        split.points.z[next] = scan.z[i];
        split.input[next++] = input[i];
      }
      if (wanted) split.ground_count = next;
    }
  }

 private:
  Config config_;
};

// One cluster ahead of the sensor, one behind it. Points near the ground belong to neither.
class HalvesClusterer {
 public:
  using Config = NoParameters;
  explicit HalvesClusterer(const Config&) {}

  Span<const std::uint32_t> cluster(PolarView points) {
    numbers_.resize(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      numbers_[i] = points.z[i] < -1.0F ? kNoCluster : std::abs(points.azimuth[i]) < 1.57F ? 0 : 1;
    }
    return numbers_;
  }
  std::size_t cluster_count() const { return 2; }

 private:
  std::vector<std::uint32_t> numbers_;
};

// Omits the last point.
class ShortClusterer : public HalvesClusterer {
 public:
  using HalvesClusterer::HalvesClusterer;
  Span<const std::uint32_t> cluster(PolarView points) {
    const Span<const std::uint32_t> all = HalvesClusterer::cluster(points);
    return all.subspan(0, all.size() - 1);
  }
};

// Proposes every cluster.
class Suspicious : public OccupancyDescriptor {
 public:
  using OccupancyDescriptor::OccupancyDescriptor;
  bool proposes_dynamic() const { return true; }
};

// Believes every proposal.
class Credulous : public BeliefUpdater {
 public:
  using BeliefUpdater::BeliefUpdater;
  double posterior() const { return 0.875; }
  bool is_dynamic() const { return true; }
};

// Stages that store the sensor model that adapt() gives them.
class ToldGround : public GroundSegmenter {
 public:
  using GroundSegmenter::GroundSegmenter;
  void adapt(const SensorModel& sensor) { height = sensor.height; }
  static inline double height = 0.0;
};
class ToldClusterer : public CurvedVoxelClusterer {
 public:
  using CurvedVoxelClusterer::CurvedVoxelClusterer;
  void adapt(const SensorModel& sensor) { gap = sensor.elevation_gap; }
  static inline double gap = 0.0;
};
struct ToldStages : DefaultStages {
  using Ground = ToldGround;
  using Clusterer = ToldClusterer;
};

TEST_CASE("stages get the sensor model from the first scan that shows it") {
  Eigen::Isometry3d T_world_sensor = sensor_at(0.0);
  T_world_sensor.translation().z() = 2.6;
  BasicDynaInsRemover<ToldStages> remover;
  CHECK(ToldGround::height == 0.0);
  run(remover, {yard().scan(T_world_sensor, 0.0)});
  CHECK(ToldGround::height == Approx(2.6).margin(0.03));
  CHECK(ToldClusterer::gap == Approx(36.8 / 79.0).margin(0.02));
}

struct OwnShortClusterer : DefaultStages {
  using Clusterer = ShortClusterer;
};
struct OwnEverything {
  using Ground = FlatGround;
  using Clusterer = HalvesClusterer;
  using Descriptor = Suspicious;
  using Belief = Credulous;
  using Map = CountingMap;
};

TEST_CASE("a clusterer that omits points is refused with a reason") {
  const std::vector<Scan> scans = drive(yard(), 1, 0.0);
  BasicDynaInsRemover<OwnShortClusterer> remover;
  CHECK_THROWS_WITH(remover.push(scans[0].points, scans[0].T_world_sensor),
                    StartsWith("Stages::Clusterer gave "));
}

TEST_CASE("all stages can be stages of the user, and their configs are parts of the whole") {
  const std::vector<Scan> scans = drive(yard(), 5, 0.0);
  using Remover = BasicDynaInsRemover<OwnEverything>;
  Remover::Config config = Remover::Config::paper();
  config.ground.flat_ground_below = -1.25;
  Remover remover(config);
  const Run result = run(remover, scans);
  std::size_t static_points = 0;
  for (std::size_t s = 0; s < scans.size(); ++s) {
    for (std::size_t i = 0; i < scans[s].points.size(); ++i) {
      const float z = scans[s].points[i].z();
      const PointLabel label = result.final[s].labels[i];
      if (label == PointLabel::kOutOfRange) continue;
      REQUIRE((label == PointLabel::kGround) == (z < -1.25F));
      // Two clusters in every scan, each proposed and believed. All other points are static.
      REQUIRE((label == PointLabel::kDynamic) == (z >= -1.0F));
      REQUIRE(result.final[s].beliefs[i] == (z >= -1.0F ? 0.875F : 0.0F));
      REQUIRE((result.final[s].instances[i] != kNoInstance) == (z >= -1.0F));
      static_points += is_static(label) ? 1U : 0U;
    }
  }
  CHECK(remover.map().count == static_points);
  bool is_listed = false;
  Remover::Config::visit(config, [&](const auto& parameter) {
    is_listed = is_listed || std::string(parameter.name) == "flat_ground_below";
  });
  CHECK(is_listed);
  config.ground.flat_ground_below = 1000.0;
  CHECK_THROWS_WITH(Remover(config), StartsWith("FlatGround."));
}

}  // namespace
}  // namespace dynains::test
