#include "bin_layout.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>
#include <system_error>

#include "../byte_reader.hpp"
#include "../failure.hpp"
#include "../scalar.hpp"
#include "../text.hpp"
#include "dynains/errors.hpp"
#include "dynains/io/atomic_file.hpp"
#include "dynains/io/kitti.hpp"
#include "point_sink.hpp"

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__,
              "scans and labels are little-endian and read as they stand");

namespace dynains {
namespace {

constexpr BinLayout kOthers[] = {{3, false}, {5, false}, {6, false}, {8, false}};

/// Column `column` of point `point`; the bytes of both lie in `bytes`.
double value_at(const std::vector<std::uint8_t>& bytes, const BinLayout& layout, std::size_t point,
                std::size_t column) {
  const std::size_t at = point * point_size(layout) + column * value_size(layout);
  return load_scalar(layout.is_double ? Scalar::kDouble : Scalar::kFloat, &bytes[at], false);
}

/// Ratio of points whose coordinates, and the next column of mixed ones, are as those of a sensor,
/// in m, cm or mm.
double plausible_share(const std::vector<std::uint8_t>& bytes, const BinLayout& layout) {
  const int columns = layout.bytes > 0 ? layout.columns : 3;
  const std::size_t count = bytes.size() / point_size(layout);
  std::size_t plausible = 0;
  for (std::size_t i = 0; i < count; ++i) {
    bool is_plausible = true;
    for (int axis = 0; axis < columns; ++axis) {
      const double size = std::abs(value_at(bytes, layout, i, static_cast<std::size_t>(axis)));
      is_plausible = is_plausible && !(size > 1e6) && !(size > 0.0 && size < 1e-6);
    }
    plausible += is_plausible ? 1 : 0;
  }
  return count == 0 ? 1.0 : static_cast<double>(plausible) / static_cast<double>(count);
}

/// Mean difference of values of one column in two points, by the logarithms of their sizes. It is
/// least for the true number of columns, since others mix columns (energy distance, Szekely and
/// Rizzo 2013), and does not depend on the order of points. 0 for fewer than two points.
double spread_of_columns(const std::vector<std::uint8_t>& bytes, const BinLayout& layout) {
  const auto columns = static_cast<std::size_t>(layout.columns);
  const std::size_t count = bytes.size() / point_size(layout);
  const auto size_of = [&](std::size_t i, std::size_t column) {
    const double value = value_at(bytes, layout, i, column);
    return std::log1p(std::abs(value) / 0.1);  // values below it hardly differ
  };
  double sum = 0.0;
  std::size_t pairs = 0;
  for (std::size_t i = 0; i < count; ++i) {
    // By a hash: any other point of the file.
    const std::size_t other = ((i + 1) * std::uint64_t{0x9E3779B97F4A7C15U} >> 32) % count;
    if (other == i) continue;
    for (std::size_t column = 0; column < columns; ++column) {
      const double difference = std::abs(size_of(i, column) - size_of(other, column));
      if (!std::isfinite(difference)) continue;
      sum += difference;
      ++pairs;
    }
  }
  return pairs == 0 ? 0.0 : sum / static_cast<double>(pairs);
}

std::string option_of(const BinLayout& layout) {
  return "--bin-columns " + std::to_string(layout.columns) + (layout.is_double ? "d" : "") +
         (layout.bytes > 0 ? ':' + std::to_string(layout.bytes) : "");
}

/// Points of float32 before other bytes, if nearly all of them are plausible as such. No other size
/// of a point, unless a multiple of 4, puts the bytes of floats into place.
std::optional<BinLayout> mixed_layout(const std::vector<std::uint8_t>& bytes, std::uint64_t size) {
  constexpr int kMaxBytes = 64;
  for (const int columns : {4, 3}) {
    for (int of_point = 4 * columns + 1; of_point < kMaxBytes; ++of_point) {
      const BinLayout layout{columns, false, of_point};
      const bool fits = of_point % 4 != 0 && size % point_size(layout) == 0;
      if (fits && plausible_share(bytes, layout) > 0.9) return layout;
    }
  }
  return std::nullopt;
}

/// Fills `values` from a file that must have exactly that size.
template <class T>
void read_all(const std::filesystem::path& path, std::vector<T>& values) {
  ByteReader(path).read(values.data(), values.size(), "its size");
}

template <class T>
void write_all(const std::filesystem::path& path, Span<const T> values) {
  AtomicFile file(path);
  file.stream().write(reinterpret_cast<const char*>(values.data()),
                      static_cast<std::streamsize>(values.size() * sizeof(T)));
  file.commit(AtomicFile::Sync::kLater);
}

/// The upper 3x4 of a pose, row by row.
void write_row(const Pose& pose, std::ostream& out) {
  for (Eigen::Index i = 0; i < 12; ++i) out << pose(i / 4, i % 4) << (i == 11 ? '\n' : ' ');
}

}  // namespace

BinLayout parse_bin_layout(const std::string& text) {
  const std::size_t colon = text.find(':');
  std::string_view digits = std::string_view(text).substr(0, colon);
  BinLayout layout;
  layout.is_double = !digits.empty() && digits.back() == 'd';
  if (layout.is_double) digits.remove_suffix(1);
  const auto read = [](std::string_view token, std::size_t least, std::size_t most, int& value) {
    const auto number = text::parse_number(token);
    const bool is_valid = number && *number >= static_cast<double>(least) &&
                          *number <= static_cast<double>(most) && *number == std::floor(*number);
    if (is_valid) value = static_cast<int>(*number);
    return is_valid;
  };
  const bool has_columns = read(digits, 3, 64, layout.columns);
  const bool has_bytes =
      colon == std::string::npos ||
      read(std::string_view(text).substr(colon + 1), point_size(layout), 1024, layout.bytes);
  if (has_columns && has_bytes) return layout;
  throw ConfigError("--bin-columns " + text +
                    ": expected 3 to 64, with a d for float64, and :BYTES if other bytes follow");
}

std::string to_text(const BinLayout& layout) {
  const std::string type = layout.is_double ? "float64" : "float32";
  if (layout.bytes > 0) {
    return std::to_string(layout.bytes) + " bytes that begin with " +
           to_text(BinLayout{layout.columns, layout.is_double});
  }
  if (layout.columns == 3) return type + " x y z";
  if (layout.columns == 4) return type + " x y z intensity";
  return std::to_string(layout.columns) + " columns of " + type;
}

std::uint64_t count_bin_points(const std::filesystem::path& file, const BinLayout& layout) {
  const std::uint64_t bytes = size_of_file(file);
  if (bytes % point_size(layout) == 0) return bytes / point_size(layout);
  fail(file, "truncated at byte " + std::to_string(bytes) + ": expected a multiple of " +
                 std::to_string(point_size(layout)) + " bytes (" + to_text(layout) + ")");
}

void read_bin_points(const std::filesystem::path& file, const BinLayout& layout,
                     std::vector<float>& xyzi, std::vector<std::uint16_t>* ring) {
  const std::uint64_t count = count_bin_points(file, layout);
  const auto bytes = ByteReader(file).read_at(0, count * point_size(layout), "points");
  const auto columns = std::min<std::size_t>(4, static_cast<std::size_t>(layout.columns));
  xyzi.assign(4 * static_cast<std::size_t>(count), 0.0F);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t column = 0; column < columns; ++column) {
      xyzi[4 * i + column] = to_float(value_at(bytes, layout, i, column));
    }
    if (ring != nullptr) ring->push_back(ring_number(value_at(bytes, layout, i, columns)));
  }
}

