#include <iostream>
#include <optional>
#include <string>

#include "command.hpp"
#include "dynains/compiled_remover.hpp"
#include "parameter_flags.hpp"
#include "program.hpp"
#include "run/output/output_folder.hpp"
#include "run/remarks/recording_check.hpp"
#include "run/remarks/run_doubts.hpp"

namespace dynains::program {
namespace {

struct OdometryFlags {
  explicit OdometryFlags(CLI::App& command) : recording(command, "recording") {
    command.add_option("-o,--out", out, "file of poses, rows of time x y z qx qy qz qw (TUM)")
        ->required()
        ->type_name("FILE");
    command.add_flag("--force", force, "replace the file of --out if it exists");
    ScanWindow::visit(window, SettingFlags{command});
    add_compensated_flag(command, is_compensated);
    command.add_flag("--one-thread", one_thread, "the thread that registers also reads");
    command.add_flag("-q,--quiet", quiet, "print errors only");
  }

  RecordingFlags recording;
  std::string out;
  ScanWindow window;
  bool is_compensated = false;
  bool one_thread = false;
  bool force = false;
  bool quiet = false;
};

/// Says what a run with these poses would say.
void warn_as_run(const Recording& recording, const PoseEstimate& estimate) {
  const ScanRange range = whole_of(recording);
  const StartCheck start = check_start(recording, range, DynaInsRemover::Config(), true);
  for (const std::string& text : start.warnings) print_warning(text);
  for (const std::string& text : find_doubts(recording, range, estimate.timing).sentences) {
    print_warning(text);
  }
}

void write_poses(const OdometryFlags& flags) {
  Recording recording = flags.recording.open_without_poses(flags.is_compensated);
  const bool is_own = flags.force && is_own_trajectory(flags.out);
  OutputFile file(flags.out, is_own ? Existing::kOurs : existing_by(flags.force),
                  InputFiles(recording));
  const PoseEstimate estimate =
      estimate_with_progress(recording, flags.window, flags.one_thread, flags.quiet);
  write_trajectory(file.path(), recording);
  file.put_in_place();
  if (!flags.quiet) {
    std::cout << recording.size() << " poses: " << flags.out << std::endl;
  }
  warn_as_run(recording, estimate);
  if (estimate.loss) throw LostTrack(*estimate.loss);
}

}  // namespace

void add_compensated_flag(CLI::App& command, bool& is_compensated) {
  command.add_flag("--no-deskew", is_compensated,
                   "points with times keep their place, for a recorder that compensated the motion "
                   "[the odometry de-skews points with times]");
}

PoseEstimate estimate_with_progress(Recording& recording, const ScanWindow& window, bool one_thread,
                                    bool quiet) {
  std::optional<Progress> progress;
  const PoseEstimate estimate =
      estimate_poses(recording, window, one_thread, [&](std::size_t done, std::size_t all) {
        if (!progress) progress.emplace(all, "poses", quiet);
        if (done > 0) progress->update(done);
      });
  progress.reset();
  if (!estimate.lost_scans.empty()) {
    print_warning(std::to_string(estimate.lost_scans.size()) + " scans from " +
                  recording.name(estimate.lost_scans.front()) + " to " +
                  recording.name(estimate.lost_scans.back()) +
                  ": no hold, they fit to no scan before, and their motion is that of the scans "
                  "before");
  }
  if (estimate.uncertain_scans > 0) {
    print_warning("the surfaces of " + std::to_string(estimate.uncertain_scans) + " of " +
                  std::to_string(recording.size()) +
                  " scans do not determine the whole motion, as along a corridor: there it is "
                  "that of the scans before");
  }
  return estimate;
}

void add_odometry_command(CLI::App& app) {
  add_command<OdometryFlags>(
      app, "odometry", "Estimate the poses of a recording from its scans",
      "Registers each scan to a map of earlier ones, without what moves. The first scan is the "
      "frame of the poses. Exits with\n3 if it loses track for good, after it has written the "
      "poses before.",
      write_poses);
}

}  // namespace dynains::program
