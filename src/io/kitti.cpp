#include "dynains/io/kitti.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <optional>
#include <string_view>
#include <system_error>

#include "dynains/io/atomic_file.hpp"
#include "failure.hpp"
#include "text.hpp"

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__,
              "scans and labels are little-endian and read as they stand");

namespace dynains {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kFloatsPerPoint = 4;
constexpr std::uintmax_t kBytesPerPoint = kFloatsPerPoint * sizeof(float);
constexpr double kDefaultPeriod = 0.1;       // s, the 10 Hz of KITTI
constexpr double kRotationTolerance = 1e-3;  // text with 4 digits passes, a scaled matrix does not

std::ifstream open_for_reading(const fs::path& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) fail(path, "is a folder, expected a file");
  std::ifstream file(path, std::ios::binary);
  if (!file) fail(path, "cannot be opened for reading");
  return file;
}

std::uintmax_t size_of(const fs::path& path) {
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error);
  if (error) fail(path, "cannot be read: " + error.message());
  return size;
}

/// Fills `values` from a file that must have exactly that size.
template <class T>
void read_all(const fs::path& path, std::vector<T>& values) {
  std::ifstream file = open_for_reading(path);
  const auto bytes = static_cast<std::streamsize>(values.size() * sizeof(T));
  file.read(reinterpret_cast<char*>(values.data()), bytes);
  if (file.gcount() != bytes) {
    fail(path, "reading stopped at byte " + std::to_string(file.gcount()) + " of " +
                   std::to_string(bytes));
  }
}

template <class T>
void write_all(const fs::path& path, Span<const T> values) {
  AtomicFile file(path);
  file.stream().write(reinterpret_cast<const char*>(values.data()),
                      static_cast<std::streamsize>(values.size() * sizeof(T)));
  file.commit(AtomicFile::Sync::kLater);
}

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

/// Pose from 3x4 numbers, with the rotation nearest to the rounded one of the text.
Eigen::Isometry3d parse_pose(std::string_view line, const fs::path& path, std::size_t number) {
  using RowMajor34 = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;
  const std::array<double, 12> row = parse_row<12>(line, path, number);
  const RowMajor34 matrix = Eigen::Map<const RowMajor34>(row.data());
  const Eigen::Matrix3d rotation = matrix.leftCols<3>();
  const Eigen::Matrix3d error = rotation.transpose() * rotation - Eigen::Matrix3d::Identity();
  if (!(error.cwiseAbs().maxCoeff() <= kRotationTolerance) || !(rotation.determinant() > 0.0)) {
    fail_at_line(path, number,
                 "expected a rigid transform (columns 1-3 of the 3x4 matrix are a rotation)");
  }
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::Quaterniond(rotation).normalized().toRotationMatrix();
  pose.translation() = matrix.col(3);
  return pose;
}

bool is_blank(std::string_view line) { return text::next_token(line).empty(); }

/// Calls `parse(line, number)` for each line; blank lines are allowed at the end only.
template <class Parse>
void for_each_row(const fs::path& path, Parse&& parse) {
  std::ifstream file = open_for_reading(path);
  std::size_t number = 0;
  std::size_t blank = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    if (is_blank(line)) {
      if (blank == 0) blank = number;
      continue;
    }
    if (blank != 0) fail_at_line(path, blank, "expected a row, found a blank line");
    parse(std::string_view(line), number);
  }
  if (file.bad()) fail(path, "reading stopped after line " + std::to_string(number));
}

std::vector<Eigen::Isometry3d> read_poses(const fs::path& path) {
  std::vector<Eigen::Isometry3d> poses;
  for_each_row(path, [&](std::string_view line, std::size_t number) {
    poses.push_back(parse_pose(line, path, number));
  });
  return poses;
}

