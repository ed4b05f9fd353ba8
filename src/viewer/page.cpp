#include "page.hpp"

#include <zlib.h>

#include <algorithm>
#include <new>
#include <string_view>
#include <tuple>

#include "dynains/evaluation/scores.hpp"

namespace dynains::viewer {

/// The page without data, embedded by CMake.
std::string_view page_template();

namespace {

using Json = nlohmann::ordered_json;
using Points = std::vector<ViewPoint>;

constexpr double kMinCell = 0.05;  // m
constexpr double kUnit = 0.002;    // m, of coordinates

/// A third is left for the moving points.
std::size_t max_static(std::size_t max_points) { return max_points - max_points / 3; }

struct PackedPoint {
  std::uint64_t order = 0;              // along a Morton curve
  std::array<std::int32_t, 3> steps{};  // of kUnit
  const ViewPoint* point;
};

std::uint64_t spread_bits(std::uint64_t value) {
  std::uint64_t spread = 0;
  for (unsigned bit = 0; bit < 21; ++bit) spread |= (value >> bit & 1U) << 3U * bit;
  return spread;
}

PackedPoint packed(const ViewPoint& point) {
  constexpr std::int64_t kHalf = 1 << 20;  // The curve is whole within 2 km of the origin.
  PackedPoint result;
  result.point = &point;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double local = static_cast<double>(point.local[static_cast<Eigen::Index>(axis)]);
    const std::int64_t step = std::llround(local / kUnit);
    result.steps[axis] = static_cast<std::int32_t>(step);
    result.order |= spread_bits(static_cast<std::uint64_t>(step + kHalf)) << axis;
  }
  return result;
}

/// The 99th percentile of the intensities; 1 if it is not positive.
double full_intensity(const std::array<Points, 2>& layers) {
  std::vector<float> values;
  for (const Points& points : layers) {
    for (const ViewPoint& point : points) {
      if (std::isfinite(point.intensity)) values.push_back(point.intensity);
    }
  }
  if (values.empty()) return 1.0;
  const auto rank = static_cast<std::ptrdiff_t>((values.size() - 1) * 99 / 100);
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  const auto value = static_cast<double>(values[static_cast<std::size_t>(rank)]);
  return value > 0.0 ? value : 1.0;
}

/// One layer after the other, each along a Morton curve. Columns of x, y, z (steps of 2 mm), scan
/// and instance: differences to the point before, of which 2 d stands for d >= 0 and -2 d - 1 for
/// d < 0, first all lowest bytes of 4. Then, a byte for each point, intensity (255 at
/// full_intensity()), belief, cause and flags (label + 4 * truth).
std::string columns_of(std::array<Points, 2> layers) {
  constexpr std::size_t kWords = 5, kBytes = 4;  // columns
  const std::size_t total = layers[0].size() + layers[1].size();
  const double full = full_intensity(layers);
  std::string columns((4 * kWords + kBytes) * total, '\0');
  std::array<std::int64_t, kWords> last{};
  std::size_t i = 0;
  for (Points& points : layers) {
    std::vector<PackedPoint> sorted;
    sorted.reserve(points.size());
    for (const ViewPoint& point : points) sorted.push_back(packed(point));
    std::sort(sorted.begin(), sorted.end(), [](const auto& one, const auto& other) {
      return std::tie(one.order, one.point) < std::tie(other.order, other.point);
    });
    for (const auto& [order, steps, point] : sorted) {
      const std::array<std::int64_t, kWords> words = {steps[0], steps[1], steps[2], point->scan,
                                                      point->instance};
      for (std::size_t column = 0; column < kWords; ++column) {
        const std::int64_t step = words[column] - last[column];
        const std::int64_t code = step >= 0 ? 2 * step : -2 * step - 1;
        for (std::size_t k = 0; k < 4; ++k) {
          columns[(4 * column + k) * total + i] = static_cast<char>(code >> 8 * k & 0xFF);
        }
      }
      last = words;
      const double share = std::clamp(static_cast<double>(point->intensity) / full, 0.0, 1.0);
      const long flags = static_cast<long>(point->label) + 4 * static_cast<long>(point->truth);
      const std::array<long, kBytes> bytes = {std::lround(255.0 * share), point->belief,
                                              point->cause, flags};
      for (std::size_t k = 0; k < kBytes; ++k) {
        columns[(4 * kWords + k) * total + i] = static_cast<char>(bytes[k]);
      }
      ++i;
    }
    Points().swap(points);  // memory for the compression
  }
  return columns;
}

/// A zlib stream.
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

}  // namespace

Page::Page(const std::string& title, const Eigen::Vector3d& origin, bool has_truth, double voxel,
           std::size_t max_points)
    : origin_(origin),
      max_points_(max_points),
      static_(max_static(max_points), std::max(voxel, kMinCell),
              std::numeric_limits<ViewPoint::ScanIndex>::max() + 1),
      moving_(max_points, kMinCell, 1),
      description_{{"title", title},         {"origin", coordinates(origin)},
                   {"has_truth", has_truth}, {"has_beliefs", false},
                   {"scans", Json::array()}, {"causes", Json::array()}} {}

void Page::begin_scan(const std::string& name, double time, const Eigen::Vector3f& position) {
  ++scans_;
  description_["scans"].push_back(
      {{"name", name}, {"time", time}, {"position", coordinates(position.cast<double>())}});
}

void Page::add(ViewPoint point) {
  point.scan = static_cast<ViewPoint::ScanIndex>(scans_ - 1);
  const bool is_moving = point.label == ViewLabel::kMoving;
  const bool stands = point.truth == ViewTruth::kStatic || point.truth == ViewTruth::kStaticObject;
  ++points_;
  ++by_cause_[point.cause];
  removed_ += is_moving ? 1U : 0U;
  lost_ += is_moving && stands ? 1U : 0U;
  missed_ += point.label == ViewLabel::kStatic && point.truth == ViewTruth::kMoving ? 1U : 0U;
  if (point.label != ViewLabel::kNotJudged) (is_moving ? moving_ : static_).add(point);
}

void Page::write(std::ostream& out) {
  std::array<Points, 2> layers = {static_.take(max_static(max_points_)), {}};
  layers[1] = moving_.take(max_points_ - layers[0].size());
  for (std::size_t cause = 0; cause < kCauseCount; ++cause) {
    description_["causes"].push_back(
        {{"name", evaluation::kCauseNames[cause]}, {"points", by_cause_[cause]}});
  }
  description_["counts"] = {
      {"points", points_}, {"moving", removed_}, {"missed", missed_}, {"lost", lost_}};
  description_["packing"] = {{"unit", kUnit}, {"counts", {layers[0].size(), layers[1].size()}}};
  const std::string points = compressed(columns_of(std::move(layers)));
  std::string_view page = page_template();
  const auto fill = [&](std::string_view mark, const std::string& content) {
    const std::size_t begin = page.find(mark);
    out << page.substr(0, begin) << content;
    page.remove_prefix(begin + mark.size());
  };
  fill("{{description}}", script_json(description_));
  fill("{{points}}", base64(points));
  out << page;
}

}  // namespace dynains::viewer
