#include "kitti_files.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <fstream>
#include <string_view>
#include <system_error>

#include "../failure.hpp"
#include "../input_file.hpp"
#include "../text.hpp"
#include "dynains/pose.hpp"

namespace dynains {
namespace {

namespace fs = std::filesystem;

/// The numbers of a line, all finite, exactly as many as `values` has.
template <std::size_t kCount>
std::array<double, kCount> parse_row(std::string_view line, const fs::path& path,
                                     std::size_t number) {
  const std::string expected = "expected " + std::to_string(kCount) +
                               (kCount == 1 ? " finite number" : " finite numbers") + ", ";
  std::array<double, kCount> values{};
  for (std::size_t i = 0; i < kCount; ++i) {
    const std::string_view token = text::next_token(line);
    if (token.empty()) fail_at_line(path, number, expected + "found " + std::to_string(i));
    const std::optional<double> value = text::parse_number(token);
    if (!value || !std::isfinite(*value)) {
      fail_at_line(path, number, expected + "found \"" + std::string(token.substr(0, 40)) + "\"");
    }
    values[i] = *value;
  }
  if (!text::next_token(line).empty()) fail_at_line(path, number, expected + "found more");
  return values;
}

/// Pose from 3x4 numbers; the rotation is orthonormalized.
Pose parse_pose(std::string_view line, const fs::path& path, std::size_t number) {
  const std::array<double, 12> row = parse_row<12>(line, path, number);
  const std::optional<Pose> pose = nearest_rigid(row.data());
  if (!pose) {
    fail_at_line(path, number,
                 "expected a rigid transform (columns 1-3 of the 3x4 matrix are a rotation)");
  }
  return *pose;
}

[[noreturn]] void fail_after_line(const fs::path& path, std::size_t number, int error) {
  fail_by_system(path, "reading stopped after line " + std::to_string(number), error);
}

bool is_blank(std::string_view line) { return text::next_token(line).empty(); }

/// Calls `parse(line, number)` for each line. Blank lines are allowed at the end only.
template <class Parse>
void for_each_row(const fs::path& path, Parse&& parse) {
  std::ifstream file = open_input(path);
  std::size_t number = 0;
  std::size_t blank = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    if (is_blank(line)) {
      if (blank == 0) blank = number;
      continue;
    }
    if (blank != 0) fail_at_line(path, blank, "expected a row, found a blank line");
    parse(number == 1 ? text::without_utf8_mark(line) : std::string_view(line), number);
  }
  if (file.bad()) fail_after_line(path, number, errno);
}

}  // namespace

std::optional<Pose> rigid_pose(const Eigen::Vector3d& position,
                               const detail::Quaternion& rotation) {
  if (!position.allFinite() || !(std::abs(rotation.norm() - 1.0) < 0.01)) return std::nullopt;
  Pose pose = Pose::Identity();
  pose.linear() = rotation.normalized().toRotationMatrix();
  pose.translation() = position;
  return pose;
}

std::optional<Pose> nearest_rigid(const double* rows) {
  using RowMajor34 = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;
  const RowMajor34 matrix = Eigen::Map<const RowMajor34>(rows);
  const Eigen::Matrix3d rotation = matrix.leftCols<3>();
  const Eigen::Matrix3d error = rotation.transpose() * rotation - Eigen::Matrix3d::Identity();
  if (!(error.cwiseAbs().maxCoeff() <= kRotationTolerance) || !(rotation.determinant() > 0.0)) {
    return std::nullopt;
  }
  Pose pose = Pose::Identity();
  pose.linear() = detail::Quaternion(rotation).normalized().toRotationMatrix();
  pose.translation() = matrix.col(3);
  return pose;
}

std::vector<double> read_kitti_times(const fs::path& path) {
  std::vector<double> times;
  for_each_row(path, [&](std::string_view line, std::size_t number) {
    const double time = parse_row<1>(line, path, number)[0];
    if (!times.empty() && !(time > times.back())) {
      fail_at_line(path, number, "expected a time after that of the row before");
    }
    times.push_back(time);
  });
  return times;
}

Pose read_kitti_calib(const fs::path& path) {
  std::ifstream file = open_input(path);
  std::size_t number = 0;
  for (std::string text; std::getline(file, text);) {
    ++number;
    std::string_view line = text;
    if (text::next_token(line) == "Tr:") return parse_pose(line, path, number);
  }
  if (file.bad()) fail_after_line(path, number, errno);
  fail(path,
       "expected a line \"Tr: \" with 12 numbers (sensor to the frame of the poses); if the poses "
       "are those of the sensor, remove this file");
}

std::vector<NumberedScan> list_kitti_scans(const fs::path& folder) {
  if (!is_folder(folder)) {
    fail(folder, "not found: expected a folder with one NNNNNN.bin for each scan");
  }
  std::vector<NumberedScan> scans;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    const fs::path file = entry->path();
    if (file.extension() != ".bin" || file.filename().string().front() == '.') continue;
    const std::string name = file.stem().string();
    const bool digits = name.find_first_not_of("0123456789") == std::string::npos;
    if (!digits || name.size() > 19) fail(file, "expected a number as name, such as 000123.bin");
    scans.push_back({std::stoull(name), name});
  }
  if (error) fail(folder, "cannot be listed: " + error.message());
  if (scans.empty()) fail(folder, "expected at least one scan NNNNNN.bin, found none");
  std::sort(scans.begin(), scans.end(), [](const NumberedScan& x, const NumberedScan& y) {
    return x.number != y.number ? x.number < y.number : x.name < y.name;
  });
  for (std::size_t i = 1; i < scans.size(); ++i) {
    if (scans[i].number == scans[i - 1].number) {
      fail(folder, "two scans with one number: " + scans[i - 1].name + ".bin and " + scans[i].name +
                       ".bin");
    }
  }
  return scans;
}

void check_rows(const fs::path& path, std::size_t rows, std::size_t needed) {
  if (rows >= needed) return;
  fail_at_line(path, rows + 1,
               "expected a row for each scan, at least " + std::to_string(needed) + ", found " +
                   std::to_string(rows));
}

}  // namespace dynains
