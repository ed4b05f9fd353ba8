// Each stage alone, on an object after warm-up.
#include <benchmark/benchmark.h>

#include <cstdint>
#include <vector>

#include "bench/street.hpp"
#include "dynains/clusters/cluster_set.hpp"
#include "dynains/clusters/curved_voxel_clusterer.hpp"
#include "dynains/descriptors/occupancy_descriptor.hpp"
#include "dynains/ground/ground_segmenter.hpp"
#include "dynains/map/static_map_accumulator.hpp"

namespace dynains::bench {
namespace {

constexpr std::size_t kWindow = 4;

void count_points(benchmark::State& state, std::size_t points) {
  state.SetItemsProcessed(static_cast<std::int64_t>(points) * state.iterations());
}

std::vector<std::uint32_t> numbers(std::size_t count) {
  std::vector<std::uint32_t> result(count);
  for (std::size_t i = 0; i < count; ++i) result[i] = static_cast<std::uint32_t>(i);
  return result;
}

// The non-ground points of some scans, as the facade gathers them (Eq. 3).
struct Window {
  PolarBuffer points;
  std::vector<std::uint32_t> scan_begin = {0};

  Window() {
    GroundSegmenter ground(GroundSegmenter::Config::paper());
    GroundSplit split;
    const Eigen::Isometry3d T_newest_world = street_scans()[kWindow - 1].T_world_sensor.inverse();
    for (std::size_t k = 0; k < kWindow; ++k) {
      const test::Scan& scan = street_scans()[k];
      const std::vector<std::uint32_t> input = numbers(scan.points.size());
      ground.segment(buffer_of(scan), input, split);
      points.append(split.non_ground(), T_newest_world * scan.T_world_sensor);
      scan_begin.push_back(static_cast<std::uint32_t>(points.size()));
    }
  }
};

void BM_Ground(benchmark::State& state) {
  const PointBuffer scan = buffer_of(street_scans().front());
  GroundSegmenter ground(GroundSegmenter::Config::paper());
  GroundSplit split;
  const std::vector<std::uint32_t> input = numbers(scan.size());
  for (auto _ : state) ground.segment(scan, input, split);
  count_points(state, scan.size());
}
BENCHMARK(BM_Ground)->Unit(benchmark::kMillisecond);

void BM_Window(benchmark::State& state) {
  const PointBuffer scan = buffer_of(street_scans().front());
  const Eigen::Isometry3d T(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitZ()));
  PolarBuffer window;
  for (auto _ : state) {
    window.clear();
    window.append(scan, T);
  }
  count_points(state, scan.size());
}
BENCHMARK(BM_Window)->Unit(benchmark::kMillisecond);

void BM_Cluster(benchmark::State& state) {
  const Window window;
  CurvedVoxelClusterer clusterer(CurvedVoxelClusterer::Config::paper());
  for (auto _ : state) benchmark::DoNotOptimize(clusterer.cluster(window.points.view()).data());
  count_points(state, window.points.size());
}
BENCHMARK(BM_Cluster)->Unit(benchmark::kMillisecond);

void BM_ClusterSet(benchmark::State& state) {
  const Window window;
  CurvedVoxelClusterer clusterer(CurvedVoxelClusterer::Config::paper());
  const auto cluster_of = clusterer.cluster(window.points.view());
  ClusterSet clusters;
  for (auto _ : state) {
    clusters.build(window.points.view(), window.scan_begin, cluster_of, clusterer.cluster_count());
  }
  count_points(state, window.points.size());
}
BENCHMARK(BM_ClusterSet)->Unit(benchmark::kMillisecond);

void BM_Descriptor(benchmark::State& state) {
  const Window window;
  CurvedVoxelClusterer clusterer(CurvedVoxelClusterer::Config::paper());
  const auto cluster_of = clusterer.cluster(window.points.view());
  ClusterSet clusters;
  clusters.build(window.points.view(), window.scan_begin, cluster_of, clusterer.cluster_count());
  OccupancyDescriptor descriptor;
  for (auto _ : state) {
    for (std::size_t c = 0; c < clusters.size(); ++c) {
      if (!clusters.comparable(c)) continue;
      descriptor.describe(clusters[c]);
      benchmark::DoNotOptimize(descriptor.proposes_dynamic());
    }
  }
  count_points(state, window.points.size());
}
BENCHMARK(BM_Descriptor)->Unit(benchmark::kMillisecond);

// Mostly known ground, as in a steady drive.
void BM_Map(benchmark::State& state) {
  std::vector<PointBuffer> scans;
  for (const test::Scan& scan : street_scans()) scans.push_back(buffer_of(scan));
  StaticMapAccumulator map;
  std::size_t i = 0;
  std::size_t points = 0;
  for (auto _ : state) {
    const std::size_t s = i++ % scans.size();
    map.insert(scans[s], {}, street_scans()[s].T_world_sensor);
    points += scans[s].size();
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(points));
  state.counters["bytes_per_point"] =
      static_cast<double>(map.memory_bytes()) / static_cast<double>(map.size());
}
BENCHMARK(BM_Map)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace dynains::bench
