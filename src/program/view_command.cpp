#include <iostream>
#include <memory>
#include <string>

#include "command.hpp"
#include "dynains/errors.hpp"
#include "recording_options.hpp"
#include "run/interrupt.hpp"
#include "run/output_folder.hpp"
#include "run/write_view.hpp"
#include "tileset_files.hpp"
#include "viewer/tileset_writer.hpp"

namespace dynains::program {
namespace {

namespace fs = std::filesystem;

struct ViewOptions {
  explicit ViewOptions(CLI::App& command)
      : out_option(command.add_option("OUT", out, "folder of `dynains run`")),
        sequence(command, "recording of the run", false) {
    out_option->required()->type_name("");
  }

  std::string out;
  CLI::Option* out_option;  // the first positional argument
  RecordingFlags sequence;
  std::size_t max_points = kDefaultViewPoints;
  bool tiles = false;
  bool quiet = false;
};

void view(ViewOptions& options) {
  const fs::path page = write_view(
      options.out,
      [&](const fs::path& report_file, const nlohmann::ordered_json& report) {
        return options.sequence.open_of_run(report_file, report, "dynains view " + options.out);
      },
      options.max_points);
  if (!options.quiet) std::cout << "page: " << page.string() << std::endl;
}

/// Makes the tileset of a run if it is missing. Throws IoError unless `folder` is of a run or of
/// `dynains map CITY export --format 3dtiles`.
void prepare_tileset(const fs::path& folder, bool quiet) {
  if (!fs::is_directory(folder)) {
    throw IoError(folder.string() + ": no such folder; expected a folder of `dynains run`");
  }
  const LockedFolder lock(folder);
  const OutputKind& exported = tileset_output_kind();
  if (fs::exists(folder / exported.marker)) {
    const OutputFolder out(Folder(folder), exported);
    if (out.is_complete()) return;
    throw IoError(folder.string() + ": its export was interrupted; repeat it with --force");
  }
  if (fs::exists(folder / "city.json")) {
    throw IoError(folder.string() +
                  ": is a map of many sessions; write its tiles first: dynains map " +
                  folder.string() + " export FOLDER --format 3dtiles");
  }
  OutputFolder out = open_finished_run(folder);
  const InterruptGuard interrupt;
  write_run_tileset(out, quiet);
}

void view_tiles(const ViewOptions& options) {
  prepare_tileset(options.out, options.quiet);
  if (options.quiet) return;
  std::cout << "map: " << (fs::path(options.out) / viewer::kTilesetPage).string()
            << "\nIts tiles need a web server: python3 -m http.server --bind 127.0.0.1 --directory "
            << options.out << "\nThen open http://127.0.0.1:8000/" << viewer::kTilesetPage
            << std::endl;
}

}  // namespace

void add_view_command(CLI::App& app) {
  CLI::App& command =
      *app.add_subcommand("view", "Write a page that shows the results of a run in a browser");
  const auto options = std::make_shared<ViewOptions>(command);
  command
      .add_option("--max-points", options->max_points,
                  "points on the page; a larger map and more moving points are thinned")
      ->check(CLI::Range(std::size_t{1000}, std::size_t{100000000}))
      ->capture_default_str()
      ->type_name("N");
  command.add_flag("--tiles", options->tiles,
                   "for large maps: write the static map in tiles (OGC 3D Tiles) and a page that "
                   "loads them");
  command.add_flag("-q,--quiet", options->quiet, "print errors only");
  command.footer(
      "Writes OUT/view.html: one file that needs no server and no network. SEQ and its flags are\n"
      "those of the run unless you give them. With --tiles, writes OUT/map.html, OUT/tileset.json\n"
      "and OUT/tileset instead, which any web server of static files shows, and OUT may be a\n"
      "folder of dynains map CITY export OUT --format 3dtiles.");
  command.callback([options] { options->tiles ? view_tiles(*options) : view(*options); });
}

}  // namespace dynains::program
