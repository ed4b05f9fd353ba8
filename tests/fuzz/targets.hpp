// Fuzzing targets: functions of bytes. They return normally, or throw to report a bug.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "dynains/points.hpp"

namespace dynains::fuzz {

using Bytes = Span<const std::uint8_t>;

struct Target {
  const char* name;
  void (*run)(Bytes);
  std::vector<std::string> (*seeds)();  ///< initial inputs that a fuzzer mutates
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

// One function for each target, and one for its seeds.
void run_scan(Bytes bytes);
void run_labels(Bytes bytes);
void run_calib(Bytes bytes);
void run_times(Bytes bytes);
void run_ply(Bytes bytes);
void run_pcd(Bytes bytes);
void run_las(Bytes bytes);
void run_npy(Bytes bytes);
void run_xyz(Bytes bytes);
void run_config(Bytes bytes);
void run_session(Bytes bytes);
void run_trajectory(Bytes bytes);
void run_recording(Bytes bytes);
void run_log(Bytes bytes);
void run_nuscenes(Bytes bytes);
void run_facade(Bytes bytes);

std::vector<std::string> scan_seeds();
std::vector<std::string> label_seeds();
std::vector<std::string> calib_seeds();
std::vector<std::string> time_seeds();
std::vector<std::string> ply_seeds();
std::vector<std::string> pcd_seeds();
std::vector<std::string> las_seeds();
std::vector<std::string> npy_seeds();
std::vector<std::string> xyz_seeds();
std::vector<std::string> config_seeds();
std::vector<std::string> session_seeds();
std::vector<std::string> trajectory_seeds();
std::vector<std::string> recording_seeds();
std::vector<std::string> log_seeds();
std::vector<std::string> nuscenes_seeds();
std::vector<std::string> facade_seeds();

}  // namespace dynains::fuzz
