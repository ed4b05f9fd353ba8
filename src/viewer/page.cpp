#include "page.hpp"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <new>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "dynains/evaluation/scores.hpp"

namespace dynains::viewer {

/// The page without data, embedded by CMake.
std::string_view page_template();

namespace {

using Json = nlohmann::ordered_json;

constexpr double kUnit = 0.002;              // m
constexpr std::int64_t kChunkSteps = 65536;  // steps of kUnit per edge of a chunk

using Steps = std::array<std::int64_t, 3>;

struct PackedPoint {
  Steps chunk;
  std::array<std::uint16_t, 3> steps;
  std::uint64_t order;  // along a Morton curve within the chunk
  const ViewPoint* point;
};

std::uint64_t spread_bits(std::uint64_t value) {
  std::uint64_t spread = 0;
  for (unsigned bit = 0; bit < 16; ++bit) spread |= (value >> bit & 1U) << 3U * bit;
  return spread;
}

PackedPoint packed(const ViewPoint& point) {
  PackedPoint result{{}, {}, 0, &point};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double local = static_cast<double>(point.local[static_cast<Eigen::Index>(axis)]);
    const std::int64_t step = std::llround(local / kUnit);
    // Rounded towards minus infinity.
    result.chunk[axis] = (step >= 0 ? step : step - kChunkSteps + 1) / kChunkSteps;
    result.steps[axis] = static_cast<std::uint16_t>(step - result.chunk[axis] * kChunkSteps);
    result.order |= spread_bits(result.steps[axis]) << axis;
  }
  return result;
}

/// Values of a 16 bit column as differences to the value before.
class Column16 {
 public:
  void restart() { last_ = 0; }
  void add(std::uint16_t value) {
    const auto difference = static_cast<std::uint16_t>(value - last_);
    last_ = value;
    low_ += static_cast<char>(difference & 0xFFU);
    high_ += static_cast<char>(difference >> 8U);
  }
  std::string bytes() const { return low_ + high_; }

 private:
  std::uint16_t last_ = 0;
  std::string low_;
  std::string high_;
};

class Packer {
 public:
  explicit Packer(double full_intensity) : full_intensity_(full_intensity) {}

  void add_layer(int layer, const std::vector<ViewPoint>& points) {
    std::vector<PackedPoint> sorted;
    sorted.reserve(points.size());
    for (const ViewPoint& point : points) sorted.push_back(packed(point));
    std::stable_sort(sorted.begin(), sorted.end(), [](const auto& one, const auto& other) {
      return one.chunk != other.chunk ? one.chunk < other.chunk : one.order < other.order;
    });
    for (std::size_t i = 0; i < sorted.size(); ++i) {
      if (i == 0 || sorted[i].chunk != sorted[i - 1].chunk) begin_chunk(layer, sorted[i].chunk);
      add(sorted[i]);
    }
  }

  const Json& chunks() const { return chunks_; }

  std::string columns() const {
    std::string bytes;
    for (const Column16& column : words_) bytes += column.bytes();
    for (const std::string& column : octets_) bytes += column;
    return bytes;
  }

 private:
  void begin_chunk(int layer, const Steps& chunk) {
    Json origin = Json::array();
    for (const std::int64_t number : chunk) {
      origin.push_back(static_cast<double>(number * kChunkSteps) * kUnit);
    }
    chunks_.push_back({{"layer", layer}, {"count", 0}, {"origin", origin}});
    for (Column16& column : words_) column.restart();
  }

  void add(const PackedPoint& packed_point) {
    const ViewPoint& point = *packed_point.point;
    const auto& [x, y, z] = packed_point.steps;
    const std::array<std::uint16_t, 5> words = {x, y, z, point.scan, point.instance};
    for (std::size_t i = 0; i < words.size(); ++i) words_[i].add(words[i]);
    const double share = static_cast<double>(point.intensity) / full_intensity_;
    const long intensity = std::lround(255.0 * std::clamp(share, 0.0, 1.0));
    const long flags = static_cast<long>(point.label) + 4 * static_cast<long>(point.truth);
    const std::array<long, 4> octets = {intensity, point.belief, point.cause, flags};
    for (std::size_t i = 0; i < octets.size(); ++i) octets_[i] += static_cast<char>(octets[i]);
    auto& count = chunks_.back()["count"];
    count = count.get<std::size_t>() + 1;
  }

