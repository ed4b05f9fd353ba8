#include "keyframes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

#include "byte_reader.hpp"
#include "failure.hpp"
#include "kitti_files.hpp"
#include "scan_files.hpp"
#include "text.hpp"

namespace dynains {
namespace {

namespace fs = std::filesystem;

/// The first numbers of a line.
template <std::size_t kCount>
std::array<double, kCount> numbers_of(const ByteReader& reader, std::string_view line) {
  std::array<double, kCount> values{};
  for (double& value : values) {
    const auto number = text::parse_number(text::next_token(line));
    if (!number || !std::isfinite(*number)) {
      reader.fail_on_line("expected " + std::to_string(kCount) + " finite numbers");
    }
    value = *number;
  }
  return values;
}

std::string next_line(ByteReader& reader) {
  std::string line;
  if (!reader.read_line(line)) reader.fail_on_line("file ends, expected a row of a 4x4 matrix");
  return line;
}

Pose read_matrix(ByteReader& reader) {
  std::array<double, 12> rows{};
  for (std::size_t row = 0; row < 3; ++row) {
    const auto values = numbers_of<4>(reader, next_line(reader));
    std::copy(values.begin(), values.end(), rows.begin() + static_cast<std::ptrdiff_t>(4 * row));
  }
  const auto pose = nearest_rigid(rows.data());
  if (!pose) reader.fail_on_line("expected a rigid transform");
  return *pose;
}

}  // namespace

std::vector<fs::path> keyframe_folders(const fs::path& folder) {
  std::vector<fs::path> folders;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    const fs::path& path = entry->path();
    std::error_code ignored;
    if (is_number(path.filename().string()) && fs::is_regular_file(path / "data", ignored) &&
        fs::is_regular_file(path / kKeyframeCloud, ignored)) {
      folders.push_back(path);
    }
  }
  if (error) fail(folder, "cannot be listed: " + error.message());
  std::sort(folders.begin(), folders.end(), [](const fs::path& a, const fs::path& b) {
    return std::stoull(a.filename().string()) < std::stoull(b.filename().string());
  });
  return folders;
}

Keyframe read_keyframe(const fs::path& file) {
  ByteReader reader(file);
  std::optional<double> time;
  std::optional<Pose> pose;
  for (std::string line; reader.read_line(line);) {
    std::string_view rest = line;
    const std::string_view name = text::next_token(rest);
    if (name == "stamp") {
      const auto stamp = numbers_of<2>(reader, rest);
      time = stamp[0] + 1e-9 * stamp[1];
    } else if (name == "estimate") {
      pose = read_matrix(reader);
    }
  }
  if (time && pose) return {*time, *pose};
  fail(file, "expected a line \"stamp SECONDS NANOSECONDS\" and a 4x4 matrix below \"estimate\"");
}

}  // namespace dynains
