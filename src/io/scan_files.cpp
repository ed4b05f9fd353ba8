#include "scan_files.hpp"

#include <algorithm>
#include <string_view>
#include <system_error>

#include "dynains/io/point_file.hpp"
#include "failure.hpp"
#include "text.hpp"

namespace dynains {
namespace {

namespace fs = std::filesystem;

/// Beside scans of these formats, files of the other ones are no scans.
bool is_for_scans_only(ScanFormat format) {
  return format == ScanFormat::kBin || format == ScanFormat::kPcd || format == ScanFormat::kPly ||
         format == ScanFormat::kNuScenes;
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Compares runs of digits by value: scan2 comes before scan10.
bool is_before(const std::string& a, const std::string& b) {
  std::size_t i = 0;
  std::size_t k = 0;
  while (i < a.size() && k < b.size()) {
    if (!is_digit(a[i]) || !is_digit(b[k])) {
      if (a[i] != b[k]) return a[i] < b[k];
      ++i;
      ++k;
      continue;
    }
    const auto run = [](const std::string& text, std::size_t& at) {
      while (at < text.size() && text[at] == '0') ++at;
      const std::size_t begin = at;
      while (at < text.size() && is_digit(text[at])) ++at;
      return std::string_view(text).substr(begin, at - begin);
    };
    const std::string_view x = run(a, i);
    const std::string_view y = run(b, k);
    if (x.size() != y.size()) return x.size() < y.size();
    if (x != y) return x < y;
  }
  const bool a_ends = i == a.size();
  const bool b_ends = k == b.size();
  return a_ends == b_ends ? a < b : a_ends;
}

/// Time that a name is: seconds with a decimal point, of which the fraction counts nanoseconds if
/// `counts_nanoseconds`; 10 to 19 digits for s, ms, us or ns since 1970; or SECONDS_NANOSECONDS.
std::optional<double> time_of_name(const std::string& name, bool counts_nanoseconds) {
  const auto digits = [](std::string_view text) {
    return !text.empty() && std::all_of(text.begin(), text.end(), is_digit);
  };
  const std::size_t separator = name.find_first_of("._-");
  if (separator == std::string::npos) {
    if (!digits(name) || name.size() < 10 || name.size() > 19 || name.front() == '0') {
      return std::nullopt;
    }
    return to_seconds(*text::parse_number(name));
  }
  const std::string whole = name.substr(0, separator);
  const std::string part = name.substr(separator + 1);
  if (!digits(whole) || !digits(part) || whole.size() > 12 || part.size() > 9) return std::nullopt;
  if (name[separator] == '.' && !counts_nanoseconds) return text::parse_number(name);
  // SECONDS_NANOSECONDS, as the stamps of ROS have it.
  if (name[separator] != '.' && whole.size() != 10) return std::nullopt;
  return *text::parse_number(whole) + 1e-9 * *text::parse_number(part);
}

}  // namespace

std::optional<ScanFormat> scan_format_of(const fs::path& path) {
  const std::string extension = text::lower_case(path.extension().string());
  if (extension == ".bin" && path.stem().extension() == ".pcd") return ScanFormat::kNuScenes;
  if (extension == ".bin") return ScanFormat::kBin;
  if (extension == ".pcd") return ScanFormat::kPcd;
  if (extension == ".ply") return ScanFormat::kPly;
  if (extension == ".las") return ScanFormat::kLas;
  if (extension == ".npy") return ScanFormat::kNpy;
  if (extension == ".xyz") return ScanFormat::kXyz;
  if (extension == ".csv") return ScanFormat::kCsv;
  return std::nullopt;
}

std::vector<fs::path> scan_files(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    const fs::path& path = entry->path();
    const std::string name = path.filename().string();
    const bool has_poses =
        std::find(kPoseFiles.begin(), kPoseFiles.end(), name) != kPoseFiles.end();
    if (!scan_format_of(path) || name.front() == '.' || has_poses) continue;
    files.push_back(path);
  }
  if (error) fail(folder, "cannot be listed: " + error.message());
  const auto is_scan = [](const fs::path& path) {
    return is_for_scans_only(*scan_format_of(path));
  };
  if (std::any_of(files.begin(), files.end(), is_scan)) {
    files.erase(std::stable_partition(files.begin(), files.end(), is_scan), files.end());
  }
  std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
    return is_before(a.filename().string(), b.filename().string());
  });
  return files;
}

std::string name_of_scan(const fs::path& file) {
  const fs::path stem = file.stem();
  return scan_format_of(file) == ScanFormat::kNuScenes ? stem.stem().string() : stem.string();
}

std::optional<std::string> conversion_of_scans(const fs::path& folder) {
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    const auto conversion = conversion_of(entry->path());
    if (conversion) return entry->path().filename().string() + ": " + *conversion;
  }
  return std::nullopt;
}

bool is_number(const std::string& name) {
  const std::size_t zeros = std::min(name.find_first_not_of('0'), name.size());
  return name.size() - zeros <= 9 && std::all_of(name.begin(), name.end(), is_digit);
}

std::optional<std::vector<double>> times_of_names(const std::vector<std::string>& names) {
  const auto fraction_of = [](const std::string& name) {
    const std::size_t point = name.find('.');
    return point == std::string::npos ? std::string() : name.substr(point + 1);
  };
  constexpr std::size_t kDigits = 9;  // of nanoseconds
  const bool are_long = std::any_of(names.begin(), names.end(), [&](const std::string& name) {
    return fraction_of(name).size() == kDigits;
  });
  const bool have_zeros = std::any_of(names.begin(), names.end(), [&](const std::string& name) {
    const std::string fraction = fraction_of(name);
    return fraction.size() > 1 && fraction.front() == '0';
  });
  std::vector<double> times;
  for (const std::string& name : names) {
    const std::optional<double> time = time_of_name(name, are_long && !have_zeros);
    if (!time) return std::nullopt;
    times.push_back(*time);
  }
  return times;
}

}  // namespace dynains
