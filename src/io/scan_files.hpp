// Files of scans in a folder: formats, names and order.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "dynains/io/recording.hpp"

namespace dynains {

/// Names of files of poses, which are no scans.
inline constexpr std::array<const char*, 7> kPoseFiles = {
    "poses.txt",      "poses.csv",      "poses.tum",          "trajectory.txt",
    "trajectory.csv", "trajectory.tum", "optimized_poses.txt"};

/// By the extension; empty for files that are no scans.
std::optional<ScanFormat> scan_format_of(const std::filesystem::path& path);

/// Scan files directly in `folder`, except hidden ones, in the order of the numbers in their names.
/// Throws IoError.
std::vector<std::filesystem::path> scan_files(const std::filesystem::path& folder);

/// The file name without extensions.
std::string name_of_scan(const std::filesystem::path& file);

/// Whether a name is a number, of at most 9 digits behind leading zeros.
bool is_number(const std::string& name);

/// Times in seconds of scans whose names all are times: seconds with a decimal point; at least 10
/// digits: s, ms, us or ns since 1970; SECONDS_NANOSECONDS, also of us or ms. Digits behind a
/// decimal point count ns, us or ms if times are more even then, as some recorders write no leading
/// zeros.
std::optional<std::vector<double>> times_of_names(const std::vector<ScanEntry>& scans);

}  // namespace dynains
