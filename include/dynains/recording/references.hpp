// Reference scans of a session: what its beams saw, in compact form for later comparisons.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <utility>
#include <vector>

#include "dynains/errors.hpp"
#include "dynains/evidence/free_space_config.hpp"
#include "dynains/evidence/range_image.hpp"
#include "dynains/evidence/visibility.hpp"
#include "dynains/parameters.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/sensor/sensor_model.hpp"

namespace dynains {

/// Room that pack_image() needs for an image of this grid. A difference has 17 bits, so that its
/// code has three bytes at most, and four are written at once.
inline std::size_t most_packed_bytes(const RangeImageGrid& grid) {
  return 6 * static_cast<std::size_t>(grid.rows) * static_cast<std::size_t>(grid.columns) + 8;
}

/// Bytes of a range image: for each of the two values of Cell, the cells row by row. A value is the
/// difference to the previous value of its row (to 0 for the first), zigzag-coded as 2d or -2d - 1,
/// in groups of 7 bits, the lowest first; bit 7 tells that another group follows. A byte 0 is a
/// difference of 0, and the coded number behind it counts further differences of 0.
/// Writes to `to`, which must have room for most_packed_bytes(), and returns the end.
inline std::uint8_t* pack_image(const RangeImage& image, std::uint8_t* to) {
  const RangeImageGrid& grid = image.grid();
  const auto put = [&to](std::uint32_t value) {
    constexpr std::uint32_t kMore[] = {0, 0x80U, 0x8080U};  // bit 7 of the groups before the last
    const std::uint32_t more = (value >= 1U << 7U ? 1U : 0U) + (value >= 1U << 14U ? 1U : 0U);
    const std::uint32_t code =
        (value & 0x7FU) | (value & 0x3F80U) << 1U | (value & 0x1FC000U) << 2U | kMore[more];
    std::memcpy(to, &code, sizeof(code));
    to += more + 1;
  };
  std::vector<std::uint32_t> codes(static_cast<std::size_t>(grid.columns));
  std::uint32_t zeros = 0;
  const auto end_zeros = [&] {
    *to++ = 0;
    for (--zeros; zeros >= 0x80U; zeros >>= 7U) *to++ = static_cast<std::uint8_t>(zeros | 0x80U);
    *to++ = static_cast<std::uint8_t>(zeros);
    zeros = 0;
  };
  for (const auto value_of : {&RangeImage::Cell::nearest, &RangeImage::Cell::around}) {
    for (std::int32_t row = 0; row < grid.rows; ++row) {
      const RangeImage::Cell* const cells = &image[grid.cell(row, 0)];
      const auto code_of = [](std::int32_t step) {
        return static_cast<std::uint32_t>(step) << 1U ^ (step < 0 ? ~0U : 0U);
      };
      codes[0] = code_of(cells[0].*value_of);
      for (std::size_t i = 1; i < codes.size(); ++i) {
        codes[i] = code_of(cells[i].*value_of - cells[i - 1].*value_of);
      }
      for (const std::uint32_t code : codes) {
        if (code == 0) {
          ++zeros;
          continue;
        }
        if (zeros > 0) end_zeros();
        put(code);
      }
    }
  }
  if (zeros > 0) end_zeros();
  return to;
}

/// Inverse of pack_image(). Returns false if `bytes` is not an image of this grid.
inline bool unpack_image(const RangeImageGrid& grid, Span<const std::uint8_t> bytes,
                         RangeImage& image) {
  const std::uint8_t* at = bytes.begin();
  bool is_valid = true;
  const auto get = [&]() -> std::uint32_t {
    std::uint32_t value = 0;
    for (std::uint32_t shift = 0; shift < 32 && at != bytes.end(); shift += 7) {
      const std::uint8_t byte = *at++;
      value |= static_cast<std::uint32_t>(byte & 0x7FU) << shift;
      if (byte < 0x80U) return value;
    }
    is_valid = false;
    return 0;
  };
  image.reserve(grid);
  std::uint64_t zeros = 0;
  for (const auto value_of : {&RangeImage::Cell::nearest, &RangeImage::Cell::around}) {
    for (std::int32_t row = 0; row < grid.rows; ++row) {
      RangeImage::Cell* const cells = &image.cell(grid.cell(row, 0));
      std::int32_t value = 0;
      for (std::int32_t column = 0; column < grid.columns; ++column) {
        if (zeros > 0) {
          --zeros;
        } else if (const std::uint32_t code = get(); code == 0) {
          zeros = get();
        } else {
          const auto half = static_cast<std::int32_t>(code >> 1U);
          value += (code & 1U) == 0 ? half : -half - 1;
          is_valid = is_valid && value >= INT16_MIN && value <= INT16_MAX;
        }
        if (!is_valid) return false;
        cells[column].*value_of = static_cast<std::int16_t>(value);
      }
    }
  }
  return zeros == 0 && at == bytes.end();
}

/// One reference scan of a session.
struct RecordingReference {
  std::uint32_t scan = 0;  ///< its number in the session
  Pose T_world_beams = Pose::Identity();
  RangeImage image;  ///< in the frame of the sensor
};

struct RecordingReferencesConfig {
  double reference_way = 1.0;  ///< m
  int reference_scans = 10;    ///< scans

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& visitor) {
    visitor(Parameter{"reference_way", self.reference_way, closed(0, 20), "m",
                      "way of the sensor between two reference scans that a session keeps"});
    visitor(Parameter{"reference_scans", self.reference_scans, closed(1, 1000000), "scans",
                      "most scans between two reference scans that a session keeps"});
  }

