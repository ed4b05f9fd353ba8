#include "dynains/io/trajectory.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>

#include "../byte_reader.hpp"
#include "../failure.hpp"
#include "../text.hpp"
#include "dynains/errors.hpp"
#include "kitti_files.hpp"

namespace dynains {
namespace {

constexpr std::size_t kNoColumn = static_cast<std::size_t>(-1);
constexpr const char* kExpectedExtrinsic = "expected \"x y z qx qy qz qw\" or a file with one pose";
constexpr const char* kExpectedColumns =
    "expected 12 numbers (KITTI), 8 (TUM: time x y z qx qy qz qw), 7, 13 or 16 numbers, or a first "
    "line that names the columns time x y z qx qy qz qw";

/// Meaning of a column. kMatrix marks the first column of a matrix of 12 or 16 numbers.
enum Meaning : std::size_t { kTime, kNanoseconds, kMatrix, kX, kY, kZ, kQx, kQy, kQz, kQw };

/// Positions of the values in a row.
struct Columns {
  Columns() { of.fill(kNoColumn); }

  /// The first of two columns with one meaning counts.
  void claim(std::size_t meaning, std::size_t column) {
    if (of[meaning] == kNoColumn) of[meaning] = column;
  }
  bool complete() const { return std::find(of.begin() + kX, of.end(), kNoColumn) == of.end(); }

