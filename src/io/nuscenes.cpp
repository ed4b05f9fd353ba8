// Sweeps of the LiDAR in a folder of nuScenes, by its tables.
#include <algorithm>
#include <fstream>
#include <set>
#include <unordered_map>

#include "byte_reader.hpp"
#include "dynains/io/trajectory.hpp"
#include "failure.hpp"
#include "io/poses/kitti_files.hpp"
#include "scan_files.hpp"
#include "scan_reader.hpp"
#include "text.hpp"

#if defined(DYNAINS_HAS_JSON)
#include <nlohmann/json.hpp>
#endif

namespace dynains {
namespace {

namespace fs = std::filesystem;

#if defined(DYNAINS_HAS_JSON)

using Json = nlohmann::json;

/// A row of a table: an object.
class TableRow {
 public:
  TableRow(const fs::path& table, std::size_t index, const Json& values)
      : table_(table), index_(index), values_(values) {}

  std::string text(const char* name) const {
    return value(name, &Json::is_string, "a text").get<std::string>();
  }
  double number(const char* name) const {
    return value(name, &Json::is_number, "a number").get<double>();
  }
  std::vector<double> list(const char* name, std::size_t size) const {
    const std::string expected = std::to_string(size) + " numbers";
    const Json& list = value(name, &Json::is_array, expected);
    const auto is_number = [](const Json& one) { return one.is_number(); };
    if (list.size() != size || !std::all_of(list.begin(), list.end(), is_number)) {
      fail("expected " + expected + " \"" + name + '"');
    }
    return list.get<std::vector<double>>();
  }
  /// `translation` and `rotation` (w x y z).
  Pose pose() const {
    const std::vector<double> p = list("translation", 3);
    const std::vector<double> q = list("rotation", 4);
    const auto pose = rigid_pose({p[0], p[1], p[2]}, {q[0], q[1], q[2], q[3]});
    if (!pose) fail("expected a finite translation and a quaternion of length 1");
    return *pose;
  }
  [[noreturn]] void fail(const std::string& what) const {
    dynains::fail(table_, "row " + std::to_string(index_) + ": " + what);
  }

 private:
  const Json& value(const char* name, bool (Json::*is_valid)() const noexcept,
                    const std::string& expected) const {
    const auto found = values_.find(name);
    if (found != values_.end() && ((*found).*is_valid)()) return *found;
    fail("expected " + expected + " \"" + name + '"');
  }

