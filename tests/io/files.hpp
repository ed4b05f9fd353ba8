// Folders and files for tests.
#pragma once

#include <unistd.h>

#include "dynains/errors.hpp"
#include "support/standard.hpp"

namespace dynains::test {

/// Fresh folder that disappears with its contents.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "dynains-XXXXXX").string();
    if (::mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("mkdtemp failed");
    path_ = pattern;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

inline void write_text(const std::filesystem::path& path, const std::string& text) {
  std::filesystem::create_directories(path.parent_path());
  std::ofstream file(path, std::ios::binary);
  file << text;
  if (!file.flush()) throw std::runtime_error("cannot write " + path.string());
}

/// A row of KITTI: a pose at (x, 0, 0) m that is not turned.
inline std::string pose_row(double x = 0.0) {
  return "1 0 0 " + std::to_string(x) + " 0 1 0 0 0 0 1 0\n";
}

inline std::size_t count_lines(const std::string& text) {
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

inline std::string read_text(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error("cannot read " + path.string());
  return {std::istreambuf_iterator<char>(file), {}};
}

inline std::size_t count_entries(const std::filesystem::path& folder) {
  using Iterator = std::filesystem::directory_iterator;
  return static_cast<std::size_t>(std::distance(Iterator(folder), Iterator()));
}

/// Bytes of numbers in memory order and of texts, one after the other.
template <class... Values>
std::string packed(const Values&... values) {
  std::string bytes;
  const auto add = [&](const auto& value) {
    if constexpr (std::is_arithmetic_v<std::decay_t<decltype(value)>>) {
      bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
    } else {
      bytes += value;
    }
  };
  (add(values), ...);
  return bytes;
}

/// A text behind its length, uint32.
inline std::string counted(const std::string& text) {
  return packed(static_cast<std::uint32_t>(text.size()), text);
}

/// Bytes of numbers.
template <class Number>
std::string bytes_of(const std::vector<Number>& numbers) {
  return {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number)};
}

/// Rows of a trajectory: time, x y z, and the quaternion as x y z w, or as w x y z. `pose_of(i)`
/// gives the pose of time i.
template <class PoseOf>
std::string timed_rows(const std::vector<double>& times, PoseOf&& pose_of, bool w_first = false) {
  std::ostringstream rows;
  rows.precision(12);
  for (std::size_t i = 0; i < times.size(); ++i) {
    const Eigen::Isometry3d T(pose_of(i));
    const Eigen::Quaterniond q(T.linear());
    rows << times[i] << ' ' << T.translation().transpose() << ' ';
    if (w_first) rows << q.w() << ' ';
    rows << q.vec().transpose();
    if (!w_first) rows << ' ' << q.w();
    rows << '\n';
  }
  return rows.str();
}

/// Text of the exception that `action` throws. Fails if its type is another or nothing is thrown.
template <class Exception, class Action>
std::string message_of(Action&& action) {
  try {
    action();
  } catch (const Exception& error) {
    return error.what();
  }
  return "(nothing was thrown)";
}

}  // namespace dynains::test
