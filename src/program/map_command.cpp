#include <algorithm>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "command.hpp"
#include "dynains/city/city.hpp"
#include "dynains/errors.hpp"
#include "dynains/io/point_file.hpp"
#include "parameter_flags.hpp"
#include "run/map_file.hpp"
#include "run/output/output_folder.hpp"
#include "run/settings/recording_settings.hpp"

namespace dynains::program {
namespace {

namespace fs = std::filesystem;

struct MapOptions {
  std::string city;
  std::string session, later_session;
  std::string file, added = "added.ply", removed = "removed.ply";
  bool force = false;
};

/// By whole_path(). Throws ConfigError.
fs::path target_of(const std::string& name) {
  fs::path path = whole_path(name);
  if (is_point_file(name) && is_point_file(path)) return path;
  throw ConfigError(name + ": expected a name that ends in .ply, .pcd or .las");
}

/// A file for points of a city. Throws ConfigError, IoError.
OutputFile point_file(const City& city, const std::string& name, bool force) {
  return {target_of(name), existing_by(force), InputFiles(city.folder())};
}

/// Calls `fill(add)`, and `add(tile, session, point)` writes a point with its session, the begin of
/// that as time, and its label, as far as the format has them. Returns their number.
template <class Fill>
std::size_t write_city_points(const City& city, const OutputFile& file, Fill&& fill) {
  double most = 0.0;
  Eigen::Vector3d lowest = Eigen::Vector3d::Zero();
  for (const SessionInfo& session : city.sessions()) {
    most = std::max(
        {most, session.lowest.cwiseAbs().maxCoeff(), session.highest.cwiseAbs().maxCoeff()});
    lowest = session.lowest;
  }
  PointColumns columns;
  columns.label = columns.time = columns.session = true;
  columns.double_xyz = most > kFloatCoordinateLimit;
  return write_points(file, columns, las_options_near(lowest), [&](const AddPoint& add) {
    fill([&](const TileIndex& tile, std::uint32_t session, const SessionPoint& point) {
      FilePoint of_map{position_of(city.grid(), tile, point)};
      of_map.time = of_map.scan_time = city.sessions()[session].begin;
      of_map.label = of_map.instance = point.label;
      of_map.session = static_cast<std::uint16_t>(std::min(session, 65535U));
      of_map.is_ground = point.is_ground != 0;
      add(of_map);
    });
  });
}

void list(const MapOptions& options) {
  const City city{fs::path(options.city)};
  std::cout << "map of " << options.city << ": voxels of " << city.grid().map_voxel
            << " m, tiles of " << city.grid().tile << " m\n"
            << "session, begin s, scans, references, points, tiles, extent m\n"
            << std::fixed;
  for (const SessionInfo& session : city.sessions()) {
    const Eigen::Vector3d extent = session.highest - session.lowest;
    std::cout << session.name << ", " << std::setprecision(3) << session.begin << ", "
              << session.scans << ", " << session.references.size() << ", " << session.points
              << ", " << session.tiles.size() << ", " << std::setprecision(1) << extent.x() << " x "
              << extent.y() << " x " << extent.z() << '\n';
  }
  std::cout << std::flush;
}

/// Writes the map after session number `last`.
void write_map(const City& city, std::uint32_t last, const MapOptions& options) {
  OutputFile file = point_file(city, options.file, options.force);
  const std::size_t count = write_city_points(city, file, [&](const auto& add) {
    for (const TileIndex& tile : city.tiles()) {
      const TileHistory history = city.history(tile, last);
      history.for_each_standing(last, [&](std::size_t session, std::size_t i) {
        add(tile, static_cast<std::uint32_t>(session), history.points(session)[i]);
      });
    }
  });
  file.put_in_place();
  std::cout << options.file << ": " << count << " points" << std::endl;
}

void export_map(const MapOptions& options) {
  write_map(City{fs::path(options.city)}, TileHistory::kNever, options);
}

void write_map_at(const MapOptions& options) {
  const City city{fs::path(options.city)};
  write_map(city, city.number_of(options.session), options);
}

void diff(const MapOptions& options) {
  const City city{fs::path(options.city)};
  const std::uint32_t a = city.number_of(options.session);
  const std::uint32_t b = city.number_of(options.later_session);
  if (a >= b) {
    throw ConfigError("diff " + options.session + ' ' + options.later_session +
                      ": expected an earlier and a later session, by their begin");
  }
  if (whole_path(options.added) == whole_path(options.removed)) {
    throw ConfigError("--removed " + options.removed + ": is the file of --added, too");
  }
  OutputFile added = point_file(city, options.added, options.force);
  OutputFile removed = point_file(city, options.removed, options.force);
  std::size_t removed_count = 0;
  const std::size_t added_count = write_city_points(city, added, [&](const auto& add) {
    removed_count = write_city_points(city, removed, [&](const auto& add_removed) {
      for (const TileIndex& tile : city.tiles()) {
        const CityChanges changes = city.changes(tile, a, b);
        for (const CityPoint& p : changes.added) add(tile, p.session, p.point);
        for (const CityPoint& p : changes.removed) add_removed(tile, p.session, p.point);
      }
    });
  });
  added.put_in_place();
  removed.put_in_place();
  std::cout << options.added << ": " << added_count << " points\n"
            << options.removed << ": " << removed_count << " points" << std::endl;
}

void drop(const MapOptions& options) {
  City::unread(options.city).drop(options.session);
  std::cout << options.session << ": dropped" << std::endl;
}

void check(const MapOptions& options) {
  const std::vector<std::string> defects = City::unread(options.city).check();
  for (const std::string& defect : defects) std::cout << defect << '\n';
  if (!defects.empty()) {
    std::cout << defects.size() << " defects" << std::endl;
    throw Finding{};
  }
  std::cout << options.city << ": " << City{fs::path(options.city)}.sessions().size()
            << " sessions, whole" << std::endl;
}

}  // namespace

void add_map_command(CLI::App& app) {
  CLI::App& map = *app.add_subcommand("map", "Read and change a map of many sessions");
  const auto options = std::make_shared<MapOptions>();
  const auto add_argument = [](CLI::App& command, const char* name, std::string& value,
                               const char* help) {
    command.add_option(name, value, help)->required()->type_name("");
  };
  add_argument(map, "CITY", options->city, "folder of the map, see `dynains run --update`");
  map.require_subcommand(1);
  const auto add = [&](const char* name, const char* help,
                       void (*work)(const MapOptions&)) -> CLI::App& {
    CLI::App& command = *map.add_subcommand(name, help);
    command.callback([options, work] { work(*options); });
    return command;
  };
  const auto add_session = [&](CLI::App& command, const char* name, std::string& value) {
    add_argument(command, name, value, "name of a session");
  };
  const auto add_file = [&](CLI::App& command) {
    add_argument(command, "FILE", options->file, "points, .ply, .pcd or .las");
    command.add_flag("--force", options->force, "replace files");
  };

  add("list", "Print the sessions in the order of their time", list);
  add_file(add("export", "Write the map after all sessions", export_map));
  CLI::App& at = add("at", "Write the map after one session", write_map_at);
  add_session(at, "SESSION", options->session);
  add_file(at);
  CLI::App& changes = add("diff", "Write what came and what left between two sessions", diff);
  add_session(changes, "A", options->session);
  add_session(changes, "B", options->later_session);
  const SettingFlags flags{changes};
  flags(plain_text("added", options->added, "FILE", "points that came [added.ply]"));
  flags(plain_text("removed", options->removed, "FILE", "points that left [removed.ply]"));
  changes.add_flag("--force", options->force, "replace files");
  add_session(add("drop", "Remove one session: the map is as if it had never come", drop),
              "SESSION", options->session);
  add("check",
      "Read everything; print each defect with path and position; exit code 1 if there is one",
      check);
}

}  // namespace dynains::program