std::vector<double> read_times(const fs::path& path) {
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

Eigen::Isometry3d read_calib(const fs::path& path) {
  std::ifstream file = open_for_reading(path);
  std::size_t number = 0;
  for (std::string text; std::getline(file, text);) {
    ++number;
    std::string_view line = text;
    if (text::next_token(line) == "Tr:") return parse_pose(line, path, number);
  }
  fail(path,
       "expected a line \"Tr: \" with 12 numbers (sensor to the frame of the poses); if the poses "
       "are those of the sensor, remove this file");
}

/// Scans of the folder in the order of their numbers.
std::vector<std::pair<std::uint64_t, std::string>> list_scans(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) {
    fail(folder, "not found: expected a folder with one NNNNNN.bin for each scan");
  }
  std::vector<std::pair<std::uint64_t, std::string>> scans;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    const fs::path file = entry->path();
    if (file.extension() != ".bin" || file.filename().string().front() == '.') continue;
    const std::string name = file.stem().string();
    const bool digits = name.find_first_not_of("0123456789") == std::string::npos;
    if (!digits || name.size() > 18) fail(file, "expected a number as name, such as 000123.bin");
    scans.emplace_back(std::stoull(name), name);
  }
  if (error) fail(folder, "cannot be listed: " + error.message());
  if (scans.empty()) fail(folder, "expected at least one scan NNNNNN.bin, found none");
  std::sort(scans.begin(), scans.end());
  for (std::size_t i = 1; i < scans.size(); ++i) {
    if (scans[i].first == scans[i - 1].first) {
      fail(folder, "two scans with one number: " + scans[i - 1].second + ".bin and " +
                       scans[i].second + ".bin");
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

}  // namespace

KittiSequence::KittiSequence(const fs::path& folder) : folder_(folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) fail(folder, "is not a folder");
  const auto scans = list_scans(folder / "velodyne");

  const fs::path poses_path = folder / "poses.txt";
  if (!fs::exists(poses_path, error)) {
    fail(poses_path, "not found: expected a row of 12 numbers for each scan");
  }
  const std::vector<Eigen::Isometry3d> poses = read_poses(poses_path);
  const std::uint64_t last = scans.back().first;
  const bool by_order = last >= poses.size() && poses.size() == scans.size();
  const std::size_t needed = by_order ? scans.size() : static_cast<std::size_t>(last) + 1;
  check_rows(poses_path, poses.size(), needed);

  const fs::path times_path = folder / "times.txt";
  std::vector<double> times;
  const bool has_times = fs::exists(times_path, error);
  if (has_times) {
    times = read_times(times_path);
    check_rows(times_path, times.size(), needed);
  }

  const fs::path calib_path = folder / "calib.txt";
  const Eigen::Isometry3d Tr =
      fs::exists(calib_path, error) ? read_calib(calib_path) : Eigen::Isometry3d::Identity();

  scans_.resize(scans.size());
  for (std::size_t i = 0; i < scans.size(); ++i) {
    const std::size_t row = by_order ? i : static_cast<std::size_t>(scans[i].first);
    scans_[i].name = scans[i].second;
    scans_[i].T_world_sensor = Tr.inverse() * poses[row] * Tr;
    scans_[i].time = has_times ? times[row] : kDefaultPeriod * static_cast<double>(row);
  }
  has_labels_ = fs::is_directory(folder / "labels", error);
}

fs::path KittiSequence::scan_path(std::size_t i) const {
  return folder_ / "velodyne" / (name(i) + ".bin");
}

std::size_t KittiSequence::point_count(std::size_t i) const {
  const fs::path path = scan_path(i);
  const std::uintmax_t size = size_of(path);
  if (size % kBytesPerPoint != 0) {
    fail(path, "truncated at byte " + std::to_string(size) + ": expected a multiple of " +
                   std::to_string(kBytesPerPoint) + " bytes (float32 x y z intensity)");
  }
  return static_cast<std::size_t>(size / kBytesPerPoint);
}

std::vector<float> KittiSequence::read_scan(std::size_t i) const {
  std::vector<float> xyzi;
  read_scan(i, xyzi);
  return xyzi;
}

void KittiSequence::read_scan(std::size_t i, std::vector<float>& xyzi) const {
  xyzi.resize(point_count(i) * kFloatsPerPoint);
  read_all(scan_path(i), xyzi);
}

std::vector<std::uint32_t> KittiSequence::read_labels(std::size_t i) const {
  return dynains::read_labels(folder_ / "labels" / (name(i) + ".label"), point_count(i));
}

std::vector<std::uint32_t> read_labels(const fs::path& file, std::size_t count) {
  const std::uintmax_t size = size_of(file);
  if (size != count * sizeof(std::uint32_t)) {
    fail(file, "has " + std::to_string(size) + " bytes, expected " +
                   std::to_string(count * sizeof(std::uint32_t)) + " (uint32 for each of " +
                   std::to_string(count) + " points)");
  }
  std::vector<std::uint32_t> labels(count);
  read_all(file, labels);
  return labels;
}

void write_scan(const fs::path& file, Span<const float> xyzi) {
  if (xyzi.size() % kFloatsPerPoint != 0) fail(file, "expected 4 floats for each point to write");
  write_all(file, xyzi);
}

void write_labels(const fs::path& file, Span<const std::uint32_t> labels) {
  write_all(file, labels);
}

void write_poses(const fs::path& file, Span<const Eigen::Isometry3d> poses) {
  AtomicFile out(file);
  text::exact(out.stream());
  for (const Eigen::Isometry3d& pose : poses) {
    for (Eigen::Index i = 0; i < 12; ++i) {
      out.stream() << pose(i / 4, i % 4) << (i == 11 ? '\n' : ' ');
    }
  }
  out.commit();
}

void write_times(const fs::path& file, Span<const double> times) {
  AtomicFile out(file);
  text::exact(out.stream());
  for (const double time : times) out.stream() << time << '\n';
  out.commit();
}

void write_calib(const fs::path& file, const Eigen::Isometry3d& Tr) {
  AtomicFile out(file);
  text::exact(out.stream()) << "Tr:";
  for (Eigen::Index i = 0; i < 12; ++i) out.stream() << ' ' << Tr(i / 4, i % 4);
  out.stream() << '\n';
  out.commit();
}

}  // namespace dynains
