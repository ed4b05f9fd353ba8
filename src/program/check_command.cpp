#include <iostream>
#include <memory>

#include "command.hpp"
#include "recording_options.hpp"
#include "run/recording_check.hpp"

namespace dynains::program {
namespace {

void check(const RecordingFlags& flags) {
  const RecordingCheck check = check_recording(Recording(flags.folder(), flags.options()));
  std::cout << check.findings << check.advice << std::flush;
  if (!check.flags.empty()) {
    std::cout << "    dynains run " << flags.as_given(check.flags) << " --out OUT\n";
  }
  std::cout << check.remark << std::flush;
  if (!check.passed) throw Finding{};
}

}  // namespace

void add_check_command(CLI::App& app) {
  CLI::App& command = *app.add_subcommand(
      "check", "Tell in seconds whether a recording will work, and which option it needs");
  const auto flags = std::make_shared<RecordingFlags>(command, "recording");
  command.footer(
      "Looks at the size of every scan file, and at a sample of scans: counts, units, invalid "
      "points, "
      "height\nand tilt of the sensor. Registers scans, and tells whether they agree with the "
      "poses, "
      "under which option\nthey would, and how inexact the poses are, in cm and deg. Exits with 1 "
      "if a "
      "file is cut off, if the poses\nneed another option or fit under none, or if scans are too "
      "far "
      "apart to be compared.");
  command.callback([flags] { check(*flags); });
}

}  // namespace dynains::program
