// Settings of a run. The command line and the Python module fill them.
#pragma once

#include <chrono>
#include <filesystem>
#include <future>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "dynains/compiled_remover.hpp"
#include "dynains/config.hpp"
#include "dynains/parameters.hpp"
#include "dynains/recording/static_policy.hpp"
#include "grid/grid_maker.hpp"
#include "map_file.hpp"
#include "run/settings/parameter_values.hpp"
#include "run/settings/recording_settings.hpp"
#include "scan_range.hpp"

namespace dynains::run {

/// Names in the folder of results.
struct ResultNames {
  const char* picture = "overview.png";  ///< see Overview
  const char* tracks = "tracks.csv";
  const char* poses = "poses.txt";
  const char* page = "view.html";  ///< of `dynains view`
};
inline constexpr ResultNames kResultNames;

/// Extension of the files of clean scans. `format`: of the scans of the recording.
inline const char* clean_extension(ScanFormat format) {
  return format == ScanFormat::kBin ? ".bin" : format == ScanFormat::kPly ? ".ply" : ".pcd";
}

/// The names that a run accepts, a part of those of DynaInsRemover::Config::preset().
inline const std::vector<std::string>& preset_names() {
  static const std::vector<std::string> names = {"default", "offline", "paper", "published"};
  return names;
}

/// Whether the preset holds the ranges of the paper.
inline bool has_ranges_of_paper(const std::string& name) {
  return name == "paper" || name == "published";
}

/// The results of a run. A plan has them whole: in settings, an empty `map` is the file
/// static_map.ply in the folder.
struct RunOutputs {
  std::filesystem::path folder;
  std::filesystem::path map;  ///< by whole_path(); empty: no map
  bool write_online = false;
  bool write_clean = false;
  bool drop_not_judged = false;  ///< from clean/
  std::filesystem::path log;     ///< by whole_path(); empty: none
  bool mark_log = false;         ///< adds labels to its clouds, which keep all points
  std::filesystem::path grid;    ///< description, by whole_path(); empty: none
  std::filesystem::path grid_image;
  grid::Config grid_config;
  bool write_poses = false;
  bool write_page = false;  ///< of dynains view
  bool write_beliefs = false;
  bool write_tracks = false;    ///< of moving objects, RemoverConfig::objects
  bool one_thread = false;      ///< the caller reads and writes
  bool map_attributes = false;  ///< the map holds attributes of its points
  std::string crs;              ///< of a LAS map, as WKT; empty: none
  double map_voxel = 0.0;       ///< m, of attributes

  std::launch thread() const { return one_thread ? std::launch::deferred : std::launch::async; }
  /// Whether a result holds beliefs.
  bool needs_beliefs() const { return write_beliefs || map_attributes; }
  bool has_outside_map() const;
  bool has_las_map() const { return is_las(map); }
  /// The map relative to the folder if it lies there, so that the folder can be moved; else
  /// absolute. Empty if there is none.
  std::string map_name() const;
};

struct RunSettings {
  RunOutputs outputs;                   ///< as asked for
  std::string update;                   ///< folder of a map of many sessions; empty: none
  std::string session;                  ///< name there; empty: that of the recording
  std::optional<double> session_begin;  ///< s; none: time of the first scan
  bool align = false;                   ///< moves the session into the frame of `update`
  std::string align_start;              ///< as of read_extrinsic(); empty: identity
  ScanWindow window;
  int passes = 1;  ///< 2: scans of the whole recording revise the first verdicts
  StaticPolicy static_policy = StaticPolicy::kAlways;  ///< of two passes
  bool force = false;
  bool accept_poses = false;
  /// Whether `config.min_range` follows what the sensor sees of its own body.
  bool find_own_body = false;

  DynaInsRemover::Config config;
  std::string preset = "default";  ///< name of the preset that `config` began with
  std::string config_file;         ///< empty: none was read

  std::string recording;           ///< folder or file, as the user named it
  std::string recording_as_given;  ///< `recording` and its flags, so that messages propose commands
  /// Begin of the wall time in the report.
  std::chrono::steady_clock::time_point started = std::chrono::steady_clock::now();
  nlohmann::ordered_json recording_flags;  ///< flag -> value, those that describe the files

