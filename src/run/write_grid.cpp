#include "write_grid.hpp"

#include <algorithm>

#include "dynains/errors.hpp"
#include "dynains/io/point_file.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"
#include "interrupt.hpp"
#include "map_file.hpp"
#include "run/output/output_folder.hpp"

namespace dynains::run {
namespace {

namespace fs = std::filesystem;

/// A place near a position: whole metres, so that cells of all grids of a map coincide.
Eigen::Vector3d place_near(const Eigen::Vector3d& position) { return position.array().floor(); }

/// Distance between the points of surfaces, from 0.02 to 0.5 m: the edge of voxels that hold about
/// one.
double spacing_of(const std::vector<Eigen::Vector3d>& points) {
  return edge_by_spacing(points.size(), 0.02, 0.5, [&](double edge) {
    VoxelHashTable<> voxels;
    for (const Eigen::Vector3d& point : points) voxels.insert(voxel_at(point, edge));
    return voxels.size();
  });
}

PlacedGrid placed(const grid::GridMaker& maker, const Eigen::Vector3d& place,
                  const grid::Floors& floors, bool is_one_scan) {
  PlacedGrid made{maker.grid(), place.head<2>()};
  if (is_one_scan) {
    made.doubts.emplace_back("the grid is of one scan: nothing shows what in it moves");
  }
  if (floors.is_small()) {
    made.doubts.emplace_back(
        "the grid has less than 10 m2 of ground in one piece: what is lowest counted as ground");
  }
  return made;
}

}  // namespace

fs::path grid_file(const fs::path& name) {
  if (name.extension() == ".yaml") return whole_path(name);
  throw ConfigError("a grid goes to a file whose name ends in .yaml, not to " + name.string());
}

fs::path grid_image(const fs::path& file) { return fs::path(file).replace_extension(".pgm"); }

nlohmann::ordered_json PlacedGrid::summary() const {
  const auto share = [&](grid::CellState state) {
    return static_cast<double>(grid.count(state)) / static_cast<double>(grid.cells.size());
  };
  return {{"width", grid.columns.width},
          {"height", grid.columns.height},
          {"free", share(grid::CellState::kFree)},
          {"occupied", share(grid::CellState::kOccupied)}};
}

PlacedGrid grid_of_run(const LabelReader& read_labels, const Recording& recording,
                       const std::vector<std::size_t>& scans, const grid::Config& config,
                       bool keep_moving, const std::function<void(std::size_t done)>& progress) {
  const Eigen::Vector3d place = place_near(recording.T_world_sensor(scans.front()).translation());
  const auto pose = [&](std::size_t i) {
    Pose T_place_sensor = recording.T_world_sensor(i);
    T_place_sensor.translation() -= place;
    return T_place_sensor;
  };
  std::vector<Pose> sensors = recording.sensors();
  if (sensors.empty()) sensors.push_back(Pose::Identity());
  const auto places_of_sensors = [&](std::size_t i) {
    std::vector<Eigen::Vector3d> places;
    places.reserve(sensors.size());
    for (const Pose& T : sensors) places.emplace_back(pose(i) * T.translation());
    return places;
  };
  RecordedScan scan;
  std::vector<PointLabel> labels;
  // The points of scan i that are judged: visit(position, label, sensor).
  const auto for_each_judged = [&](std::size_t i, auto&& visit) {
    recording.read_scan(i, scan);
    read_labels(i, scan, labels);
    const Pose T_place_sensor = pose(i);
    for (std::size_t k = 0; k < scan.size(); ++k) {
      PointLabel label = labels[k];
      if (label == PointLabel::kInvalid || label == PointLabel::kOutOfRange) continue;
      if (label == PointLabel::kDynamic && keep_moving) label = PointLabel::kStatic;
      const std::size_t sensor = scan.sensor.empty() ? 0 : scan.sensor[k];
      visit(T_place_sensor * scan.point(k).position, label, sensor);
    }
  };
  grid::Floors floors(recording.folder().string());
  std::size_t done = 0;
  const auto end_scan = [&] {
    progress(++done);
    InterruptGuard::check();
  };
  progress(done);
  for (const std::size_t i : scans) {
    const std::vector<Eigen::Vector3d> places = places_of_sensors(i);
    for_each_judged(i, [&](const Eigen::Vector3d& point, PointLabel label, std::size_t k) {
      if (label == PointLabel::kDynamic) return;
      floors.add(point, label == PointLabel::kGround, point.z() > places.at(k).z());
    });
    end_scan();
  }
  floors.finish(config.min_height, config.resolution);
  grid::GridMaker maker(config, floors);
  std::vector<std::vector<Eigen::Vector3d>> ends(sensors.size());
  for (const std::size_t i : scans) {
    for (auto& of_sensor : ends) of_sensor.clear();
    maker.begin_scan();
    for_each_judged(i, [&](const Eigen::Vector3d& point, PointLabel label, std::size_t k) {
      maker.add(point, label == PointLabel::kDynamic);
      ends.at(k).push_back(point);
    });
    const std::vector<Eigen::Vector3d> places = places_of_sensors(i);
    for (std::size_t k = 0; k < sensors.size(); ++k) maker.add_beams(places[k], ends[k]);
    end_scan();
  }
  return placed(maker, place, floors, scans.size() == 1);
}

PlacedGrid grid_of_map(const fs::path& map, const grid::Config& config) {
  std::vector<Eigen::Vector3d> points = read_points(map).positions;
  points.erase(std::remove_if(points.begin(), points.end(),
                              [](const Eigen::Vector3d& point) { return !point.allFinite(); }),
               points.end());
  if (points.empty()) throw IoError(map.string() + ": has no points");
  const Eigen::Vector3d place = place_near(points.front());
  for (Eigen::Vector3d& point : points) point -= place;
  grid::Floors floors(map.string());
  floors.add_map(points, config.min_height);
  floors.finish(config.min_height, config.resolution);
  grid::GridMaker maker(config, floors, spacing_of(points));
  for (const Eigen::Vector3d& point : points) {
    maker.begin_scan();
    maker.add(point, false);
  }
  return placed(maker, place, floors, false);
}

}  // namespace dynains::run
