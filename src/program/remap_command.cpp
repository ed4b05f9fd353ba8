#include <cmath>
#include <filesystem>
#include <functional>
#include <iostream>
#include <optional>
#include <string>
#include <vector>

#include "command.hpp"
#include "dynains/city/city.hpp"
#include "dynains/city/session_writer.hpp"
#include "dynains/errors.hpp"
#include "dynains/map/static_map_accumulator.hpp"
#include "dynains/pose.hpp"
#include "parameter_flags.hpp"
#include "program.hpp"
#include "run/interrupt.hpp"
#include "run/output/output_folder.hpp"
#include "run/recorded_scans.hpp"
#include "run/run_plan.hpp"
#include "run/verdict_files.hpp"
#include "run/write_view.hpp"

namespace dynains::program {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// Name of the map in the folder of the run.
constexpr const char* kRemappedMap = "static_map_remapped.ply";

/// Flags of `dynains remap`.
struct RemapOptions {
  explicit RemapOptions(CLI::App& command)
      : sequence(command, "recording of the run"),
        run(command, "OUT", "folder of the results of dynains run over SEQ") {
    const SettingFlags flags{command};
    flags(plain_text("map", map, "FILE",
                     "static map, .ply or .pcd [static_map_remapped.ply in OUT]"));
    flags(plain_text("map_voxel", map_voxel, "M",
                     "resolution of the static map; 0 keeps all points [of the run]"));
    flags(plain_text("update", update, "CITY",
                     "also replaces the session of the run in this map of many sessions: its "
                     "points and references move to the corrected poses"));
    flags(plain_text("session", session, "NAME", "name of the session in --update [of the run]"));
    command.add_flag("--force", force, "replace the file of --map if it exists");
    command.add_flag("-q,--quiet", quiet, "print errors only");
  }

  RecordingFlags sequence;
  Argument run;
  std::string map;
  std::string update;     // folder of a map of many sessions; empty: none
  std::string session;    // its name there; empty: that of the run
  std::string map_voxel;  // m; empty: that of the run
  bool force = false;
  bool quiet = false;
};

/// The recording as the run read it, whose points are in the frame of the world: the poses of the
/// run lead back to the frame of the sensor.
Recording open_original(const RecordingFlags& flags, const ResultFolder& out) {
  RecordingOptions original = flags.settings.checked();
  original.poses.clear();
  original.pose_topic.clear();
  original.pose_frame.clear();
  original.time_offset = 0.0;
  original.convention.T_body_sensor.setIdentity();
  original.frame = PointFrame::kWorld;
  Recording recording(flags.folder, original);
  const std::vector<std::size_t> scans = scans_of_run(out, recording);
  const std::string now = pose_fingerprint(recording, {scans.front(), scans.back()});
  if (now != out.field<std::string>("/request/poses_and_times")) {
    throw IoError(recording.folder().string() +
                  ": points are in the frame of the world, and the poses of the recording are not "
                  "those of the run, which lead back to the frame of the sensor");
  }
  return recording;
}

/// Which points `labels`, of `file`, call static. Throws IoError for labels of another scan, which
/// show by points that are not finite.
std::vector<std::uint8_t> static_points(const PointBuffer& points,
                                        const std::vector<PointLabel>& labels,
                                        const fs::path& file) {
  std::vector<std::uint8_t> keep;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    keep.push_back(is_static(labels[i]) ? 1 : 0);
    if (keep.back() == 0 || std::isfinite(points.x[i] + points.y[i] + points.z[i])) continue;
    throw IoError(file.string() +
                  ": has static points whose coordinates are not finite; expected labels of a run "
                  "over these scans");
  }
  return keep;
}

/// Builds the map of the verdicts of the run in `folder` under the poses of `corrected`, and adds
/// the scans to `session`, unless it is null. Throws Interrupted.
StaticMapAccumulator build_map(const Recording& corrected, const Recording& original,
                               const std::vector<std::size_t>& scans, const fs::path& folder,
                               const StaticMapAccumulator::Config& config, bool quiet,
                               SessionWriter* session) {
  StaticMapAccumulator map(config);
  const VerdictFiles files(folder);
  RecordedScan scan;
  PointBuffer points;
  VerdictArrays arrays;
  Progress progress(scans.size(), "scans", quiet);
  for (std::size_t k = 0; k < scans.size(); ++k) {
    InterruptGuard::check();
    const std::size_t i = scans[k];
    original.read_scan(i, scan);
    copy_points(scan, points);
    files.read(original.name(i), scan.size()).unpack(scan, arrays);
    const ScanVerdict verdict =
        arrays.verdict({i, original.time(i), orthonormalized(corrected.T_world_sensor(i))});
    const std::vector<std::uint8_t> keep =
        static_points(points, arrays.labels, files.file(original.name(i)));
    map.insert(points, keep, verdict.T_world_sensor);
    if (session != nullptr) {
      const auto labels =
          original.has_labels() ? original.read_labels(i) : std::vector<std::uint32_t>();
      session->add(points, verdict.labels, labels, verdict.T_world_sensor,
                   static_cast<std::uint32_t>(i));
    }
    progress.update(k + 1);
  }
  if (session != nullptr) session->prepare();
  return map;
}