  /// What flags and keyword arguments set: what most runs need, then what few do.
  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& visitor) {
    visit_common(self, visitor);
    visit_more(self, visitor);
  }
  template <class Self, class Visitor>
  static void visit_common(Self& self, Visitor&& visitor);
  template <class Self, class Visitor>
  static void visit_more(Self& self, Visitor&& visitor);
};

template <class Self, class Visitor>
void RunSettings::visit_common(Self& self, Visitor&& visitor) {
  visitor(
      Parameter{"force", self.force, Bounds(), "",
                "replace the results of an earlier run, and its files of map and write_log, "
                "when the new ones are complete: until then the earlier ones stay. Nothing else "
                "is replaced"});
  ScanWindow::visit(self.window, visitor);
  visitor(plain_text("map", self.outputs.map, "FILE",
                     "static map, .ply, .pcd or .las [static_map.ply in the folder of results]"));
  visitor(Parameter{"passes", self.passes, closed(1, 2), "",
                    "2: after the last scan, scans of the whole recording remove what came or went "
                    "at any time, and restore what is static; 1: the verdicts of the stream"});
  visitor(Parameter{"static", self.static_policy, Bounds(), "",
                    "with two passes: what never moved, or what is there at the end, as a car "
                    "that has parked"});
  visitor(Parameter{"view", self.outputs.write_page, Bounds(), "",
                    "also write the page view.html, which shows the results, and the folder "
                    "beliefs"});
  visitor(Parameter{"accept_poses", self.accept_poses, Bounds(), "",
                    "run even if the scans disagree with the poses, which else ends the run before "
                    "anything is written"});
}

template <class Self, class Visitor>
void RunSettings::visit_more(Self& self, Visitor&& visitor) {
  visitor(Parameter{"map_attributes", self.outputs.map_attributes, Bounds(), "",
                    "the map holds intensity, time and label of its points, as far as scans have "
                    "them; a map of LAS holds its attributes always"});
  visitor(plain_text("crs", self.outputs.crs, "WKT",
                     "coordinate reference system of the poses, for a map of LAS [none]"));
  visitor(plain_text("update", self.update, "CITY",
                     "also adds the session to this map of many sessions, a folder, when the run "
                     "is complete"));
  visitor(plain_text("session", self.session, "NAME",
                     "name of the session in that map [name of the recording]"));
  visitor(TextParameter{"session_begin", self.session_begin, &read_number<double>, "S",
                        "time by which sessions are ordered [time of the first scan]"});
  visitor(Parameter{"align", self.align, Bounds(), "",
                    "moves the session into the frame of that map: registers scans to its points "
                    "from a start that is within 2 m and 5 degrees; ends before anything is "
                    "written if they do not fit"});
  visitor(plain_text("align_start", self.align_start, "POSE",
                     "start of the alignment, pose of the session's frame in that of the map: "
                     "\"x y z qx qy qz qw\", or a file [identity]"));
  visitor(Parameter{"write_online", self.outputs.write_online, Bounds(), "",
                    "also write the verdicts without latency, to the folder online"});
  visitor(Parameter{"write_clean", self.outputs.write_clean, Bounds(), "",
                    "also write every scan without its moving points, to the folder clean, in the "
                    "form it has in the recording"});
  visitor(plain_text("write_log", self.outputs.log, "FILE",
                     "also write the log of the recording again, as MCAP: all messages as they "
                     "are, except that clouds of the topic have no moving points"));
  visitor(Parameter{"mark", self.outputs.mark_log, Bounds(), "",
                    "clouds of that log keep all points and get a field `label` (uint8): 251 "
                    "moving, 9 static, 0 not judged"});
  visitor(Parameter{"drop_not_judged", self.outputs.drop_not_judged, Bounds(), "",
                    "clean scans and the log have no points that are not judged, as too near or "
                    "too far; the map never has them"});
  visitor(plain_text("grid", self.outputs.grid, "FILE.yaml",
                     "also write an occupancy grid for navigation, see `dynains grid`; its image "
                     "lies beside it"));
  grid::Config::visit(self.outputs.grid_config, visitor);
  visitor(Parameter{"write_beliefs", self.outputs.write_beliefs, Bounds(), "",
                    "also write the probability that a point moves, to the folder beliefs"});
  visitor(Parameter{"one_thread", self.outputs.one_thread, Bounds(), "",
                    "after the check of poses, the run works, reads and writes in one thread, for "
                    "machines on which many runs use all cores"});
}

}  // namespace dynains::run
