#include <Eigen/Geometry>
#include <cmath>
#include <iomanip>
#include <iostream>
#include <optional>
#include <string>

#include "command.hpp"
#include "parameter_flags.hpp"
#include "program.hpp"
#include "run/interrupt.hpp"
#include "run/run.hpp"
#include "run/run_plan.hpp"

namespace dynains::program {
namespace {

struct RunFlags {
  explicit RunFlags(CLI::App& command) : recording(command, "recording") {
    add_parameters(command);
    command
        .add_option_function<std::string>(
            "-o,--out", [this](const std::string& out) { settings.outputs.folder = out; },
            "folder for the results; created, must be empty (see --force)")
        ->required()
        ->type_name("FOLDER");
    RunSettings::visit_common(settings, SettingFlags{command});
    RunSettings::visit_more(settings, SettingFlags{command, "More outputs, and memory"});
    command.add_flag("--odometry", odometry,
                     "estimate the poses from the scans, for a recording without poses (see "
                     "`dynains odometry`); also writes them to poses.txt");
    add_compensated_flag(command, is_compensated);
    command.add_flag("-q,--quiet", quiet, "print errors only");
  }

  RecordingFlags recording;
  ParameterValues parameters;  // that flags name
  RunSettings settings;        // recording and configuration are filled in after parsing
  bool odometry = false;
  bool is_compensated = false;
  bool quiet = false;