  double full_intensity_;
  Json chunks_ = Json::array();
  std::array<Column16, 5> words_;      // see PackedPoints::bytes
  std::array<std::string, 4> octets_;  // behind them
};

/// The 99th percentile of the intensities; 1 if it is not positive.
double full_intensity(const ViewData& data) {
  std::vector<float> values;
  for (const std::vector<ViewPoint>* points : {&data.map, &data.moving}) {
    for (const ViewPoint& point : *points) {
      if (std::isfinite(point.intensity)) values.push_back(point.intensity);
    }
  }
  if (values.empty()) return 1.0;
  const auto rank = static_cast<std::ptrdiff_t>((values.size() - 1) * 99 / 100);
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  const auto value = static_cast<double>(values[static_cast<std::size_t>(rank)]);
  return value > 0.0 ? value : 1.0;
}

std::string compressed(const std::string& bytes) {
  uLongf size = compressBound(static_cast<uLong>(bytes.size()));
  std::string result(size, '\0');
  const int error = compress2(reinterpret_cast<Bytef*>(result.data()), &size,
                              reinterpret_cast<const Bytef*>(bytes.data()),
                              static_cast<uLong>(bytes.size()), Z_DEFAULT_COMPRESSION);
  if (error != Z_OK) throw std::bad_alloc();  // the only error of a large enough buffer
  result.resize(size);
  return result;
}

struct PackedPoints {
  /// zlib stream of columns, each with one value per point: x, y, z, scan, instance (differences
  /// to the point before in its chunk, modulo 65536; first all low bytes, then all high bytes),
  /// intensity, belief, cause, and flags (label + 4 * truth), one byte each.
  std::string bytes;
  /// `unit`: step of x, y, z, m. `intensity`: value of 255. `chunks`: `layer` (0 map, 1 moving),
  /// `count` of points, `origin` of x, y, z in m.
  Json description;
};

/// Packs the map and the moving points. The order of points is not kept. Coordinates are rounded to
/// 2 mm, intensities to steps of 1/255 of their 99th percentile, at which they are cut.
PackedPoints pack(const ViewData& data) {
  const double intensity = full_intensity(data);
  Packer packer(intensity);
  packer.add_layer(0, data.map);
  packer.add_layer(1, data.moving);
  return {compressed(packer.columns()),
          {{"unit", kUnit}, {"intensity", intensity}, {"chunks", packer.chunks()}}};
}

std::string base64(const std::string& bytes) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    for (std::size_t k = i; k < i + 3; ++k) {
      group = group << 8U | (k < bytes.size() ? static_cast<unsigned char>(bytes[k]) : 0U);
    }
    for (std::size_t digit = 0; digit < 4; ++digit) {
      const bool is_padding = i + digit > bytes.size();
      text += is_padding ? '=' : kDigits[group >> (18 - 6 * digit) & 63U];
    }
  }
  return text;
}

Json coordinates(const Eigen::Vector3d& point) { return {point.x(), point.y(), point.z()}; }

Json describe(const ViewData& data, const Json& packing) {
  Json scans = Json::array();
  for (const ViewScan& scan : data.scans) {
    scans.push_back({{"name", scan.name},
                     {"time", scan.time},
                     {"position", coordinates(scan.position.cast<double>())}});
  }
  Json causes = Json::array();
  for (std::size_t cause = 0; cause < kCauseCount; ++cause) {
    causes.push_back({{"name", evaluation::kCauseNames[cause]},
                      {"moving", is_dynamic(static_cast<Cause>(cause))},
                      {"points", data.counts.by_cause[cause]}});
  }
  const ViewCounts& counts = data.counts;
  return {{"title", data.title},
          {"origin", coordinates(data.origin)},
          {"scans", scans},
          {"causes", causes},
          {"counts",
           {{"points", counts.points},
            {"moving", counts.moving},
            {"missed", counts.missed},
            {"lost", counts.lost}}},
          {"has_truth", data.has_truth},
          {"has_beliefs", data.has_beliefs},
          {"packing", packing}};
}

/// JSON that is valid within a script element: `</script>` would end it.
std::string script_json(const Json& json) {
  std::string text;
  for (const char c : json.dump(-1, ' ', true, Json::error_handler_t::replace)) {
    if (c == '<') {
      text += "\\u003c";
    } else {
      text += c;
    }
  }
  return text;
}

/// A bijective mixing of 64 bits: multiplications by odd numbers and shifts.
std::uint64_t mixed(std::uint64_t value) {
  value ^= value >> 31U;
  value *= 0x9E3779B97F4A7C15U;
  value ^= value >> 29U;
  value *= 0xD6E8FEB86659FD93U;
  return value ^ value >> 32U;
}

}  // namespace

ThinnedPoints::ThinnedPoints(std::size_t budget, double cell, std::size_t scans)
    : budget_(budget), cell_(cell), scans_per_cell_(scans) {}

void ThinnedPoints::add(const ViewPoint& point) {
  if (!is_first(point)) return;
  points_.push_back(point);
  // Rarely, so that the time is linear: each call goes over all points.
  if (points_.size() > 2 * budget_ + 1000) thin();
}

std::vector<ViewPoint> ThinnedPoints::take(std::size_t most) {
  while (points_.size() > most) thin();
  occupied_.clear();
  return std::move(points_);
}

bool ThinnedPoints::is_first(const ViewPoint& point) {
  std::uint64_t key = point.scan / scans_per_cell_;
  for (int axis = 0; axis < 3; ++axis) {
    const double cell = std::floor(static_cast<double>(point.local[axis]) / cell_);
    key = mixed(key) + static_cast<std::uint64_t>(static_cast<std::int64_t>(cell));
  }
  return occupied_.insert(mixed(key)).second;
}

void ThinnedPoints::thin() {
  // Scans share cells from a width of 0.6 m on.
  if (cell_ < 0.6 || scans_per_cell_ > std::numeric_limits<ViewPoint::ScanIndex>::max()) {
    cell_ *= 1.25;
  } else {
    scans_per_cell_ *= 2;
  }
  occupied_.clear();
  std::size_t kept = 0;
  for (const ViewPoint& point : points_) {
    if (is_first(point)) points_[kept++] = point;
  }
  points_.resize(kept);
}

void write_page(std::ostream& out, const ViewData& data) {
  const PackedPoints points = pack(data);
  std::string_view page = page_template();
  const auto fill = [&](std::string_view mark, const std::string& content) {
    const std::size_t begin = page.find(mark);
    out << page.substr(0, begin) << content;
    page.remove_prefix(begin + mark.size());
  };
  fill("{{description}}", script_json(describe(data, points.description)));
  fill("{{points}}", base64(points.bytes));
  out << page;
}

}  // namespace dynains::viewer