  const fs::path& table_;
  std::size_t index_;
  const Json& values_;
};

/// Calls `take(row)` for each row of a table, an array of objects, of which one is in memory.
template <class Take>
void read_table(const fs::path& table, Take&& take) {
  std::ifstream file = open_input(table);
  std::size_t count = 0;
  const auto take_row = [&](int depth, Json::parse_event_t event, const Json& parsed) {
    if (event != Json::parse_event_t::object_end || depth != 1) return true;
    take(TableRow(table, count++, parsed));
    return false;
  };
  try {
    const Json rest = Json::parse(file, take_row);  // without the rows
  } catch (const Json::parse_error& error) {
    fail_at_byte(table, error.byte, "expected JSON, an array of objects");
  } catch (const Json::out_of_range&) {  // without its place
    fail(table, "expected numbers within the range of double");
  }
}

struct SweepRow {
  std::string file, sample, ego_pose, sensor;
  double time = 0.0;
};

std::vector<SweepRow> read_sample_data(const fs::path& table) {
  std::vector<SweepRow> sweeps;
  read_table(table, [&](const TableRow& row) {
    const std::string file = row.text("filename");
    if (scan_format_of(file) != ScanFormat::kNuScenes) return;
    sweeps.push_back({file, row.text("sample_token"), row.text("ego_pose_token"),
                      row.text("calibrated_sensor_token"), to_seconds(row.number("timestamp"))});
  });
  if (sweeps.empty()) fail(table, "expected sweeps of a LiDAR (.pcd.bin), found none");
  return sweeps;
}

/// Keeps the sweeps of one scene.
void choose_scene(const fs::path& tables, const std::string& wanted, std::vector<SweepRow>& sweeps,
                  std::vector<fs::path>& read) {
  const fs::path scenes = tables / "scene.json";
  const fs::path samples = tables / "sample.json";
  if (!is_file(scenes) || !is_file(samples)) {
    if (!wanted.empty()) fail(scenes, "expected this file and sample.json for the name of a scene");
    return;
  }
  read.push_back(scenes);
  read.push_back(samples);
  std::unordered_map<std::string, std::string> name_of_scene;
  read_table(scenes,
             [&](const TableRow& row) { name_of_scene[row.text("token")] = row.text("name"); });
  std::unordered_map<std::string, std::string> name_of_sample;
  read_table(samples, [&](const TableRow& row) {
    name_of_sample[row.text("token")] = name_of_scene[row.text("scene_token")];
  });
  std::set<std::string> names;
  for (const SweepRow& sweep : sweeps) names.insert(name_of_sample[sweep.sample]);
  if (wanted.empty() ? names.size() > 1 : names.count(wanted) == 0) {
    fail(scenes, "expected one scene, by --nuscenes-scene; found " +
                     text::listed({names.begin(), names.end()}));
  }
  const std::string name = wanted.empty() ? *names.begin() : wanted;
  sweeps.erase(
      std::remove_if(sweeps.begin(), sweeps.end(),
                     [&](const SweepRow& sweep) { return name_of_sample[sweep.sample] != name; }),
      sweeps.end());
}

using Poses = std::unordered_map<std::string, Pose>;

/// The poses of a table whose tokens are `wanted`.
Poses read_poses_by_token(const fs::path& table, const std::set<std::string>& wanted) {
  Poses poses;
  read_table(table, [&](const TableRow& row) {
    const std::string token = row.text("token");
    if (wanted.count(token) > 0) poses[token] = row.pose();
  });
  for (const std::string& token : wanted) {
    if (poses.count(token) == 0) fail(table, "expected a row with the token " + token);
  }
  return poses;
}

#endif

}  // namespace

std::optional<fs::path> nuscenes_tables(const fs::path& folder) {
  if (is_file(folder / "sample_data.json")) return folder;
  for (const fs::path& path : paths_in(folder)) {
    if (path.filename().string().rfind("v1.0", 0) == 0 && is_file(path / "sample_data.json")) {
      return path;
    }
  }
  return std::nullopt;
}

#if defined(DYNAINS_HAS_JSON)

void read_nuscenes(RecordingContents& r, const fs::path& tables) {
  if (!r.options.times.empty()) {
    fail(r.options.times, "expected no file of times: " + tables.string() + " has times");
  }
  const fs::path data = tables / "sample_data.json";
  r.files = {data, tables / "ego_pose.json", tables / "calibrated_sensor.json"};
  std::vector<SweepRow> rows = read_sample_data(data);
  std::set<std::string> ego_poses, sensors;
  choose_scene(tables, r.options.scene, rows, r.files);
  std::stable_sort(rows.begin(), rows.end(),
                   [](const SweepRow& a, const SweepRow& b) { return a.time < b.time; });
  for (const SweepRow& row : rows) {
    ego_poses.insert(row.ego_pose);
    sensors.insert(row.sensor);
  }
  const Poses T_world_ego = read_poses_by_token(r.files[1], ego_poses);
  const Poses T_ego_sensor = read_poses_by_token(r.files[2], sensors);
  // File names begin at the folder of all data, which may be that above the tables.
  const bool is_above = !is_there(r.folder / rows.front().file);
  const fs::path root = is_above ? r.folder / ".." : r.folder;
  for (const SweepRow& row : rows) {
    const fs::path file = (root / row.file).lexically_normal();
    if (!r.scans.empty() && !(row.time > r.scans.back().time)) {
      fail(data,
           "expected one sweep at a time, found a second one for " + file.filename().string());
    }
    r.scans.push_back({file, name_of_scan(file), r.scans.size(), row.time});
    r.files.push_back(file);
    r.trajectory.times.push_back(row.time);
    r.trajectory.poses.push_back(T_world_ego.at(row.ego_pose) * T_ego_sensor.at(row.sensor));
  }
  r.scan_folder = r.scans.front().file.parent_path();
  r.format = ScanFormat::kNuScenes;
  r.notes.push_back("sweeps, poses and times of nuScenes");
}

#else

void read_nuscenes(RecordingContents&, const fs::path& tables) {
  fail(tables, "this build has no JSON (Debian: nlohmann-json3-dev)");
}

#endif

}  // namespace dynains
