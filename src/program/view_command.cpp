#include <iostream>
#include <memory>
#include <string>

#include "command.hpp"
#include "dynains/errors.hpp"
#include "json_file.hpp"
#include "recording_options.hpp"
#include "run_results.hpp"
#include "write_view.hpp"

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
  bool quiet = false;
};

void check_is_complete(const OutputFolder& out) {
  if (!out.has_results()) {
    throw IoError(out.path().string() + ": holds no results; expected a folder of `dynains run`");
  }
  if (!out.is_complete()) {
    throw IoError(out.path().string() +
                  ": the run was interrupted; complete it first by dynains run --resume");
  }
}

void view(ViewOptions& options) {
  if (!fs::is_directory(options.out)) {
    throw IoError(options.out + ": no such folder; expected a folder of `dynains run`");
  }
  const LockedFolder lock(options.out);
  OutputFolder out(Folder(options.out), run_output_kind());
  check_is_complete(out);
  const fs::path report = out.path() / out.kind().marker;
  const auto& json = out.marker();
  try {
    options.sequence.complete(required_json_field<std::string>(report, json, "/sequence"),
                              json.value("sequence_flags", nlohmann::ordered_json::object()));
  } catch (const CLI::Error& error) {
    throw IoError(report.string() + ": /sequence_flags: " + error.what());
  }
  if (!fs::exists(options.sequence.folder())) {
    throw IoError(options.sequence.folder() +
                  ": no such recording; name the place of the run's recording: dynains view " +
                  options.out + " SEQ");
  }
  const Recording recording = options.sequence.open();
  const fs::path page = write_view(out, recording, options.max_points);
  if (!options.quiet) std::cout << "page: " << page.string() << std::endl;
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
  command.add_flag("-q,--quiet", options->quiet, "print errors only");
  command.footer(
      "Writes OUT/view.html: one file that needs no server and no network. SEQ and its flags are\n"
      "those of the run unless you give them.");
  command.callback([options] { view(*options); });
}

}  // namespace dynains::program
