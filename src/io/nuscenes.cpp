#include "nuscenes.hpp"

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <map>
#include <set>
#include <string_view>
#include <system_error>
#include <unordered_map>
#include <utility>

#include "failure.hpp"
#include "input_file.hpp"
#include "io/poses/kitti_files.hpp"

#if defined(DYNAINS_HAS_JSON)
#include <nlohmann/json.hpp>
#endif

namespace dynains {
namespace {

namespace fs = std::filesystem;

#if defined(DYNAINS_HAS_JSON)

/// A row of a table.
class TableRow {
 public:
  TableRow(const fs::path& table, std::uint64_t index) : table_(table), index_(index) {}

  std::map<std::string, std::string> texts;
  std::map<std::string, std::vector<double>> numbers;

  const std::string& text(const char* name) const {
    const auto found = texts.find(name);
    if (found == texts.end()) fail(std::string("expected a text \"") + name + '"');
    return found->second;
  }
  const std::vector<double>& list(const char* name, std::size_t size) const {
    const auto found = numbers.find(name);
    if (found == numbers.end() || found->second.size() != size) {
      fail("expected " + std::to_string(size) + " numbers \"" + name + '"');
    }
    return found->second;
  }
  /// `translation` and `rotation` (w x y z).
  Pose pose() const {
    const std::vector<double>& p = list("translation", 3);
    const std::vector<double>& q = list("rotation", 4);
    const auto pose = rigid_pose({p[0], p[1], p[2]}, {q[0], q[1], q[2], q[3]});
    if (!pose) fail("expected a finite translation and a quaternion of length 1");
    return *pose;
  }
  [[noreturn]] void fail(const std::string& what) const {
    dynains::fail(table_, "row " + std::to_string(index_) + ": " + what);
  }

 private:
  const fs::path& table_;
  std::uint64_t index_;
};

/// Takes a table, an array of flat objects, row by row.
template <class Take>
class TableHandler final : public nlohmann::json::json_sax_t {
 public:
  TableHandler(const fs::path& table, Take& take) : table_(table), take_(take) {}

  bool null() override { return true; }
  bool boolean(bool) override { return true; }
  bool number_integer(number_integer_t value) override {
    return number(static_cast<double>(value));
  }
  bool number_unsigned(number_unsigned_t value) override {
    return number(static_cast<double>(value));
  }
  bool number_float(number_float_t value, const string_t&) override { return number(value); }
  bool string(string_t& text) override {
    if (depth_ == kRow && row_) row_->texts[key_] = std::move(text);
    return true;
  }
  bool binary(binary_t&) override { return true; }
  bool start_object(std::size_t) override {
    if (++depth_ == kRow) row_.emplace(table_, count_++);
    return true;
  }
  bool end_object() override {
    if (depth_-- != kRow) return true;
    take_(*row_);
    row_.reset();
    return true;
  }
  bool key(string_t& text) override {
    if (depth_ == kRow) key_ = std::move(text);
    return true;
  }
  bool start_array(std::size_t) override {
    if (++depth_ == kList && row_) row_->numbers[key_].clear();
    return true;
  }
  bool end_array() override {
    --depth_;
    return true;
  }
  bool parse_error(std::size_t position, const std::string&,
                   const nlohmann::detail::exception&) override {
    fail_at_byte(table_, position, "expected JSON, an array of objects");
  }

 private:
  static constexpr int kRow = 2;   // depth of an object in the array
  static constexpr int kList = 3;  // depth of an array in such an object

  bool number(double value) {
    if (!row_ || depth_ > kList) return true;
    std::vector<double>& list = row_->numbers[key_];
    if (depth_ == kRow) list.clear();
    constexpr std::size_t kMost = 16;
    if (list.size() < kMost) list.push_back(value);
    return true;
  }

  const fs::path& table_;
  Take& take_;
  std::optional<TableRow> row_;
  std::string key_;
  int depth_ = 0;
  std::uint64_t count_ = 0;
};

template <class Take>
void read_table(const fs::path& table, Take&& take) {
  std::ifstream file = open_input(table);
  TableHandler<std::remove_reference_t<Take>> handler(table, take);
  nlohmann::json::sax_parse(file, &handler);
}

struct SweepRow {
  std::string file, sample, ego_pose, sensor;
  double time = 0.0;
};

bool is_sweep(const std::string& file) {
  constexpr std::string_view kEnd = ".pcd.bin";
  return file.size() > kEnd.size() &&
         file.compare(file.size() - kEnd.size(), kEnd.size(), kEnd) == 0;
}

std::vector<SweepRow> read_sample_data(const fs::path& table) {
  constexpr double kMicrosecond = 1e-6;
  std::vector<SweepRow> sweeps;
  read_table(table, [&](const TableRow& row) {
    const std::string& file = row.text("filename");
    if (!is_sweep(file)) return;
    sweeps.push_back({file, row.text("sample_token"), row.text("ego_pose_token"),
                      row.text("calibrated_sensor_token"),
                      kMicrosecond * row.list("timestamp", 1).front()});
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
    std::string list;
    for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
    fail(scenes, "expected one scene, by --nuscenes-scene; found " + list);
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
    const std::string& token = row.text("token");
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
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    const fs::path& path = entry->path();
    if (path.filename().string().rfind("v1.0", 0) == 0 && is_file(path / "sample_data.json")) {
      return path;
    }
  }
  return std::nullopt;
}

#if defined(DYNAINS_HAS_JSON)

NuScenesSweeps read_nuscenes(const fs::path& folder, const fs::path& tables,
                             const std::string& scene) {
  NuScenesSweeps result;
  result.tables = {tables / "sample_data.json", tables / "ego_pose.json",
                   tables / "calibrated_sensor.json"};
  std::vector<SweepRow> rows = read_sample_data(result.tables[0]);
  choose_scene(tables, scene, rows, result.tables);
  std::stable_sort(rows.begin(), rows.end(),
                   [](const SweepRow& a, const SweepRow& b) { return a.time < b.time; });
  std::set<std::string> ego_poses, sensors;
  for (const SweepRow& row : rows) {
    ego_poses.insert(row.ego_pose);
    sensors.insert(row.sensor);
  }
  const Poses T_world_ego = read_poses_by_token(result.tables[1], ego_poses);
  const Poses T_ego_sensor = read_poses_by_token(result.tables[2], sensors);
  // File names begin at the folder of all data, which may be that above the tables.
  const bool is_above = !is_there(folder / rows.front().file);
  const fs::path root = is_above ? folder / ".." : folder;
  for (const SweepRow& row : rows) {
    result.sweeps.push_back({(root / row.file).lexically_normal(), row.time,
                             T_world_ego.at(row.ego_pose) * T_ego_sensor.at(row.sensor)});
  }
  return result;
}

#else

NuScenesSweeps read_nuscenes(const fs::path&, const fs::path& tables, const std::string&) {
  fail(tables, "this build has no JSON (Debian: nlohmann-json3-dev)");
}

#endif

}  // namespace dynains
