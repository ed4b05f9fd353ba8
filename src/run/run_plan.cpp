#include "run_plan.hpp"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "dynains/city/city.hpp"
#include "dynains/city/session_aligner.hpp"
#include "dynains/errors.hpp"
#include "dynains/io/point_file.hpp"
#include "dynains/io/trajectory.hpp"
#include "dynains/pose.hpp"
#include "dynains/sensor/own_body.hpp"
#include "io/fingerprint.hpp"
#include "io/points/finite_points.hpp"
#include "recorded_scans.hpp"
#include "remarks/cloud_remarks.hpp"
#include "write_grid.hpp"

namespace dynains::run {
namespace {

namespace fs = std::filesystem;

nlohmann::ordered_json parameters_of(const DynaInsRemover::Config& config) {
  nlohmann::ordered_json json;
  DynaInsRemover::Config::visit(
      config, [&](const auto& parameter) { json[parameter.name] = plain_value(parameter.value); });
  return json;
}

/// Finite points of one sensor of a scan, m, in its frame.
PointBuffer points_of_sensor(const Recording& recording, const RecordedScan& scan,
                             std::size_t sensor) {
  if (recording.sensors().empty()) return finite_points(scan);
  const Pose T_sensor_cloud = recording.sensors()[sensor].inverse();
  RecordedScan own;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    if ((scan.sensor.empty() ? 0U : scan.sensor[i]) != sensor) continue;
    const Eigen::Vector3f p = (T_sensor_cloud * scan.point(i).position).cast<float>();
    own.xyzi.insert(own.xyzi.end(), {p.x(), p.y(), p.z(), 0.0F});
  }
  return finite_points(own);
}

/// The largest OwnBody::min_range() of the sensors in a sample of the scans of `range`, m, at most
/// `otherwise`; that value if the scans are too few. A body that reaches farther is judged like
/// other things; otherwise the road around it would be lost. Throws IoError.
double own_body_range(const Recording& recording, const ScanRange& range, double otherwise) {
  const std::size_t count = std::min<std::size_t>(24, range.size());
  const std::size_t sensors = std::max<std::size_t>(1, recording.sensors().size());
  std::vector<std::vector<PointBuffer>> scans(sensors);
  std::vector<std::vector<Pose>> poses(sensors);
  RecordedScan scan;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i = range.first + (count == 1 ? 0 : k * (range.size() - 1) / (count - 1));
    recording.read_scan(i, scan);
    for (std::size_t sensor = 0; sensor < sensors; ++sensor) {
      scans[sensor].push_back(points_of_sensor(recording, scan, sensor));
      poses[sensor].push_back(recording.T_world_sensor(i));
      if (!recording.sensors().empty()) {
        poses[sensor].back() = poses[sensor].back() * recording.sensors()[sensor];
      }
    }
  }
  double range_of_bodies = 0.0;
  for (std::size_t sensor = 0; sensor < sensors; ++sensor) {
    const OwnBody body = estimate_own_body(scans[sensor], poses[sensor]);
    if (!body.known) return otherwise;
    range_of_bodies = std::max(range_of_bodies, body.min_range());
  }
  return std::min(range_of_bodies, otherwise);
}

/// Whether `path` lies in a folder of results. Both are by whole_path().
bool is_in_results(const fs::path& path, const fs::path& out) {
  return std::mismatch(out.begin(), out.end(), path.begin(), path.end()).first == out.end();
}

/// Throws ConfigError.
void complete_map(const DynaInsRemover::Config& config, RunOutputs& outputs) {
  if (!config.build_map) {
    if (!outputs.map.empty()) throw ConfigError("--map needs --build-map true");
    if (outputs.map_attributes) throw ConfigError("--map-attributes needs --build-map true");
  } else {
    const fs::path out = whole_path(outputs.folder);
    outputs.map =
        outputs.map.empty() ? out / "static_map.ply" : map_path(outputs.map.string(), out);
  }
  if (outputs.has_las_map()) outputs.map_attributes = true;
  // A map of all points has attributes by voxels of 1 cm.
  outputs.map_voxel = std::max(config.map.map_voxel, 0.01);
  if (outputs.crs.empty()) return;
  if (!outputs.has_las_map()) throw ConfigError("--crs needs --map FILE.las");
  if (outputs.crs.find('[') == std::string::npos) {
    throw ConfigError(
        "--crs: expected WKT, which `projinfo -q -o WKT1:GDAL EPSG:N` prints, found " +
        outputs.crs);
  }
}

/// Throws ConfigError unless `whole`, by whole_path(), lies outside of the folder of the results.
void take_outside(const std::string& flag, const fs::path& whole, const RunOutputs& outputs,
                  fs::path& file) {
  if (is_in_results(whole, whole_path(outputs.folder))) {
    throw ConfigError(flag + ' ' + file.string() + ": choose a place outside of --out");
  }
  file = whole;
}

