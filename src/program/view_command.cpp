#include <iostream>

#include "command.hpp"
#include "run/write_view.hpp"

namespace dynains::program {
namespace {

namespace fs = std::filesystem;

struct ViewOptions {
  explicit ViewOptions(CLI::App& command)
      : out(command, "OUT", "folder of `dynains run`"),
        sequence(command, "recording of the run", false) {
    command
        .add_option("--max-points", max_points,
                    "points on the page; a larger map and more moving points are thinned")
        ->check(CLI::Range(std::size_t{1000}, std::size_t{100000000}))
        ->capture_default_str()
        ->type_name("N");
    command.add_flag("-q,--quiet", quiet, "print errors only");
  }

  Argument out;
  RecordingFlags sequence;
  std::size_t max_points = kDefaultViewPoints;
  bool quiet = false;
};

void view(ViewOptions& options) {
  const fs::path page = add_page(
      options.out.value,
      [&](const ResultFolder& out) {
        return options.sequence.open_of_run(out, "dynains view " + options.out.value);
      },
      options.max_points);
  if (!options.quiet) std::cout << "page: " << page.string() << std::endl;
}

}  // namespace

void add_view_command(CLI::App& app) {
  add_command<ViewOptions>(
      app, "view", "Write a page that shows the results of a run in a browser",
      "Writes OUT/view.html: one file that needs no server and no network. SEQ and its flags are\n"
      "those of the run unless you give them.",
      view);
}

}  // namespace dynains::program