/// The session that --update replaces.
SessionRequest session_of(const RemapOptions& options, const ResultFolder& out,
                          const std::string& fingerprint) {
  std::string name = options.session;
  if (name.empty()) {
    const auto of_run =
        json_field<std::string>(out.marker_path(), out.marker(), "/request/session");
    if (!of_run) throw ConfigError("the run has added no session; name one by --session");
    name = *of_run;
  }
  return reposed_session(whole_path(options.update), name, fingerprint);
}

/// Where the map goes. Throws ConfigError.
fs::path target_of(const RemapOptions& options, const fs::path& folder) {
  const fs::path inside = folder / kRemappedMap;
  if (options.map.empty()) return inside;
  for (const fs::path& name : {fs::path(options.map), whole_path(options.map)}) {
    if (is_point_file(name) && !is_las(name)) continue;
    throw ConfigError("--map " + options.map + ": expected a name that ends in .ply or .pcd");
  }
  fs::path path = map_path(options.map, folder);
  if (path.parent_path() != folder || path == inside) return path;
  throw ConfigError("--map " + options.map + ": in the folder of the run, the map is " +
                    kRemappedMap);
}

/// Puts the map in place in the folder of the run, whose report describes it. Calls
/// `publish_more()` when all bytes are on the disk and only names are left to change.
void add_to_run(ResultFolder& out, OutputFile& map, const Json& description,
                const std::function<void()>& publish_more) {
  constexpr const char* kField = "remapped_map";
  Json report = out.marker();
  report.erase(kField);
  map.put_in_place([&] {
    out.mark_with(report, map.path());
    publish_more();
  });
  report = out.marker();
  report[kField] = description;
  out.mark_with(report, map.target());
}

/// The flags that state how the points of the run are stored.
Json point_flags(const ResultFolder& out) {
  Json flags = Json::object();
  const Json of_run = out.marker().value("sequence_flags", Json::object());
  for (const char* const flag :
       {"--point-units", "--point-time-unit", "--bin-columns", "--self-box"}) {
    if (of_run.contains(flag)) flags[flag] = of_run[flag];
  }
  return flags;
}

void remap(RemapOptions& options) {
  ResultFolder out = open_finished_run(options.run.value);
  const bool has_points_in_world = out.field<bool>("/request/points_in_world");
  StaticMapAccumulator::Config config;
  config.map_voxel = out.field<double>("/configuration/map_voxel");
  ParameterValues values;
  if (!options.map_voxel.empty()) values.set("map-voxel", options.map_voxel, "--map-voxel");
  values.apply(config);
  if (options.update.empty() && !options.session.empty()) {
    throw ConfigError("--session needs --update CITY");
  }
  options.sequence.settings.complete(point_flags(out));
  RecordingOptions with_new_poses = options.sequence.settings.checked();
  with_new_poses.frame = has_points_in_world ? PointFrame::kWorld : PointFrame::kSensor;
  const Recording corrected(options.sequence.folder, with_new_poses);
  const std::vector<std::size_t> scans = scans_of_run(out, corrected);
  for (const std::size_t i : scans) check_pose(corrected, i);
  std::optional<Recording> original;
  if (has_points_in_world) original.emplace(open_original(options.sequence, out));
  const ScanRange range{scans.front(), scans.back()};
  InputFiles inputs(corrected);
  if (original) inputs.add(*original);
  const fs::path folder = whole_path(out.path()), target = target_of(options, folder);
  const bool is_inside = target.parent_path() == folder;
  OutputFile file = is_inside ? OutputFile(out, kRemappedMap)
                              : OutputFile(target, existing_by(options.force), inputs);

  const InterruptGuard interrupt;
  const std::string fingerprint = pose_fingerprint(corrected, range);
  std::optional<SessionWriter> session;
  if (!options.update.empty()) {
    const SessionRequest request = session_of(options, out, fingerprint);
    session.emplace(City::open_or_make(request.city, request.grid), request.info,
                    SessionWriter::Mode::kReplace);
  }
  const StaticMapAccumulator map =
      build_map(corrected, original ? *original : corrected, scans, out.path(), config,
                options.quiet, session ? &*session : nullptr);
  write_points(file, map_columns(corrected, range, false), {}, [&](const AddPoint& add) {
    map.for_each([&](const Eigen::Vector3d& point) { add({point}); });
  });
  const auto commit = [&] {
    if (session) session->commit();
  };
  const Json description = {{"file", kRemappedMap},
                            {"points", map.size()},
                            {"map_voxel", map.config().map_voxel},
                            {"poses_and_times", fingerprint}};
  is_inside ? add_to_run(out, file, description, commit) : file.put_in_place(commit);
  if (options.quiet) return;
  std::cout << scans.size() << " scans, static map: " << target.string() << " (" << map.size()
            << " points)" << std::endl;
}

}  // namespace

void add_remap_command(CLI::App& app) {
  add_command<RemapOptions>(
      app, "remap", "Build the static map of a finished run again, under corrected poses",
      "The verdicts of the run stay: they were made between neighbouring scans, and a correction "
      "moves these\ntogether. The map is built from the points that OUT/labels calls static, in "
      "the order of the scans and of\ntheir points. Nothing in OUT changes but the map and its "
      "entry in report.json; earlier maps of remap are\nreplaced.",
      remap);
}

}  // namespace dynains::program