 private:
  void add_parameters(CLI::App& command) {
    command
        .add_option("--preset", settings.preset,
                    "parameters to start from; offline: for recordings, verdicts wait for 100 "
                    "later scans")
        ->check(CLI::IsMember(preset_names()))
        ->capture_default_str();
    command.add_option("--config", settings.config_file, "config file, see dynains config");
    const DynaInsRemover::Config defaults;
    DynaInsRemover::Config::visit_sections(defaults, [&](const char* group, const auto& section) {
      add_parameter_flags(command, section, group, parameters);
    });
  }
};

/// By preset, config file and flags, in this order of precedence from low to high.
void take_parameters(const ParameterValues& flags, RunSettings& settings) {
  const ParameterValues of_file =
      settings.config_file.empty() ? ParameterValues() : read_config_file(settings.config_file);
  settings.config = DynaInsRemover::Config::preset(settings.preset);
  of_file.apply(settings.config);
  flags.apply(settings.config);
  settings.config.validate();
  settings.find_own_body =
      !has_ranges_of_paper(settings.preset) && !flags.has("min-range") && !of_file.has("min-range");
}

void print_results(const RunOutcome& run) {
  const RunOutputs& outputs = run.outputs;
  const nlohmann::ordered_json &report = run.report, &labels = report["labels"],
                               &ms = report["milliseconds"]["total"];
  const auto number = [](const nlohmann::ordered_json& value) { return value.get<double>(); };
  const double points = number(report["points"]), moving = number(labels["dynamic"]);
  const double kept = number(labels["ground"]) + number(labels["static"]);
  const auto percent = [&](double count) { return points == 0.0 ? 0.0 : 100.0 * count / points; };
  std::cout << std::fixed << std::setprecision(2) << report["scans"] << " scans, "
            << report["points"] << " points: " << percent(moving) << " % moving, " << percent(kept)
            << " % static, " << percent(points - moving - kept)
            << " % not judged\ntime per scan: median " << number(ms["median"]) << " ms, p95 "
            << number(ms["p95"]) << " ms, max " << number(ms["max"])
            << " ms\nwall time: " << number(report["wall_milliseconds"]) / 1000.0 << " s; "
            << 100.0 * number(report["share_outside_pipeline"])
            << " % of it outside the pipeline (reading, writing, starting)\n";
  if (const nlohmann::ordered_json& map = report["static_map"]; !map.is_null()) {
    std::cout << "static map: " << (outputs.folder / outputs.map_name()).string() << " ("
              << map["points"] << " points)\n";
  }
  std::cout << "moving points: " << (outputs.folder / "dynamic_points.ply").string() << " ("
            << labels["dynamic"] << " points)\n"
            << "labels: " << (outputs.folder / "labels").string()
            << "\npicture: " << (outputs.folder / kResultNames.picture).string()
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
  print_results(run);
  if (run.alignment) print_alignment(*run.alignment);
  const RunOutputs& outputs = run.outputs;
  if (!outputs.log.empty()) std::cout << "log: " << outputs.log.string() << std::endl;
  if (!outputs.grid.empty()) print_grid(outputs.grid, run.report["grid"]);
  if (outputs.write_page) {
    std::cout << "page: " << (outputs.folder / kResultNames.page).string() << std::endl;
  }
}

/// The recording, with its poses or those of the odometry.
Recording open(RunFlags& flags, PoseEstimate& estimate) {
  RunSettings& settings = flags.settings;
  if (!flags.odometry) {
    if (flags.is_compensated) throw ConfigError("--no-deskew needs --odometry");
    return flags.recording.open();
  }
  Recording recording = flags.recording.open_without_poses(flags.is_compensated);
  estimate =
      estimate_with_progress(recording, settings.window, settings.outputs.one_thread, flags.quiet);
  settings.outputs.write_poses = true;
  // Commands over the results take the poses from there.
  settings.recording_flags["--poses"] =
      (whole_path(settings.outputs.folder) / kResultNames.poses).string();
  if (recording.is_deskewed()) settings.recording_flags["--deskew"] = "true";
  return recording;
}

void run_as_asked(RunFlags& flags) {
  RunSettings& settings = flags.settings;
  take_parameters(flags.parameters, settings);
  settings.recording = flags.recording.folder;
  settings.recording_as_given = flags.recording.settings.as_given(settings.recording);
  settings.recording_flags = flags.recording.settings.flags;

  check_settings(settings);
  std::optional<Progress> progress;
  RunListener listener;
  listener.warn = print_warning;
  const auto show_progress = [&](const char* unit) {
    return [&, unit](std::size_t done, std::size_t total) {
      if (done == 0) progress.emplace(total, unit, flags.quiet);
      if (done > 0) progress->update(done);
    };
  };
  listener.progress = show_progress("scans");
  listener.revision_progress = show_progress("revised scans");
  PoseEstimate estimate;
  const RunOutcome outcome = run::run(settings, open(flags, estimate), listener);
  progress.reset();

  if (outcome.signal != 0) {
    std::cerr << "dynains: interrupted; the results of " << outcome.report["scans"]
              << " scans stay in " << outcome.outputs.folder.string() << " until the next run"
              << std::endl;
    throw Interrupted{outcome.signal};
  }
  if (!flags.quiet) print_summary(outcome);
  if (estimate.loss) throw LostTrack(*estimate.loss);
}

}  // namespace

void add_run_command(CLI::App& app) {
  add_command<RunFlags>(
      app, "run", "Remove what moves from a recorded sequence",
      "Writes labels/NNNNNN.label (uint32 a point: 251 moving, 9 static, 0 not judged; instance id "
      "above\nthe 16th bit), causes/NNNNNN.cause (uint8 a point: why, see `dynains eval "
      "--errors`), static_map.ply,\ndynamic_points.ply, overview.png (before, after, removed), "
      "report.json and timing.csv. All appear in OUT at once,\nwhen the run is complete; until "
      "then they are in OUT.partial. Ctrl-C ends the run after the scan at hand and exits\nwith "
      "130: the results so far stay in OUT.partial until the next run. Other exit codes: 0; 1 if a "
      "file cannot be read or written; 2 for wrong flags, refused outputs and\nposes that the "
      "scans disagree with; 3 if the odometry loses track: the results of the scans before are "
      "complete.",
      run_as_asked);
}

}  // namespace dynains::program
