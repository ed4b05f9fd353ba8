#include "kitti_files.hpp"

#include <array>
#include <cmath>
#include <string>
#include <string_view>

#include "../byte_reader.hpp"
#include "../failure.hpp"
#include "../text.hpp"
#include "dynains/pose.hpp"

namespace dynains {
namespace {

namespace fs = std::filesystem;

/// The numbers of the last line, all finite, exactly as many as `kCount`.
template <std::size_t kCount>
std::array<double, kCount> parse_row(const ByteReader& reader, std::string_view line) {
  const std::string expected = "expected " + std::to_string(kCount) +
                               (kCount == 1 ? " finite number" : " finite numbers") + ", ";
  std::array<double, kCount> values{};
  for (std::size_t i = 0; i < kCount; ++i) {
    const std::string_view token = text::next_token(line);
    if (token.empty()) reader.fail_on_line(expected + "found " + std::to_string(i));
    const std::optional<double> value = text::parse_number(token);
    if (!value || !std::isfinite(*value)) {
      reader.fail_on_line(expected + "found \"" + std::string(token.substr(0, 40)) + "\"");
    }
    values[i] = *value;
  }
  if (!text::next_token(line).empty()) reader.fail_on_line(expected + "found more");
  return values;
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
  pose.matrix().topRows<3>() = matrix;
  return orthonormalized(pose);
}

std::vector<double> read_kitti_times(const fs::path& path) {
  ByteReader reader(path);
  std::vector<double> times;
  bool has_blank = false;
  for (std::string line; reader.read_line(line);) {
    if (reader.line() == 1) line = text::without_utf8_mark(line);
    std::string_view rest = line;
    const bool is_blank = text::next_token(rest).empty();
    if (has_blank && !is_blank) reader.fail_on_line("expected no row behind a blank line");
    has_blank = is_blank;
    if (is_blank) continue;
    const double time = parse_row<1>(reader, line)[0];
    if (!times.empty() && !(time > times.back())) {
      reader.fail_on_line("expected a time after that of the row before");
    }
    times.push_back(time);
  }
  return times;
}

Pose read_kitti_calib(const fs::path& path) {
  ByteReader reader(path);
  for (std::string text; reader.read_line(text);) {
    std::string_view line = text;
    if (text::next_token(line) != "Tr:") continue;
    const std::optional<Pose> pose = nearest_rigid(parse_row<12>(reader, line).data());
    if (pose) return *pose;
    reader.fail_on_line(
        "expected a rigid transform (columns 1-3 of the 3x4 matrix are a rotation)");
  }
  fail(path,
       "expected a line \"Tr: \" with 12 numbers (sensor to the frame of the poses); if the poses "
       "are those of the sensor, remove this file");
}

void check_rows(const fs::path& path, std::size_t rows, std::size_t needed) {
  if (rows >= needed) return;
  fail_at_line(path, rows + 1,
               "expected a row for each scan, at least " + std::to_string(needed) + ", found " +
                   std::to_string(rows));
}

}  // namespace dynains
