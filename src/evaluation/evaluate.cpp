#include "dynains/evaluation/evaluate.hpp"

#include <future>
#include <stdexcept>

#include "dynains/evaluation/map_protocol.hpp"
#include "dynains/evaluation/object_protocol.hpp"
#include "dynains/evaluation/point_protocol.hpp"
#include "dynains/evaluation/voxel_protocol.hpp"
#include "dynains/threads/background.hpp"

namespace dynains::evaluation {
namespace {

void check_lengths(const LabelledScan& scan, std::size_t index) {
  if (scan.stride < 3) {
    throw std::invalid_argument("scan " + std::to_string(index) + " has a stride of " +
                                std::to_string(scan.stride) + " floats, expected at least 3");
  }
  const auto check = [&](std::size_t size, const char* what) {
    if (size != 0 && size != scan.size()) {
      throw std::invalid_argument("scan " + std::to_string(index) + " has " +
                                  std::to_string(scan.size()) + " points but " +
                                  std::to_string(size) + " " + what);
    }
  };
  check(scan.in_map.size(), "verdicts");
  check(scan.causes.size(), "causes");
}

/// The row of `name` by voxels, points and objects; the columns of maps are empty.
EvaluationRow row_of(const std::string& name, const VoxelScore& voxels, const PointScore& points,
                     const ObjectScore& objects, std::vector<ClassScore> classes = {}) {
  return {name, voxels, points, objects, std::move(classes), std::nullopt, std::nullopt};
}

}  // namespace

Evaluation evaluate(const ScanSource& source, const std::vector<std::string>& estimates,
                    const std::vector<MapEstimate>& maps, const EvaluationConfig& config) {
  config.validate();
  Evaluation result;
  result.config = config;

  VoxelProtocol voxels({config.voxel, config.min_range, config.max_range, config.truth},
                       estimates.size());
  PointProtocol points({config.min_range, config.point_max_range, config.truth}, estimates.size());
  ObjectProtocol objects({config.min_range, config.point_max_range, config.truth},
                         estimates.size());
  std::vector<MapProtocol> map_protocols;
  map_protocols.reserve(maps.size());
  for (const MapEstimate& map : maps) {
    map_protocols.emplace_back(
        MapProtocol::Settings{config.voxel, config.min_range, config.max_range,
                              config.point_max_range, config.point_radius, config.truth},
        map.points_world);
  }
  if (!estimates.empty() && config.analyses_errors) {
    result.errors.emplace(
        ErrorAnalysis::Settings{config.min_range, config.point_max_range, config.truth});
  }

  LabelledScan scan;
  Background others;
  for (; source(result.scans, scan); ++result.scans) {
    check_lengths(scan, result.scans);
    result.points += scan.size();
    others.begin([&] {
      points.add(scan);
      objects.add(scan);
      for (MapProtocol& map : map_protocols) map.add(scan);
      if (result.errors) result.errors->add(scan);
    });
    voxels.add(scan);
    others.wait();
  }
  for (std::size_t index = 0; index < result.scans && source(index, scan); ++index) {
    check_lengths(scan, index);
    others.begin([&] {
      for (MapProtocol& map : map_protocols) map.resolve(scan);
    });
    voxels.resolve(scan);
    others.wait();
  }

  result.rows.push_back(row_of("identity", voxels.score(VoxelProtocol::kIdentity),
                               points.identity(), objects.identity()));
  std::vector<std::future<VoxelScore>> scores;
  for (std::size_t row = VoxelProtocol::kOracle;
       row < VoxelProtocol::kFirstEstimate + estimates.size(); ++row) {
    scores.push_back(std::async(std::launch::async, [&voxels, row] { return voxels.score(row); }));
  }
  result.rows.push_back(row_of("oracle", scores.front().get(), points.oracle(), objects.oracle()));
  for (std::size_t e = 0; e < estimates.size(); ++e) {
    result.rows.push_back(row_of(estimates[e], scores[e + 1].get(), points.score(e),
                                 objects.score(e), objects.by_class(e)));
  }
  for (std::size_t m = 0; m < maps.size(); ++m) {
    result.rows.push_back({maps[m].name,
                           map_protocols[m].voxel_score(voxels),
                           map_protocols[m].point_score(),
                           std::nullopt,
                           {},
                           map_protocols[m].foreign_points(),
                           maps[m].points_world.size()});
  }
  return result;
}

}  // namespace dynains::evaluation
