#include "dynains/evaluation/evaluate.hpp"

#include <stdexcept>

#include "dynains/threads/background.hpp"
#include "map_protocol.hpp"
#include "point_protocol.hpp"
#include "voxel_protocol.hpp"

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

}  // namespace

Evaluation evaluate(const ScanSource& source, const std::vector<std::string>& estimates,
                    const std::vector<MapEstimate>& maps, const EvaluationConfig& config) {
  config.validate();
  if (estimates.size() > kMaxEstimates) {
    throw ConfigError("at most " + std::to_string(kMaxEstimates) +
                      " estimates are evaluated at once");
  }
  Evaluation result;
  result.config = config;

  VoxelProtocol voxels(config, estimates.size());
  PointProtocol points(config, estimates.size());
  std::vector<MapProtocol> map_protocols;
  map_protocols.reserve(maps.size());
  for (const MapEstimate& map : maps) map_protocols.emplace_back(config, map.points_world);

  LabelledScan scan;
  Background others;
  for (; source(result.scans, scan); ++result.scans) {
    check_lengths(scan, result.scans);
    result.points += scan.size();
    others.begin([&] {
      points.add(scan);
      for (MapProtocol& map : map_protocols) map.add(scan);
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

  std::vector<std::string> names = {"identity", "oracle"};
  names.insert(names.end(), estimates.begin(), estimates.end());
  for (std::size_t row = 0; row < names.size(); ++row) {
    const bool is_estimate = row >= kFirstEstimate;
    result.rows.push_back({names[row], voxels.score(row), points.points(row), points.objects(row),
                           is_estimate ? points.by_class(row) : std::vector<ClassScore>(),
                           std::nullopt, std::nullopt});
  }
  if (!estimates.empty()) result.causes = points.by_cause();
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
