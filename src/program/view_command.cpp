#include <iostream>
#include <memory>
#include <string>

#include "command.hpp"
#include "dynains/errors.hpp"
#include "recording_options.hpp"
#include "run/interrupt.hpp"
#include "run/json_file.hpp"
#include "run/output_folder.hpp"
#include "run/write_view.hpp"
#include "tile_server.hpp"
#include "tileset_files.hpp"
#include "web_server.hpp"

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
  bool serve = false;
  int port = 0;
  bool quiet = false;
};

Recording open_recording(ViewOptions& options, const fs::path& report_file,
                         const nlohmann::ordered_json& report) {
  try {
    options.sequence.complete(required_json_field<std::string>(report_file, report, "/sequence"),
                              report.value("sequence_flags", nlohmann::ordered_json::object()));
  } catch (const CLI::Error& error) {
    throw IoError(report_file.string() + ": /sequence_flags: " + error.what());
  }
  if (!fs::exists(options.sequence.folder())) {
    throw IoError(options.sequence.folder() +
                  ": no such recording; name the place of the run's recording: dynains view " +
                  options.out + " SEQ");
  }
  return options.sequence.open();
}

void view(ViewOptions& options) {
  const fs::path page = write_view(
      options.out,
      [&](const fs::path& report_file, const nlohmann::ordered_json& report) {
        return open_recording(options, report_file, report);
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

void serve(const ViewOptions& options) {
  prepare_tileset(options.out, options.quiet);
  const TileServer server(options.out);
  serve_web(
      options.port, [&](const std::string& path) { return server.answer(path); },
      [](int port) {
        std::cout << "map: http://127.0.0.1:" << port << "/ (Ctrl-C stops)" << std::endl;
      });
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
  CLI::Option* const serve_option =
      command.add_flag("--serve", options->serve,
                       "for large maps: serve the static map in tiles (OGC 3D Tiles) until Ctrl-C");
  command.add_option("--port", options->port, "of --serve, on this machine alone [a free one]")
      ->check(CLI::Range(1, 65535))
      ->needs(serve_option)
      ->type_name("N");
  command.add_flag("-q,--quiet", options->quiet, "print errors only");
  command.footer(
      "Writes OUT/view.html: one file that needs no server and no network. SEQ and its flags are\n"
      "those of the run unless you give them. With --serve, writes OUT/tileset.json and "
      "OUT/tileset\n"
      "instead, and OUT may be a folder of dynains map CITY export OUT --format 3dtiles.");
  command.callback([options] { options->serve ? serve(*options) : view(*options); });
}

}  // namespace dynains::program
