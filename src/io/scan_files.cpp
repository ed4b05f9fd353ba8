#include "scan_files.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "byte_reader.hpp"
#include "dynains/median.hpp"
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

/// Orders names with runs of digits by value: scan2 comes before scan10. A run becomes a digit, the
/// number of its digits without leading zeros, and these.
std::string order_of(const std::string& name) {
  std::string order;
  for (std::size_t i = 0; i < name.size();) {
    if (!is_digit(name[i])) {
      order += name[i++];
      continue;
    }
    while (i < name.size() && name[i] == '0') ++i;
    const std::size_t begin = i;
    while (i < name.size() && is_digit(name[i])) ++i;
    order += {'0', static_cast<char>(i - begin)};
    order.append(name, begin, i - begin);
  }
  return order;
}

bool are_digits(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), is_digit);
}

/// A name of two numbers, seconds and a part of a second.
struct SecondsName {
  std::string seconds, part;
  bool has_point = false;  ///< between both; else `_` or `-`, as in SECONDS_NANOSECONDS
};

std::optional<SecondsName> seconds_name(const std::string& name) {
  const std::size_t separator = name.find_first_of("._-");
  if (separator == std::string::npos) return std::nullopt;
  SecondsName result{name.substr(0, separator), name.substr(separator + 1), name[separator] == '.'};
  const std::size_t whole = result.seconds.size();
  const bool is_time = are_digits(result.seconds) && are_digits(result.part) &&
                       result.part.size() <= 9 && (result.has_point ? whole <= 12 : whole == 10);
  return is_time ? std::optional(result) : std::nullopt;
}

/// Time of a name without a separator: 10 to 19 digits for s, ms, us or ns since 1970.
std::optional<double> time_of_digits(const std::string& name) {
  if (!are_digits(name) || name.size() < 10 || name.size() > 19 || name.front() == '0') {
    return std::nullopt;
  }
  return to_seconds(*text::parse_number(name));
}

/// Mean difference of the steps between times from the middle one, s.
double unevenness(std::vector<double> times) {
  std::sort(times.begin(), times.end());
  std::vector<double> steps;
  for (std::size_t i = 1; i < times.size(); ++i) steps.push_back(times[i] - times[i - 1]);
  const double usual = median(steps);
  double sum = 0.0;
  for (const double step : steps) sum += std::abs(step - usual);
  return sum / static_cast<double>(std::max<std::size_t>(1, steps.size()));
}

/// Times of names of two numbers. The second one is a decimal fraction behind a point. It may also
/// count ms, us or ns, which some recorders write without leading zeros: as scans mostly follow
/// each other evenly, it does if times are more even then.
std::vector<double> times_of(const std::vector<SecondsName>& names) {
  std::size_t digits = 0;  // of the longest part
  bool has_zeros = false, has_point = false;
  for (const SecondsName& name : names) {
    digits = std::max(digits, name.part.size());
    has_zeros = has_zeros || (name.part.size() > 1 && name.part.front() == '0');
    has_point = has_point || name.has_point;
  }
  std::vector<double> counted, decimal;
  const double unit = std::pow(1e-3, std::ceil(static_cast<double>(digits) / 3.0));  // s
  for (const SecondsName& name : names) {
    const double seconds = *text::parse_number(name.seconds);
    counted.push_back(seconds + unit * *text::parse_number(name.part));
    decimal.push_back(*text::parse_number(name.seconds + '.' + name.part));
  }
  if (!has_point) return counted;
  const bool may_count = digits % 3 == 0 && !has_zeros;
  return may_count && unevenness(counted) <= unevenness(decimal) ? counted : decimal;
}

}  // namespace

std::optional<ScanFormat> scan_format_of(const fs::path& path) {
  const std::string extension = lower_extension(path);
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
  for (const fs::path& path : paths_in(folder)) {
    const std::string name = path.filename().string();
    const bool has_poses =
        std::find(kPoseFiles.begin(), kPoseFiles.end(), name) != kPoseFiles.end();
    if (!scan_format_of(path) || name.front() == '.' || has_poses) continue;
    files.push_back(path);
  }
  const auto is_scan = [](const fs::path& path) {
    return is_for_scans_only(*scan_format_of(path));
  };
  if (std::any_of(files.begin(), files.end(), is_scan)) {
    files.erase(std::stable_partition(files.begin(), files.end(), is_scan), files.end());
  }
  std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
    const std::string x = a.filename().string(), y = b.filename().string();
    return std::pair(order_of(x), x) < std::pair(order_of(y), y);
  });
  return files;
}

std::string name_of_scan(const fs::path& file) {
  const fs::path stem = file.stem();
  return scan_format_of(file) == ScanFormat::kNuScenes ? stem.stem().string() : stem.string();
}

bool is_number(const std::string& name) {
  const std::size_t zeros = std::min(name.find_first_not_of('0'), name.size());
  return name.size() - zeros <= 9 && std::all_of(name.begin(), name.end(), is_digit);
}

std::optional<std::vector<double>> times_of_names(const std::vector<ScanEntry>& scans) {
  std::vector<SecondsName> of_two_numbers;
  std::vector<double> times;
  for (const ScanEntry& scan : scans) {
    const auto parts = seconds_name(scan.name);
    const auto time = parts ? std::nullopt : time_of_digits(scan.name);
    if (parts) of_two_numbers.push_back(*parts);
    if (time) times.push_back(*time);
  }
  if (of_two_numbers.size() == scans.size()) return times_of(of_two_numbers);
  if (times.size() == scans.size()) return times;
  return std::nullopt;
}

}  // namespace dynains
