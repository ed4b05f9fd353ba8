// Everything about a run that is known before anything is written.
#pragma once

#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "dynains/io/folder_lock.hpp"
#include "dynains/io/recording.hpp"
#include "input_files.hpp"
#include "output_folder.hpp"
#include "run_results.hpp"
#include "run_settings.hpp"
#include "scan_range.hpp"
#include "session_contribution.hpp"

namespace dynains::program {

struct RunPlan {
  DynaInsRemover::Config config;
  Recording sequence;
  ScanRange range;
  RunOutputs outputs;
  OutputListing listing;  ///< of the results
  InputFiles inputs;
  nlohmann::ordered_json configuration;  ///< parameter name -> value
  nlohmann::ordered_json request;        ///< see describe_request()
  SessionRequest session;
  int passes = 1;  ///< over the recording
  StaticPolicy static_policy = StaticPolicy::kAlways;
};

/// Path of the file that a flag --map names, links followed. `out`: folder of the results, by
/// whole_path(). Throws ConfigError unless the name ends in .ply, .pcd or .las and no other result
/// goes there.
std::filesystem::path map_path(const std::string& name, const std::filesystem::path& out);

/// Checks what can be checked without the recording. Throws ConfigError, and
/// std::filesystem::filesystem_error for a path of `out` that cannot be.
void check_settings(const RunSettings& settings);

/// Checks everything but the points. Throws ConfigError, IoError, PoseError.
RunPlan make_plan(const RunSettings& given, Recording sequence);

/// The scans in a window. Throws ConfigError if there is none.
ScanRange select_scans(const Recording& sequence, const ScanWindow& window);

/// Treatment of a folder of results.
enum class RunTask { kNothing, kWrite, kReplace };

/// kNothing if the folder holds the complete results of this run already, and --resume is given;
/// kReplace if it holds results that stay until new ones are complete. Throws IoError if it holds
/// results that the flags do not allow to change.
RunTask choose_task(const RunPlan& plan, const RunSettings& settings, const OutputFolder& out);

/// Throws IoError if the free space cannot hold even labels and causes of the scans. Points of
/// .pcd and .ply scans are not counted.
void check_space(const RunPlan& plan);

/// The file of a map outside of the folder of results, opened before anything is changed. Nobody
/// else writes it, and no other run has its folder as a folder of results, while this lives.
class OutsideMap {
 public:
  /// Throws IoError if the map cannot be written or is in the way, UsageError if another run writes
  /// it or has its folder.
  OutsideMap(const RunPlan& plan, bool may_replace);
  /// For a map of these scans; `inputs` are never replaced.
  OutsideMap(const std::filesystem::path& map, const Recording& recording, const ScanRange& range,
             const InputFiles& inputs, bool may_replace) {
    open(map, recording, range, RunOutputs(), inputs, may_replace);
  }

  std::unique_ptr<MapFile> take_writer() { return std::move(writer_); }

 private:
  void open(const std::filesystem::path& map, const Recording& recording, const ScanRange& range,
            const RunOutputs& outputs, const InputFiles& inputs, bool may_replace);

  std::optional<FolderLock> lock_;
  std::unique_ptr<MapFile> writer_;
};

}  // namespace dynains::program
