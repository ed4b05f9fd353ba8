// Settings of a run. The command line and the Python module fill them.
#pragma once

#include <chrono>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "dynains/compiled_remover.hpp"
#include "dynains/config.hpp"
#include "dynains/recording/static_policy.hpp"
#include "labelled_sequence.hpp"

namespace dynains::program {

struct RunSettings {
  std::string out;                      ///< folder of the results
  std::string map;                      ///< file of the static map; empty: static_map.ply in `out`
  std::string update;                   ///< folder of a map of many sessions; empty: none
  std::string session;                  ///< name there; empty: that of the recording
  std::optional<double> session_begin;  ///< s; none: time of the first scan
  bool align = false;                   ///< moves the session into the frame of `update`
  std::string align_start;              ///< as of read_extrinsic(); empty: identity
  bool map_attributes = false;
  std::string crs;  ///< of a LAS map, for example "EPSG:25832"; empty: none
  ScanWindow window;
  /// 2: scans of the whole recording revise the first verdicts. None: see passes_of().
  std::optional<int> passes;
  StaticPolicy static_policy = StaticPolicy::kAlways;  ///< of two passes
  bool one_thread = false;                             ///< works, reads and writes in one thread
  bool write_online = false;
  bool write_clean = false;
  bool write_mcap = false;
  std::string log;        ///< file or folder of the log without moving points; empty: none
  bool mark_log = false;  ///< the log keeps all points, with their labels
  bool write_beliefs = false;
  bool view = false;
  bool force = false;
  bool resume = false;
  bool accept_poses = false;
  bool poses_are_estimated = false;  ///< by the odometry; they are a result
  bool drop_not_judged = false;      ///< clean/ has no points that are not judged
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
};

/// Passes over the recording: as set, else two. One if the run decides by the window, which is what
/// the paper does.
inline int passes_of(const RunSettings& settings) {
  return settings.passes.value_or(settings.config.decision == Decision::kWindow ? 1 : 2);
}

}  // namespace dynains::program