  /// Throws ConfigError.
  void validate() const { validate_parameters("RecordingReferences", *this); }
};

/// Makes the reference scans of one session: the first scan, and each scan that is `reference_way`
/// or `reference_scans` away from the latest reference. The grid of all images is that of the first
/// scan.
class RecordingReferences {
 public:
  /// `lateral_margin`: m, of FreeSpaceConfig. Throws ConfigError.
  RecordingReferences(const RecordingReferencesConfig& config, double lateral_margin)
      : config_((config.validate(), config)), lateral_margin_(lateral_margin) {}

  /// The grid of the images; without rows until the first scan with a known sensor.
  const RangeImageGrid& grid() const { return grid_; }

  /// The reference of a scan, or null if the scan is not one; valid until the next call. `points`:
  /// m, sensor frame. `verdicts`: final verdict by point. The directions of dynamic points are
  /// unknown: if their verdicts are wrong, nothing else is removed by them.
  const RecordingReference* add(PointsView points, Span<const PointLabel> verdicts,
                                const Pose& T_world_sensor, std::uint32_t scan) {
    if (is_near_latest(T_world_sensor.translation(), scan)) return nullptr;
    split(points, verdicts);
    if (grid_.rows == 0 && !choose_grid()) return nullptr;
    latest_ = T_world_sensor.translation();
    reference_.scan = scan;
    reference_.T_world_beams = T_world_sensor;
    reference_.image.build(grid_, ground(), objects(), {moving_.data(), object_count_},
                           static_cast<float>(lateral_margin_), scratch_);
    forget_moving(reference_.image);
    return &reference_;
  }

 private:
  bool is_near_latest(const Eigen::Vector3d& position, std::uint32_t scan) const {
    return latest_ && (position - *latest_).norm() < config_.reference_way &&
           scan - reference_.scan < static_cast<std::uint32_t>(config_.reference_scans);
  }

  static void forget_moving(RangeImage& image) {
    for (std::int32_t row = 0; row < image.grid().rows; ++row) {
      for (std::int32_t column = 0; column < image.grid().columns; ++column) {
        RangeImage::Cell& cell = image.cell(image.grid().cell(row, column));
        const bool has_moving = (cell.nearest & RangeImage::kMoving) != 0;
        if (has_moving) cell = {RangeImage::kNothing, RangeImage::kUnknown};
      }
    }
  }

  void split(PointsView points, Span<const PointLabel> verdicts) {
    const auto put = [&](PointBuffer& to, std::size_t at, std::size_t i) {
      to.x[at] = points.x[i];
      to.y[at] = points.y[i];
      to.z[at] = points.z[i];
    };
    ground_.grow(points.size());
    objects_.grow(points.size());
    detail::grow(moving_, points.size());
    ground_count_ = object_count_ = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (verdicts[i] == PointLabel::kInvalid) continue;
      if (verdicts[i] == PointLabel::kGround) {
        put(ground_, ground_count_++, i);
        continue;
      }
      moving_[object_count_] = verdicts[i] == PointLabel::kDynamic ? 1 : 0;
      put(objects_, object_count_++, i);
    }
  }

  PointsView ground() const { return PointsView(ground_).subview(0, ground_count_); }
  PointsView objects() const { return PointsView(objects_).subview(0, object_count_); }

  bool choose_grid() {
    PointBuffer all;
    for (const PointsView& part : {objects(), ground()}) {
      for (std::size_t i = 0; i < part.size(); ++i) all.push_back(part.x[i], part.y[i], part.z[i]);
    }
    const SensorModel sensor = estimate_sensor_model(all);
    if (!sensor.known()) return false;
    grid_ = RangeImageGrid::for_sensor(sensor);
    return true;
  }

  RecordingReferencesConfig config_;
  double lateral_margin_;  // m
  RangeImageGrid grid_;
  std::optional<Eigen::Vector3d> latest_;  // m, position of the sensor, world frame
  PointBuffer ground_, objects_;           // with room for more
  std::vector<std::uint8_t> moving_;
  std::size_t ground_count_ = 0, object_count_ = 0;
  RangeImage::Scratch scratch_;
  RecordingReference reference_;
};

/// Visibility of points from a reference, with the margins of FreeSpaceConfig.
class ReferenceTest {
 public:
  explicit ReferenceTest(const FreeSpaceConfig& config)
      : margin_(static_cast<float>(config.margin)),
        slope_(static_cast<float>(config.margin_slope)) {}

  /// Tests the first `count` points (m; padded for packs). The result is valid until the next call.
  const detail::Visibility& operator()(const RecordingReference& reference,
                                       const PointBuffer& points, std::size_t count,
                                       const Pose& T_world_points) {
    detail::test_visibility(
        reference.image,
        detail::composed(detail::inverted(reference.T_world_beams), T_world_points), points, count,
        margin_, slope_, visibility_);
    return visibility_;
  }

 private:
  float margin_, slope_;
  detail::Visibility visibility_;
};

}  // namespace dynains