void check_bin_content(const std::filesystem::path& file) {
  const BinLayout usual;
  ByteReader raw(file);
  // A multiple of the size of every point.
  const auto bytes = raw.read_at(0, std::min<std::uint64_t>(raw.size(), 240 * 1024), "points");
  if (bytes.size() < 100 * point_size(usual)) return;
  if (plausible_share(bytes, usual) < 0.9) {
    const std::string text = "does not hold float32 x y z intensity, but ";
    if (plausible_share(bytes, {3, true}) > 0.9) {
      fail(file, text + "float64: the first number is " +
                     std::to_string(value_at(bytes, {3, true}, 0, 0)) +
                     "; --bin-columns 3d (x y z) or 4d (x y z intensity) reads it");
    }
    if (const auto mixed = mixed_layout(bytes, raw.size())) {
      fail(file, text + "points of " + to_text(*mixed) + ": " + option_of(*mixed) + " reads it");
    }
  }
  // Spreads of few values differ by chance.
  const std::size_t values = bytes.size() / value_size(usual);
  const double clearly = 1.0 - std::max(0.1, 4.0 / std::sqrt(static_cast<double>(values)));
  const double spread = spread_of_columns(bytes, usual);
  const BinLayout* best = nullptr;
  double least = spread;
  for (const BinLayout& other : kOthers) {
    if (raw.size() % point_size(other) != 0 || plausible_share(bytes, other) < 0.9) continue;
    const double spread_of_other = spread_of_columns(bytes, other);
    if (!(spread_of_other < clearly * least)) continue;
    best = &other;
    least = spread_of_other;
  }
  if (best == nullptr) return;
  fail(file, "does not seem to hold float32 x y z intensity: values of one column differ by " +
                 std::to_string(std::lround(100.0 * (1.0 - least / spread))) +
                 " % less if points have " + to_text(*best) + ", " + option_of(*best) +
                 "; give them with --bin-columns");
}

