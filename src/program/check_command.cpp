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
  if (!check.diagnosis.option.empty()) {
    std::cout << "    dynains run " << flags.as_given(check.diagnosis.option) << " --out OUT\n";
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
      "height\nand tilt of the sensor, and whether scans agree under the poses or under the usual "
      "mistakes. Registers\nneighbouring scans, for the error of the poses in cm and deg, the "
      "extrinsic calibration and the offset of\nthe clocks. Exits with 1 if a file is cut off, if "
      "the "
      "poses need another option or fit under none, or if\nscans are too far apart to be "
      "compared.");
  command.callback([flags] { check(*flags); });
}

}  // namespace dynains::program
