#include <iostream>
#include <optional>
#include <string>
#include <vector>

#include "command.hpp"
#include "run/output/output_folder.hpp"
#include "run/remarks/recording_check.hpp"
#include "run/remarks/run_doubts.hpp"

namespace dynains::program {
namespace {

struct CheckFlags {
  explicit CheckFlags(CLI::App& command) : recording(command, "recording") {
    command.add_option(
        "--closures", closures,
        "writes where the trajectory comes back to a place, as edges of a pose graph "
        "(g2o);\nreads all scans");
    command.add_flag("--force", force, "replaces the file of --closures");
  }

  RecordingFlags recording;
  std::string closures;
  bool force = false;
};

void find_closures(const Recording& recording, OutputFile& file) {
  const std::vector<ReturnToPlace> returns = find_returns(recording, file.path().parent_path());
  file.write([&](std::ostream& out) { write_closures(out, returns); });
  for (const ReturnError& error : return_errors(recording, 0, returns)) {
    std::cout << sentence(error, recording) << '\n';
  }
}

void check(const CheckFlags& given) {
  const RecordingFlags& flags = given.recording;
  const Recording recording(flags.folder, flags.settings.checked());
  std::optional<OutputFile> closures;
  if (!given.closures.empty()) {
    closures.emplace(given.closures, existing_by(given.force), InputFiles(recording));
  }
  const RecordingCheck check = check_recording(recording);
  std::cout << check.findings << check.advice << std::flush;
  if (!check.flags.empty()) {
    std::cout << "    dynains run " << flags.settings.as_given(flags.folder, check.flags)
              << " --out OUT\n";
  }
  std::cout << check.remark << std::flush;
  if (closures) find_closures(recording, *closures);
  if (!check.passed) throw Finding{};
}

}  // namespace

void add_check_command(CLI::App& app) {
  add_command<CheckFlags>(
      app, "check",
      "Report within seconds whether a recording will work, and which options it needs",
      "Looks at the size of every scan file, and at a sample of scans: counts, units, invalid "
      "points, height\nand tilt of the sensor. Registers scans, and reports whether they agree "
      "with the poses,\nwhich option makes them agree, and the errors of the poses, in cm and deg. "
      "Exits with 1 if a file is cut off, if the poses\nneed another option or fit under none, or "
      "if scans are too far apart to be compared.",
      check);
}

}  // namespace dynains::program