void read_scan(const std::filesystem::path& file, std::vector<float>& xyzi) {
  const std::size_t count = 4 * static_cast<std::size_t>(count_bin_points(file, BinLayout()));
  if (count > xyzi.capacity()) {
    xyzi = {};
    xyzi.reserve(count + count / 8);  // scans of one sensor differ in size; resize() would double
  }
  xyzi.resize(count);
  read_all(file, xyzi);
}

std::vector<std::uint32_t> read_labels(const std::filesystem::path& file, std::size_t count) {
  const std::uint64_t size = size_of_file(file);
  if (size != count * sizeof(std::uint32_t)) {
    fail(file, "has " + std::to_string(size) + " bytes, expected " +
                   std::to_string(count * sizeof(std::uint32_t)) + " (uint32 for each of " +
                   std::to_string(count) + " points)");
  }
  std::vector<std::uint32_t> labels(count);
  read_all(file, labels);
  return labels;
}

std::vector<std::uint8_t> read_point_bytes(const std::filesystem::path& file, std::size_t count) {
  const std::string expected =
      "; expected a byte for each of the scan's " + std::to_string(count) + " points";
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (error == std::errc::no_such_file_or_directory) return {};
  if (error) fail(file, error.message() + expected);
  if (size != count) fail(file, "has " + std::to_string(size) + " bytes" + expected);
  std::vector<std::uint8_t> bytes(count);
  read_all(file, bytes);
  return bytes;
}

void write_scan(const std::filesystem::path& file, Span<const float> xyzi) {
  if (xyzi.size() % 4 != 0) fail(file, "expected 4 floats for each point to write");
  write_all(file, xyzi);
}

void write_labels(const std::filesystem::path& file, Span<const std::uint32_t> labels) {
  write_all(file, labels);
}

void write_point_bytes(const std::filesystem::path& file, Span<const std::uint8_t> bytes) {
  write_all(file, bytes);
}

void write_poses(const std::filesystem::path& file, Span<const Pose> poses) {
  AtomicFile out(file);
  text::exact(out.stream());
  for (const Pose& pose : poses) write_row(pose, out.stream());
  out.commit();
}

void write_times(const std::filesystem::path& file, Span<const double> times) {
  AtomicFile out(file);
  text::exact(out.stream());
  for (const double time : times) out.stream() << time << '\n';
  out.commit();
}

void write_calib(const std::filesystem::path& file, const Pose& Tr) {
  AtomicFile out(file);
  write_row(Tr, text::exact(out.stream()) << "Tr: ");
  out.commit();
}

}  // namespace dynains
