// Fuzzing targets: functions of bytes. They return normally, or throw to report a bug.
#pragma once

#include "dynains/io/recording.hpp"
#include "dynains/points.hpp"
#include "support/standard.hpp"

namespace dynains::fuzz {

using Bytes = Span<const std::uint8_t>;

struct Target {
  const char* name;
  void (*run)(Bytes);
  std::vector<std::string> seeds;  ///< initial inputs that a fuzzer mutates
};

const std::vector<Target>& targets();
/// Throws std::out_of_range.
const Target& target(const std::string& name);

/// Throws std::logic_error, which no target catches, unless `condition` holds.
void require(bool condition, const char* what);

/// Runs `read` on a file or folder. An Error is permitted if it names the place.
template <class Error, class Read>
void expect_value_or(const std::filesystem::path& place, Read&& read) {
  try {
    read(place);
  } catch (const Error& error) {
    require(std::string(error.what()).rfind(place.string(), 0) == 0, "the error names the place");
  }
}

void require_rigid(const Eigen::Isometry3d& pose);
/// Checks poses and times.
void check_poses(const Recording& recording);
/// Checks everything that a recording gives out; `bytes` is the size of the input if it is known to
/// hold all points. A scan may be refused with its place.
void check_recording(const fs::path& place, const Recording& recording, std::size_t bytes = 0);

// Targets by what they run.
std::vector<Target> reader_targets();
std::vector<Target> recording_targets();
Target log_target();
Target nuscenes_target();
Target facade_target();

}  // namespace dynains::fuzz