/// Throws ConfigError.
void complete_log_and_grid(RunOutputs& outputs) {
  if (!outputs.log.empty()) {
    take_outside("--write-log", whole_path(outputs.log), outputs, outputs.log);
  } else if (outputs.mark_log) {
    throw ConfigError("--mark needs --write-log");
  }
  if (outputs.grid.empty()) return;
  outputs.grid_config.validate();
  take_outside("--grid", grid_file(outputs.grid), outputs, outputs.grid);
  outputs.grid_image = grid_image(outputs.grid);
}

/// Outputs of the run. Throws ConfigError.
RunOutputs outputs_of(const RunSettings& settings) {
  RunOutputs outputs = settings.outputs;
  complete_map(settings.config, outputs);
  complete_log_and_grid(outputs);
  if (settings.passes == 1 && settings.static_policy != StaticPolicy::kAlways) {
    throw ConfigError(
        "--static last needs --passes 2: one pass does not know what is there at the end");
  }
  outputs.write_tracks = settings.config.objects;
  // The second pass reads the beliefs of the first one.
  if (outputs.write_page || (settings.passes > 1 && outputs.map_attributes)) {
    outputs.write_beliefs = true;
  }
  return outputs;
}

/// Name of the session of a recording: that of its folder or file.
std::string session_name(const RunSettings& settings) {
  if (!settings.session.empty()) return settings.session;
  const fs::path recording = whole_path(settings.recording);
  return fs::is_directory(recording) ? recording.filename().string() : recording.stem().string();
}

/// Throws ConfigError.
SessionRequest session_request(const RunSettings& settings, const Recording& sequence,
                               const ScanRange& range,
                               const nlohmann::ordered_json& configuration) {
  SessionRequest request;
  if (!settings.align_start.empty() && !settings.align) {
    throw ConfigError("--align-start needs --align");
  }
  if (settings.update.empty()) {
    if (!settings.session.empty()) throw ConfigError("--session needs --update CITY");
    if (settings.session_begin) throw ConfigError("--session-begin needs --update CITY");
    if (settings.align) throw ConfigError("--align needs --update CITY");
    return request;
  }
  request.city = whole_path(settings.update);
  const fs::path out = whole_path(settings.outputs.folder);
  if (out == request.city || out.parent_path() == request.city) {
    throw ConfigError("--update " + settings.update +
                      ": is a map of many sessions; choose a folder for --out outside of it");
  }
  request.grid.map_voxel = settings.config.map.map_voxel;
  request.grid.validate();
  request.info.name = session_name(settings);
  if (!is_session_name(request.info.name)) {
    throw ConfigError("\"" + request.info.name +
                      "\" cannot name a session: give one of letters, digits, '.', '_' and '-' by "
                      "--session NAME");
  }
  request.info.begin = settings.session_begin.value_or(sequence.time(range.first));
  request.info.recording = settings.recording;
  request.info.fingerprint = pose_fingerprint(sequence, range);
  request.info.config = configuration.dump();
  request.info.evidence = settings.config.evidence;
  if (settings.align) {
    request.T_city_start =
        settings.align_start.empty() ? Pose::Identity() : read_extrinsic(settings.align_start);
  }
  return request;
}

/// Files in the folder of a run over these scans.
OutputListing listing_of(const RunOutputs& outputs, const Recording& recording,
                         const ScanRange& range) {
  OutputListing listing;
  listing.files = {"timing.csv", "dynamic_points.ply", kResultNames.picture};
  if (!outputs.map.empty() && !outputs.has_outside_map())
    listing.files.insert(listed_name(outputs.map_name()));
  if (outputs.write_tracks) listing.files.insert(kResultNames.tracks);
  if (outputs.write_poses) listing.files.insert(kResultNames.poses);
  if (outputs.write_page) listing.files.insert(kResultNames.page);
  listing.folders = {{"labels", ".label"}, {"causes", ".cause"}};
  if (outputs.write_beliefs) listing.folders["beliefs"] = ".belief";
  if (outputs.write_online) listing.folders["online"] = ".label";
  if (outputs.write_clean) listing.folders["clean"] = clean_extension(recording.format());
  for (std::size_t i = range.first; i <= range.last; ++i)
    listing.scans.insert(listed_name(recording.name(i)));
  return listing;
}

/// Whether a session was aligned as the request asks for.
bool has_alignment(const SessionRequest& request, const SessionInfo& session) {
  if (session.alignment.has_value() != request.T_city_start.has_value()) return false;
  return !session.alignment ||
         session.alignment->T_city_start.matrix() == request.T_city_start->matrix();
}

}  // namespace

bool SessionRequest::is_fulfilled() const {
  if (!std::filesystem::exists(city)) return false;
  const City opened = City::open_or_make(city, grid);
  const std::vector<SessionInfo>& sessions = opened.sessions();
  return std::any_of(sessions.begin(), sessions.end(), [&](const SessionInfo& session) {
    return session.name == info.name && session.fingerprint == info.fingerprint &&
           session.begin == info.begin && has_alignment(*this, session) &&
           session.config == info.config;
  });
}

