#include "bin_layout.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string_view>
#include <system_error>
#include <utility>

#include "../failure.hpp"
#include "../logs/raw_file.hpp"
#include "../text.hpp"
#include "dynains/errors.hpp"
#include "dynains/median.hpp"

namespace dynains {
namespace {

constexpr BinLayout kOthers[] = {{3, false}, {5, false}, {6, false}, {8, false}};

/// Column `column` of point `point`; the bytes of both lie in `bytes`.
double value_at(const std::vector<std::uint8_t>& bytes, const BinLayout& layout, std::size_t point,
                std::size_t column) {
  const std::uint8_t* const at =
      bytes.data() + point * point_size(layout) + column * value_size(layout);
  if (layout.is_double) {
    double value = 0.0;
    std::memcpy(&value, at, sizeof(value));
    return value;
  }
  float value = 0.0F;
  std::memcpy(&value, at, sizeof(value));
  return static_cast<double>(value);
}

/// Ratio of points whose coordinates are as those of a sensor, in m, cm or mm.
double plausible_share(const std::vector<std::uint8_t>& bytes, const BinLayout& layout) {
  const std::size_t count = bytes.size() / point_size(layout);
  std::size_t plausible = 0;
  for (std::size_t i = 0; i < count; ++i) {
    bool is_plausible = true;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double size = std::abs(value_at(bytes, layout, i, axis));
      is_plausible = is_plausible && !(size > 1e6) && !(size > 0.0 && size < 1e-6);
    }
    plausible += is_plausible ? 1 : 0;
  }
  return count == 0 ? 1.0 : static_cast<double>(plausible) / static_cast<double>(count);
}

/// Median distance from a point to the next one in the file; 0 if there is none.
double median_step(const std::vector<std::uint8_t>& bytes, const BinLayout& layout) {
  const std::size_t count = bytes.size() / point_size(layout);
  std::vector<double> steps;
  for (std::size_t i = 1; i < count; ++i) {
    double squared = 0.0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double step = value_at(bytes, layout, i, axis) - value_at(bytes, layout, i - 1, axis);
      squared += step * step;
    }
    if (std::isfinite(squared)) steps.push_back(std::sqrt(squared));
  }
  return median(std::move(steps));
}

std::string option_of(const BinLayout& layout) {
  return "--bin-columns " + std::to_string(layout.columns) + (layout.is_double ? "d" : "");
}

}  // namespace

BinLayout parse_bin_layout(const std::string& text) {
  const bool is_double = !text.empty() && text.back() == 'd';
  const std::string_view digits(text.data(), text.size() - (is_double ? 1 : 0));
  const auto columns = text::parse_number(digits);
  if (columns && *columns >= 3.0 && *columns <= 64.0 && *columns == std::floor(*columns)) {
    return {static_cast<int>(*columns), is_double};
  }
  throw ConfigError("--bin-columns " + text + ": expected 3 to 64, with a d for float64");
}

std::string to_text(const BinLayout& layout) {
  const std::string type = layout.is_double ? "float64" : "float32";
  if (layout.columns == 3) return type + " x y z";
  if (layout.columns == 4) return type + " x y z intensity";
  return std::to_string(layout.columns) + " columns of " + type;
}

std::uint64_t count_bin_points(const std::filesystem::path& file, const BinLayout& layout,
                               bool names_others) {
  std::error_code error;
  const std::uint64_t bytes = std::filesystem::file_size(file, error);
  if (error) fail(file, "cannot be read: " + error.message());
  if (bytes % point_size(layout) == 0) return bytes / point_size(layout);
  std::string fitting;
  for (const BinLayout& other : kOthers) {
    if (!names_others || bytes % point_size(other) != 0) continue;
    fitting += (fitting.empty() ? "; if it is whole: " : ", ") +
               std::to_string(bytes / point_size(other)) + " points of " + to_text(other) + " by " +
               option_of(other);
  }
  fail(file, "truncated at byte " + std::to_string(bytes) + ": expected a multiple of " +
                 std::to_string(point_size(layout)) + " bytes (" + to_text(layout) + ")" + fitting);
}

void read_bin_points(const std::filesystem::path& file, const BinLayout& layout,
                     std::vector<float>& xyzi, std::vector<std::uint16_t>* ring) {
  const std::uint64_t count = count_bin_points(file, layout);
  const auto bytes = RawFile(file).read(0, count * point_size(layout), "points");
  const auto columns = std::min<std::size_t>(4, static_cast<std::size_t>(layout.columns));
  xyzi.assign(4 * static_cast<std::size_t>(count), 0.0F);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t column = 0; column < columns; ++column) {
      xyzi[4 * i + column] = static_cast<float>(value_at(bytes, layout, i, column));
    }
    if (ring == nullptr) continue;
    const double value = value_at(bytes, layout, i, columns);
    ring->push_back(value >= 0.0 && value <= 65535.0 ? static_cast<std::uint16_t>(value)
                                                     : std::uint16_t{0});
  }
}

void check_bin_content(const std::filesystem::path& file) {
  constexpr std::uint64_t kMostBytes = 240 * 1024;  // a multiple of the size of every point
  constexpr std::size_t kLeastPoints = 100;
  constexpr double kClearly = 0.2;  // of the step with four columns
  const BinLayout usual;
  const BinLayout doubles{4, true};
  RawFile raw(file);
  const auto bytes = raw.read(0, std::min(raw.size(), kMostBytes), "points");
  if (bytes.size() < kLeastPoints * point_size(usual)) return;
  if (plausible_share(bytes, usual) < 0.9 && plausible_share(bytes, {3, true}) > 0.9) {
    fail(file, "does not hold float32 x y z intensity, but float64: the first number is " +
                   std::to_string(value_at(bytes, doubles, 0, 0)) +
                   "; --bin-columns 3d (x y z) or 4d (x y z intensity) reads it");
  }
  const double step = median_step(bytes, usual);
  for (const BinLayout& other : kOthers) {
    const double step_of_other = median_step(bytes, other);
    if (raw.size() % point_size(other) != 0 || !(step_of_other > 0.0)) continue;
    if (!(step_of_other < kClearly * step)) continue;
    fail(file, "does not seem to hold float32 x y z intensity: points are " + std::to_string(step) +
                   " m from the next one in the file, and " + std::to_string(step_of_other) +
                   " m if they have " + to_text(other) + ", " + option_of(other) +
                   "; --bin-columns tells which");
  }
}

}  // namespace dynains