  std::size_t count = 0;
  std::array<std::size_t, kQw + 1> of{};  ///< by meaning; nanoseconds are beside seconds
  QuaternionOrder order = QuaternionOrder::kNone;
};

/// Cells of a line; empty cells count if commas or semicolons separate them.
std::vector<std::string> split(std::string_view line) {
  std::vector<std::string> cells;
  if (line.find_first_of(",;") == std::string_view::npos) {
    for (const std::string_view token : text::tokens(line)) cells.emplace_back(token);
    return cells;
  }
  for (;;) {
    const std::size_t end = line.find_first_of(",;");
    std::string_view cell = line.substr(0, end);
    // Units after a name, such as "x [m]", are not part of it.
    cells.emplace_back(text::next_token(cell));
    if (end == std::string_view::npos) return cells;
    line.remove_prefix(end + 1);
  }
}

bool contains(const std::string& text, const char* part) {
  return text.find(part) != std::string::npos;
}

/// Sets the meaning of a named column.
void add_column(const std::string& cell, std::size_t index, Columns& columns) {
  const std::string name = text::lower_case(cell);
  if (name.empty()) return;
  if (name == "nsec" || name == "nanosec" || name == "nsecs") {
    return columns.claim(kNanoseconds, index);
  }
  if (name == "t" || contains(name, "time") || contains(name, "stamp") || name == "sec" ||
      name == "secs") {
    return columns.claim(kTime, index);
  }
  const std::size_t axis = std::string_view("xyzw").find(name.back());
  if (axis == std::string_view::npos) return;
  const bool is_rotation = name.front() == 'q' || contains(name, "quat") ||
                           contains(name, "orient") || contains(name, "rot");
  const std::string stem = name.substr(0, name.size() - 1);
  const bool is_position =
      stem.empty() || stem == "t" || stem.front() == 'p' || contains(stem, "trans") || stem == "t_";
  if (is_rotation) {
    columns.claim(kQx + axis, index);
  } else if (is_position && axis < 3) {
    columns.claim(kX + axis, index);
  }
}

Columns columns_of_header(std::string_view line) {
  while (!line.empty() && (line.front() == '#' || line.front() == ' ')) line.remove_prefix(1);
  Columns columns;
  const std::vector<std::string> cells = split(line);
  for (std::size_t i = 0; i < cells.size(); ++i) add_column(cells[i], i, columns);
  columns.count = cells.size();
  columns.order =
      columns.of[kQw] < columns.of[kQx] ? QuaternionOrder::kWxyz : QuaternionOrder::kXyzw;
  return columns;
}

Columns columns_of_count(const ByteReader& reader, std::size_t count) {
  Columns columns;
  columns.count = count;
  if (count == 8 || count == 13) columns.of[kTime] = 0;
  if (count == 12 || count == 13 || count == 16) {
    columns.of[kMatrix] = count == 13 ? 1 : 0;
  } else if (count == 7 || count == 8) {
    for (std::size_t i = 0; i < 7; ++i) columns.of[kX + i] = count - 7 + i;
    columns.order = QuaternionOrder::kXyzw;
  } else {
    reader.fail_on_line(std::string(kExpectedColumns) + "; found " + std::to_string(count) +
                        (count == 1 ? " column" : " columns"));
  }
  return columns;
}

double number_in(const ByteReader& reader, const std::vector<std::string>& cells,
                 std::size_t column) {
  const auto value = text::parse_number(cells[column]);
  if (!value || !std::isfinite(*value)) {
    reader.fail_on_line("expected a finite number in column " + std::to_string(column + 1) +
                        ", found \"" + cells[column].substr(0, 40) + "\"");
  }
  return *value;
}

/// `count` numbers from a column on.
std::vector<double> numbers_in(const ByteReader& reader, const std::vector<std::string>& cells,
                               std::size_t first, std::size_t count) {
  std::vector<double> numbers(count);
  for (std::size_t i = 0; i < count; ++i) numbers[i] = number_in(reader, cells, first + i);
  return numbers;
}

/// The numbers of the last line, exactly `count`.
std::vector<double> parse_row(const ByteReader& reader, std::string_view line, std::size_t count) {
  const std::vector<std::string_view> tokens = text::tokens(line);
  if (tokens.size() != count) {
    reader.fail_on_line("expected " + std::to_string(count) +
                        (count == 1 ? " finite number" : " finite numbers") + ", found " +
                        std::to_string(tokens.size()));
  }
  return numbers_in(reader, {tokens.begin(), tokens.end()}, 0, count);
}

/// Adds the time of the last line, s.
void add_time(const ByteReader& reader, double time, std::vector<double>& times) {
  if (!times.empty() && !(time > times.back())) {
    reader.fail_on_line("expected a time after that of the row before");
  }
  times.push_back(time);
}

Pose pose_of(const ByteReader& reader, const std::vector<std::string>& cells,
             const Columns& columns) {
  if (columns.of[kMatrix] != kNoColumn) {
    const auto pose = nearest_rigid(numbers_in(reader, cells, columns.of[kMatrix], 12).data());
    if (pose) return *pose;
    reader.fail_on_line(
        "expected a rigid transform (columns 1-3 of the matrix are a rotation that does not "
        "mirror)");
  }
  std::array<double, 7> v{};
  for (std::size_t i = 0; i < 7; ++i) v[i] = number_in(reader, cells, columns.of[kX + i]);
  const detail::Quaternion rotation(v[6], v[3], v[4], v[5]);
  const auto pose = rigid_pose({v[0], v[1], v[2]}, rotation);
  if (pose) return *pose;
  reader.fail_on_line("expected a quaternion of length 1, found one of length " +
                      std::to_string(rotation.norm()));
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

std::vector<double> read_kitti_times(const std::filesystem::path& path) {
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
    add_time(reader, parse_row(reader, line, 1)[0], times);
  }
  return times;
}

Pose read_kitti_calib(const std::filesystem::path& path) {
  ByteReader reader(path);
  for (std::string text; reader.read_line(text);) {
    std::string_view line = text;
    if (text::next_token(line) != "Tr:") continue;
    const std::optional<Pose> pose = nearest_rigid(parse_row(reader, line, 12).data());
    if (pose) return *pose;
    reader.fail_on_line(
        "expected a rigid transform (columns 1-3 of the 3x4 matrix are a rotation)");
  }
  fail(path,
       "expected a line \"Tr: \" with 12 numbers (sensor to the frame of the poses); if the poses "
       "are those of the sensor, remove this file");
}

Trajectory read_trajectory(const std::filesystem::path& path) {
  ByteReader reader(path);
  if (path.extension() == ".pcd") {
    reader.fail_here(std::string("is a cloud, such as transformations.pcd of LIO-SAM; ") +
                     kExpectedColumns);
  }
  Trajectory trajectory;
  Columns columns;
  for (std::string line; reader.read_line(line);) {
    if (reader.line() == 1) line = text::without_utf8_mark(line);
    std::string_view rest = line;
    const std::string_view first = text::next_token(rest);
    if (first.empty()) continue;
    const std::vector<std::string> cells = split(line);
    const bool is_comment = first.front() == '#';
    const bool is_start = trajectory.poses.empty() && !columns.complete();
    if (is_comment || (is_start && !text::parse_number(cells.front()))) {
      const Columns named = is_start ? columns_of_header(line) : Columns{};
      if (named.complete()) columns = named;
      if (!is_comment && !named.complete()) reader.fail_on_line(kExpectedColumns);
      continue;
    }
    if (columns.count == 0) columns = columns_of_count(reader, cells.size());
    if (cells.size() != columns.count) {
      reader.fail_on_line("expected " + std::to_string(columns.count) +
                          " columns as before, found " + std::to_string(cells.size()));
    }
    trajectory.poses.push_back(pose_of(reader, cells, columns));
    if (columns.of[kTime] == kNoColumn) continue;
    double time = to_seconds(number_in(reader, cells, columns.of[kTime]));
    if (columns.of[kNanoseconds] != kNoColumn) {
      time += 1e-9 * number_in(reader, cells, columns.of[kNanoseconds]);
    }
    add_time(reader, time, trajectory.times);
  }
  if (trajectory.poses.empty()) reader.fail_on_line("file ends, expected at least one pose");
  trajectory.order = columns.order;
  return trajectory;
}

std::optional<TrajectoryMatch> match_time(const Trajectory& trajectory, double time,
                                          double longest_gap) {
  constexpr double kForgiven = 0.005;  // s, much less than one revolution of a sensor
  const std::vector<double>& times = trajectory.times;
  if (times.empty() || time < times.front() - kForgiven || time > times.back() + kForgiven) {
    return std::nullopt;
  }
  const auto upper = std::lower_bound(times.begin(), times.end(), time);
  const auto after = static_cast<std::size_t>(upper - times.begin());
  if (after == times.size()) return TrajectoryMatch{after - 1, after - 1, 0.0};
  if (after == 0 || times[after] == time) return TrajectoryMatch{after, after, 0.0};
  const double gap = times[after] - times[after - 1];
  const double share = (time - times[after - 1]) / gap;
  if (gap > longest_gap) {
    if (time - times[after - 1] <= kForgiven) return TrajectoryMatch{after - 1, after - 1, 0.0};
    if (times[after] - time <= kForgiven) return TrajectoryMatch{after, after, 0.0};
    return std::nullopt;
  }
  return TrajectoryMatch{after - 1, after, share};
}

Pose interpolate(const Pose& a, const Pose& b, double share) {
  if (share <= 0.0) return a;
  if (share >= 1.0) return b;
  return extrapolate(a, b, share);
}

Pose extrapolate(const Pose& a, const Pose& b, double share) {
  return a * detail::scaled_motion(detail::inverted(a) * b, share);
}

double to_seconds(double stamp) {
  // Stamps between 1973 and 5138.
  if (stamp > 1e17) return stamp * 1e-9;
  if (stamp > 1e14) return stamp * 1e-6;
  if (stamp > 1e11) return stamp * 1e-3;
  return stamp;
}

Pose read_extrinsic(const std::string& text) {
  const auto numbers = text::numbers_in(text, ",");
  if (!numbers || numbers->size() != 7) {
    const bool is_number = text::parse_number(text.substr(0, text.find_first_of(" ,"))).has_value();
    if (is_number) throw ConfigError("extrinsic \"" + text + "\": " + kExpectedExtrinsic);
    const Trajectory file = read_trajectory(text);
    if (file.poses.size() == 1) return file.poses.front();
    throw IoError(text + ": has " + std::to_string(file.poses.size()) + " poses; " +
                  kExpectedExtrinsic);
  }
  const std::vector<double>& n = *numbers;
  const auto pose = rigid_pose({n[0], n[1], n[2]}, {n[6], n[3], n[4], n[5]});
  if (!pose) {
    throw ConfigError("extrinsic \"" + text +
                      "\": expected finite numbers and a quaternion of length 1");
  }
  return *pose;
}

Eigen::Vector3d read_sensor_origin(const std::string& text) {
  const auto position = text::numbers_in(text, ",");
  if (!position || position->size() != 3) return read_extrinsic(text).translation();
  return Eigen::Vector3d(position->data());
}

std::vector<Pose> read_sensor_poses(const std::string& file) { return read_trajectory(file).poses; }

std::string extrinsic_text(const Pose& T_body_sensor) {
  const Eigen::Vector3d t = T_body_sensor.translation();
  detail::Quaternion q(T_body_sensor.linear());
  if (q.w() < 0.0) q.coeffs() *= -1.0;
  std::string text;
  for (const double value : {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()}) {
    text += (text.empty() ? "" : " ") + text::fixed(std::abs(value) < 5e-7 ? 0.0 : value, 6);
  }
  return text;
}

}  // namespace dynains
