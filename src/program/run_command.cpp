#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include "command.hpp"
#include "evaluation_options.hpp"
#include "odometry_command.hpp"
#include "progress.hpp"
#include "recording_options.hpp"
#include "remover_options.hpp"
#include "run/interrupt.hpp"
#include "run/preset.hpp"
#include "run/run.hpp"
#include "run/run_plan.hpp"

namespace dynains::program {
namespace {

struct RunFlags {
  explicit RunFlags(CLI::App& command)
      : recording(command, "recording"), remover(command, "default") {}

  RecordingFlags recording;
  RemoverOptions remover;
  RunSettings settings;  // recording and configuration are filled in after parsing
  bool odometry = false;
  bool is_compensated = false;
  bool quiet = false;
};

void print_results(const RunOutcome& run) {
  const RunOutputs& outputs = run.outputs;
  const auto percent = [&](std::uint64_t count) {
    return run.points == 0 ? 0.0
                           : 100.0 * static_cast<double>(count) / static_cast<double>(run.points);
  };
  const std::uint64_t moving = run.labels[PointLabel::kDynamic];
  const std::uint64_t kept = run.labels[PointLabel::kGround] + run.labels[PointLabel::kStatic];
  std::cout << std::fixed << std::setprecision(2) << run.scans << " scans, " << run.points
            << " points: " << percent(moving) << " % moving, " << percent(kept) << " % static, "
            << percent(run.points - moving - kept) << " % not judged\n"
            << "time per scan: median " << run.time.median << " ms, p95 " << run.time.p95
            << " ms, max " << run.time.max << " ms\n"
            << "wall time: " << run.wall.ms / 1000.0 << " s"
            << "; " << 100.0 * run.wall.outside
            << " % of it outside the pipeline (reading, writing, starting)\n";
  if (run.map_points) {
    std::cout << "static map: " << (outputs.folder / outputs.map_name()).string() << " ("
              << *run.map_points << " points)\n";
  }
  std::cout << "moving points: " << (outputs.folder / "dynamic_points.ply").string() << " ("
            << moving << " points)\n"
            << "labels: " << (outputs.folder / "labels").string()
            << "\npicture: " << (outputs.folder / kOverviewPicture).string()
            << "\nreport: " << (outputs.folder / "report.json").string() << std::endl;
}

void print_alignment(const SessionAlignment& alignment) {
  const Pose& T = alignment.T_city_session;
  const Eigen::Vector3d t = T.translation();
  std::cout << std::fixed << std::setprecision(3) << "aligned with " << alignment.sessions.size()
            << (alignment.sessions.size() == 1 ? " session" : " sessions") << ": moved by ("
            << t.x() << ", " << t.y() << ", " << t.z() << ") m and "
            << Eigen::AngleAxisd(T.linear()).angle() * 180.0 / M_PI << " degrees; residual "
            << alignment.residual << " m, " << std::setprecision(1) << 100.0 * alignment.fitting
            << " % of points at upright surfaces fit" << std::endl;
}

void print_summary(const RunOutcome& run) {
  if (run.was_complete_before) {
    std::cout << run.outputs.folder.string() << ": complete already" << std::endl;
  } else {
    print_results(run);
    if (run.alignment) print_alignment(*run.alignment);
  }
  if (!run.log.empty()) std::cout << "log: " << run.log.string() << std::endl;
  if (!run.page.empty()) std::cout << "page: " << run.page.string() << std::endl;
}

/// The recording, with its poses or those of the odometry.
Recording open(RunFlags& flags, PoseEstimate& estimate) {
  RunSettings& settings = flags.settings;
  if (!flags.odometry) {
    if (flags.is_compensated) throw ConfigError("--no-deskew needs --odometry");
    return flags.recording.open();
  }
  Recording recording = open_with_odometry(flags.recording, flags.is_compensated, settings.window,
                                           settings.one_thread, flags.quiet, estimate);
  settings.poses_are_estimated = true;
  // Commands over the results take the poses from there.
  settings.recording_flags["--poses"] = (whole_path(settings.out) / kEstimatedPoses).string();
  if (recording.is_deskewed()) settings.recording_flags["--deskew"] = "true";
  return recording;
}

void run_as_asked(RunFlags& flags) {
  RunSettings& settings = flags.settings;
  settings.config = flags.remover.config();
  settings.preset = flags.remover.preset_name();
  settings.config_file = flags.remover.config_file();
  settings.find_own_body =
      !has_ranges_of_paper(settings.preset) && !flags.remover.sets("min-range");
  settings.recording = flags.recording.folder();
  settings.recording_as_given = flags.recording.as_given();
  settings.recording_flags = flags.recording.given_flags();

  check_settings(settings);
  std::optional<Progress> progress;
  RunListener listener;
  listener.warn = [](const std::string& text) {
    std::cerr << "dynains: warning: " << text << std::endl;
  };
  const auto tell = [&](const char* unit) {
    return [&, unit](std::size_t done, std::size_t total) {
      if (done == 0) progress.emplace(total, unit, flags.quiet);
      if (done > 0) progress->update(done);
    };
  };
  listener.progress = tell("scans");
  listener.revision_progress = tell("revised scans");
  PoseEstimate estimate;
  const RunOutcome outcome = run(settings, open(flags, estimate), listener);
  progress.reset();

  if (outcome.earlier_results_stay) {
    std::cerr << "dynains: interrupted; the earlier results in " << outcome.outputs.folder.string()
              << " stay as they were" << std::endl;
  } else if (!flags.quiet) {
    print_summary(outcome);
  }
  if (!outcome.complete) throw Interrupted{outcome.signal};
  if (estimate.loss) throw LostTrack(*estimate.loss);
}

}  // namespace

void add_run_command(CLI::App& app) {
  CLI::App& command = *app.add_subcommand("run", "Remove what moves from a recorded sequence");
  auto flags = std::make_shared<RunFlags>(command);
  RunSettings* const options = &flags->settings;
  command
      .add_option("-o,--out", options->out,
                  "folder for the results; created, must be empty (see --force)")
      ->required()
      ->type_name("FOLDER");
  CLI::Option* const force = command.add_flag(
      "--force", options->force,
      "replace the results of an earlier run in --out, and the file of --map, when the new ones "
      "are "
      "complete: until then the earlier ones stay. A folder without results is refused");
  command
      .add_flag("--resume", options->resume,
                "complete a run with the same flags that was interrupted or killed, if --out holds "
                "one; nothing to do if it is complete. It begins with the first scan again, for "
                "verdicts depend on earlier scans")
      ->excludes(force);
  add_window_options(command, options->window);
  command
      .add_option("--map", options->map,
                  "static map, .ply, .pcd or .las [static_map.ply in the folder of --out]")
      ->type_name("FILE");
  command
      .add_option("--passes", options->passes,
                  "2: after the last scan, scans of the whole recording remove what came or went "
                  "at any time, and bring back what stands; 1: the verdicts of the stream [2; 1 "
                  "with --decision window]")
      ->check(CLI::Range(1, 2))
      ->type_name("1|2");
  command
      .add_option_function<std::string>(
          "--static",
          [options](const std::string& value) {
            options->static_policy = value == "last" ? StaticPolicy::kLast : StaticPolicy::kAlways;
          },
          "with two passes: what never came or went, or what stands at last, as a car that has "
          "parked [always]")
      ->check(CLI::IsMember({"always", "last"}))
      ->type_name("always|last");
  const char* const kOutputs = "More outputs, and memory";
  command
      .add_flag("--map-attributes", options->map_attributes,
                "the map holds intensity, time and label of its points, as far as scans have "
                "them; a map of LAS holds its attributes always")
      ->group(kOutputs);
  command
      .add_option("--crs", options->crs,
                  "coordinate reference system of the poses, for a map of LAS [none]")
      ->type_name("EPSG:N")
      ->group(kOutputs);
  command
      .add_option("--update", options->update,
                  "also adds the session to this map of many sessions, a folder (see `dynains "
                  "map`), when the run is complete")
      ->type_name("CITY")
      ->group(kOutputs);
  command
      .add_option("--session", options->session,
                  "name of the session in --update [name of the recording]")
      ->type_name("NAME")
      ->group(kOutputs);
  command
      .add_option("--session-begin", options->session_begin,
                  "time by which sessions are ordered [time of the first scan]")
      ->type_name("S")
      ->group(kOutputs);
  command
      .add_flag("--align", options->align,
                "moves the session into the frame of the map in --update: registers scans to its "
                "points from a start that is within 2 m and 5 degrees; ends with exit code 2 "
                "before anything is written if they do not fit")
      ->group(kOutputs);
  command
      .add_option("--align-start", options->align_start,
                  "start of --align, pose of the session's frame in that of the map: \"x y z qx qy "
                  "qz qw\", 12 or 16 numbers of a matrix, or a file [identity]")
      ->type_name("T")
      ->group(kOutputs);
  const auto add_output = [&](const char* flag, bool& value, const char* help) {
    command.add_flag(flag, value, help)->group(kOutputs);
  };
  add_output("--write-online", options->write_online,
             "also write the verdicts without latency, to the folder online");
  add_output("--write-clean", options->write_clean,
             "also write every scan without its moving points, to the folder clean, in the form it "
             "has in SEQ");
  command
      .add_option("--write-log", options->log,
                  "also write the log of SEQ again, as a file or folder of its kind: all messages "
                  "as they are, except that clouds of the topic have no moving points")
      ->type_name("FILE")
      ->group(kOutputs);
  add_output("--mark", options->mark_log,
             "clouds of --write-log keep all points and get a field `label` (uint8): 251 moving, "
             "9 static, 0 not judged");
  command
      .add_option_function<std::string>(
          "--not-judged",
          [options](const std::string& value) { options->drop_not_judged = value == "drop"; },
          "points of --write-clean and --write-log that are not judged, as too near or too far "
          "[keep]; the map never has them")
      ->check(CLI::IsMember({"keep", "drop"}))
      ->type_name("keep|drop")
      ->group(kOutputs);
  add_output("--write-beliefs", options->write_beliefs,
             "also write the probability that a point moves, to the folder beliefs");
  add_output("--write-mcap", options->write_mcap,
             "also write verdicts.mcap, a log of ROS 2 with all scans, their labels, instances, "
             "beliefs and causes, the poses and the map");
  command
      .add_flag("--one-thread", options->one_thread,
                "after the check of poses, the run works, reads and writes in one thread, for "
                "machines on which many runs use "
                "all cores")
      ->group(kOutputs);
  command.add_flag("--view", options->view,
                   "also write the page view.html, which shows the results (see `dynains view`), "
                   "and the folder beliefs");
  command.add_flag(
      "--accept-poses", options->accept_poses,
      "run even if the scans disagree with the poses, which else ends the command with "
      "exit code 2 before anything is written");
  command.add_flag("--odometry", flags->odometry,
                   "estimate the poses from the scans, for a recording without poses (see `dynains "
                   "odometry`); also writes them to poses.txt");
  add_compensated_flag(command, flags->is_compensated);
  command.add_flag("-q,--quiet", flags->quiet, "print errors only");
  command.footer(
      "Writes labels/NNNNNN.label (uint32 a point: 251 moving, 9 static, 0 not judged; instance id "
      "above\nthe 16th bit), causes/NNNNNN.cause (uint8 a point: why, see `dynains eval "
      "--errors`), "
      "static_map.ply,\ndynamic_points.ply, overview.png (before, after, removed), report.json and "
      "timing.csv. Each file appears whole or "
      "not at all; report.json says\n\"complete\": false until the end. Ctrl-C ends the run after "
      "the scan at hand, writes what is there and exits\nwith 130. Other exit codes: 0; 1 if a "
      "file "
      "cannot be read or written; 2 for wrong flags, refused outputs and\nposes that the scans "
      "disagree with; 3 if the odometry loses track: the results of the scans before are "
      "complete.");
  command.callback([flags] { run_as_asked(*flags); });
}

}  // namespace dynains::program
