#include "tileset_files.hpp"

#include <Eigen/Geometry>
#include <string>
#include <system_error>

#include "command.hpp"
#include "dynains/errors.hpp"
#include "dynains/io/point_file.hpp"
#include "dynains/version.hpp"
#include "progress.hpp"
#include "run/interrupt.hpp"
#include "run/json_file.hpp"
#include "viewer/tileset_writer.hpp"

namespace dynains::program {
namespace {

namespace fs = std::filesystem;
using viewer::kPointTileExtension;
using viewer::kTilesetFile;
using viewer::kTilesetFolder;
using viewer::kTilesetPage;

/// The file of the static map of a run. Throws IoError.
fs::path map_of(const OutputFolder& out) {
  const fs::path report = out.path() / out.kind().marker;
  const auto name = json_field<std::string>(report, out.marker(), "/static_map/file");
  if (!name) throw IoError(report.string() + ": /static_map: the run built no map");
  return out.path() / *name;
}

/// Whether `file` is there and was written after `source`.
bool is_newer(const fs::path& file, const fs::path& source) {
  std::error_code error;
  const auto written = fs::last_write_time(file, error);
  if (error) return false;
  const auto changed = fs::last_write_time(source, error);
  return !error && written >= changed;
}

void stop_after_signal() {
  if (const int signal = InterruptGuard::signal()) throw Interrupted{signal};
}

void write_tileset(const fs::path& map, const fs::path& folder, bool quiet) {
  const PointFileHeader header = read_point_file_header(map);
  Eigen::AlignedBox3d bounds;
  for_each_point(map, [&](const FilePoint& point) {
    stop_after_signal();
    bounds.extend(point.position);
  });
  if (bounds.isEmpty()) bounds.extend(Eigen::Vector3d::Zero());
  viewer::TilesetWriter writer(folder, header.columns, bounds.min(), bounds.max());
  Progress progress(static_cast<std::size_t>(header.point_count), "points", quiet);
  for_each_point(map, [&](const FilePoint& point) {
    stop_after_signal();
    writer.add(point);
    constexpr std::size_t kStep = 100000;  // points
    if (writer.size() % kStep == 0) progress.update(writer.size());
  });
  writer.commit();
  stop_after_signal();
}

}  // namespace

const OutputKind& tileset_output_kind() {
  static const OutputKind kind = {"map export",
                                  "export.json",
                                  {kTilesetFile, kTilesetPage},
                                  false,
                                  {{kTilesetFolder, {kPointTileExtension}}}};
  return kind;
}

OutputListing tileset_listing() {
  OutputListing listing;
  listing.files = {kTilesetFile, kTilesetPage};
  listing.folders = {{kTilesetFolder, kPointTileExtension}};
  return listing;
}

nlohmann::ordered_json tileset_marker(bool complete) {
  return {{"program", "dynains"},
          {"version", kVersionString},
          {"command", tileset_output_kind().command},
          {"complete", complete}};
}

void write_run_tileset(OutputFolder& out, bool quiet) {
  const fs::path map = map_of(out);
  const fs::path tileset = out.path() / kTilesetFile;
  OutputListing listing = out.listing();
  listing.files.insert({kTilesetFile, kTilesetPage});
  listing.folders[kTilesetFolder] = kPointTileExtension;
  if (out.listing().contains(listing) && is_newer(tileset, map)) return;
  out.check(listing, InputFiles());
  // Listed first: tiles that are not listed would count as files of the user.
  out.mark(nlohmann::ordered_json(out.marker()), listing);
  out.remove_temporaries();
  out.folder().remove_file(kTilesetFile);
  out.folder().remove_file(kTilesetPage);
  out.remove_folder_results(kTilesetFolder);
  write_tileset(map, out.path(), quiet);
}

}  // namespace dynains::program