SessionRequest reposed_session(const std::filesystem::path& folder, const std::string& name,
                               const std::string& fingerprint) {
  const City city(folder);
  SessionRequest request{folder, city.sessions()[city.number_of(name)], city.grid(), {}};
  request.info.fingerprint = fingerprint;
  request.info.alignment.reset();
  return request;
}

SessionRequest aligned(SessionRequest request, const Recording& recording, const ScanRange& range) {
  if (!request.T_city_start) return request;
  if (!std::filesystem::exists(request.city)) {
    throw ConfigError(request.city.string() +
                      ": there is no map to align with; add its first session without --align");
  }
  SessionAligner aligner(City::open_or_make(request.city, request.grid));
  RecordedScan scan;
  PointBuffer points;
  const std::size_t count = std::min(range.size(), SessionAligner::kMaxScans);
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i =
        range.first + k * (range.size() - 1) / std::max<std::size_t>(count - 1, 1);
    recording.read_scan(i, scan);
    copy_points(scan, points);
    aligner.add(points, orthonormalized(recording.T_world_sensor(i)));
  }
  request.info.alignment = aligner.align(*request.T_city_start);
  return request;
}

bool RunOutputs::has_outside_map() const {
  return !map.empty() && map.parent_path() != whole_path(folder);
}

std::string RunOutputs::map_name() const {
  return (has_outside_map() ? map : map.filename()).string();
}

ScanRange select_scans(const Recording& sequence, const ScanWindow& window) {
  const auto number = [&](std::size_t i) { return sequence.number(i); };
  ScanRange range = whole_of(sequence);
  while (range.first <= range.last && window.start && number(range.first) < *window.start) {
    ++range.first;
  }
  while (range.last > range.first && window.end && number(range.last) > *window.end) --range.last;
  const bool none = range.first > range.last || (window.end && number(range.last) > *window.end);
  if (none) {
    throw ConfigError("--start and --end leave no scan of " + sequence.name(0) + " to " +
                      sequence.name(sequence.size() - 1));
  }
  return range;
}

fs::path map_path(const std::string& name, const fs::path& out) {
  fs::path map = whole_path(name);
  if (!is_point_file(name) || !is_point_file(map)) {
    throw ConfigError("--map " + name + ": expected a name that ends in .ply, .pcd or .las");
  }
  if (map == out / "dynamic_points.ply") {
    throw ConfigError("--map " + name + ": the moving points go there");
  }
  if (is_in_results(map, out) && map.parent_path() != out) {
    throw ConfigError("--map " + name + ": other results go into that folder");
  }
  return map;
}

std::string pose_fingerprint(const Recording& recording, const ScanRange& range) {
  Fingerprint result;
  for (std::size_t i = range.first; i <= range.last; ++i) {
    result.add(recording.name(i));
    result.add(recording.time(i));
    const Eigen::Matrix4d pose = recording.T_world_sensor(i).matrix();
    for (Eigen::Index k = 0; k < pose.size(); ++k) result.add(pose(k));
  }
  return result.text();
}

void check_settings(const RunSettings& settings) { outputs_of(settings); }

RunPlan make_plan(const RunSettings& given, Recording sequence) {
  RunSettings settings = given;
  DynaInsRemover::Config& config = settings.config;
  RunOutputs& outputs = settings.outputs;
  outputs = outputs_of(given);
  const ScanRange range = select_scans(sequence, settings.window);
  // A broken file or pose is noticed before anything is written.
  count_points(sequence, range);
  for (std::size_t i = range.first; i <= range.last; ++i) check_pose(sequence, i);
  take_sensors(sequence, config);
  if (settings.find_own_body) {
    config.min_range = own_body_range(sequence, range, config.min_range);
    config.validate();
  }
  const nlohmann::ordered_json configuration = parameters_of(config);
  nlohmann::ordered_json request = {{"poses_and_times", pose_fingerprint(sequence, range)},
                                    {"points_in_world", sequence.frame() == PointFrame::kWorld},
                                    {"deskew", sequence.is_deskewed()}};
  SessionRequest session = session_request(settings, sequence, range, configuration);
  if (!session.city.empty()) {
    request["update"] = session.city.string();
    request["session"] = session.info.name;
    if (session.T_city_start) request["align_start"] = extrinsic_text(*session.T_city_start);
  }
  request["passes"] = settings.passes;
  if (!outputs.log.empty()) {
    request["write_log"] = outputs.log.string();
    request["mark"] = outputs.mark_log;
  }
  if (!outputs.grid.empty()) request["grid"] = outputs.grid.string();
  if (settings.static_policy == StaticPolicy::kLast) request["static"] = "last";
  OutputListing listing = listing_of(outputs, sequence, range);
  InputFiles inputs(sequence, settings.config_file);
  inputs.add(settings.align_start);
  return {std::move(settings), std::move(sequence), range,
          std::move(listing),  std::move(inputs),   configuration,
          std::move(request),  std::move(session)};
}

}  // namespace dynains::run
