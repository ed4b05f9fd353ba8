// Reference scans of a session: what its beams saw, in compact form for later comparisons.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "dynains/errors.hpp"
#include "dynains/evidence/range_image.hpp"
#include "dynains/evidence/visibility.hpp"
#include "dynains/parameters.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/sensor/sensor_model.hpp"
#include "dynains/stage/free_space_config.hpp"

namespace dynains {

/// Bytes of a range image: for each of the two values of Cell, the cells row by row. A value is the
/// difference to the previous value of its row (to 0 for the first), zigzag-coded as 2d or -2d - 1,
/// in groups of 7 bits, the lowest first; bit 7 tells that another group follows. A byte 0 is a
/// difference of 0, and the coded number behind it counts further differences of 0.
inline std::vector<std::uint8_t> pack_image(const RangeImage& image) {
  std::vector<std::uint8_t> bytes;
  const auto put = [&bytes](std::uint32_t value) {
    for (; value >= 0x80U; value >>= 7U) bytes.push_back(static_cast<std::uint8_t>(value | 0x80U));
    bytes.push_back(static_cast<std::uint8_t>(value));
  };
  const RangeImageGrid& grid = image.grid();
  std::uint32_t zeros = 0;
  const auto end_zeros = [&] {
    if (zeros == 0) return;
    put(0);
    put(zeros - 1);
    zeros = 0;
  };
  for (const auto value_of : {&RangeImage::Cell::nearest, &RangeImage::Cell::around}) {
    for (std::int32_t row = 0; row < grid.rows; ++row) {
      std::int32_t previous = 0;
      for (std::int32_t column = 0; column < grid.columns; ++column) {
        const std::int32_t value = image[grid.cell(row, column)].*value_of;
        const std::int32_t step = value - previous;
        previous = value;
        if (step == 0) {
          ++zeros;
          continue;
        }
        end_zeros();
        put(static_cast<std::uint32_t>(step > 0 ? 2 * step : -2 * step - 1));
      }
    }
  }
  end_zeros();
  return bytes;
}

/// Inverse of pack_image(). Returns false if `bytes` is not an image of this grid.
inline bool unpack_image(const RangeImageGrid& grid, Span<const std::uint8_t> bytes,
                         RangeImage& image) {
  std::size_t at = 0;
  bool is_valid = true;
  const auto get = [&]() -> std::uint32_t {
    std::uint32_t value = 0;
    for (std::uint32_t shift = 0; shift < 32 && at < bytes.size(); shift += 7) {
      const std::uint8_t byte = bytes[at++];
      value |= static_cast<std::uint32_t>(byte & 0x7FU) << shift;
      if (byte < 0x80U) return value;
    }
    is_valid = false;
    return 0;
  };
  image.reserve(grid);
  std::uint32_t zeros = 0;
  for (const auto value_of : {&RangeImage::Cell::nearest, &RangeImage::Cell::around}) {
    for (std::int32_t row = 0; row < grid.rows; ++row) {
      std::int32_t value = 0;
      for (std::int32_t column = 0; column < grid.columns && is_valid; ++column) {
        if (zeros > 0) {
          --zeros;
        } else {
          const std::uint32_t code = get();
          if (code == 0) {
            zeros = get();
          } else {
            const auto half = static_cast<std::int32_t>(code >> 1U);
            value += (code & 1U) == 0 ? half : -half - 1;
          }
        }
        is_valid = is_valid && value >= INT16_MIN && value <= INT16_MAX;
        if (is_valid) {
          image.cell(grid.cell(row, column)).*value_of = static_cast<std::int16_t>(value);
        }
      }
    }
  }
  return is_valid && zeros == 0 && at == bytes.size();
}

/// One reference scan of a session.
struct SessionReference {
  std::uint32_t scan = 0;  ///< its number in the session
  Eigen::Isometry3d T_world_beams = Eigen::Isometry3d::Identity();
  RangeImage image;  ///< in the frame of the sensor
};

struct SessionReferencesConfig {
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
  void validate() const { validate_parameters("SessionReferences", *this); }
};

/// Makes the reference scans of one session: the first scan, and each scan that is `reference_way`
/// or `reference_scans` away from the latest reference. The grid of all images is that of the first
/// scan.
class SessionReferences {
 public:
  explicit SessionReferences(const SessionReferencesConfig& config)
      : config_((config.validate(), config)) {}

  /// The grid of the images; without rows until the first scan with a known sensor.
  const RangeImageGrid& grid() const { return grid_; }

  /// The reference of a scan, or null if the scan is not one; valid until the next call. `points`:
  /// m, sensor frame. `verdicts`: final verdict by point. The directions of dynamic points are
  /// unknown: if their verdicts are wrong, nothing else is removed by them.
  const SessionReference* add(PointsView points, Span<const PointLabel> verdicts,
                              const Eigen::Isometry3d& T_world_sensor, std::uint32_t scan) {
    if (is_near_latest(T_world_sensor.translation(), scan)) return nullptr;
    split(points, verdicts);
    if (grid_.rows == 0 && !choose_grid()) return nullptr;
    latest_ = T_world_sensor.translation();
    reference_.scan = scan;
    reference_.T_world_beams = T_world_sensor;
    reference_.image.build(grid_, ground_, objects_, moving_,
                           static_cast<float>(FreeSpaceConfig().lateral_margin), scratch_);
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
    ground_.clear();
    objects_.clear();
    moving_.clear();
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (verdicts[i] == PointLabel::kInvalid) continue;
      if (verdicts[i] == PointLabel::kGround) {
        ground_.push_back(points.x[i], points.y[i], points.z[i]);
        continue;
      }
      objects_.push_back(points.x[i], points.y[i], points.z[i]);
      moving_.push_back(verdicts[i] == PointLabel::kDynamic ? 1 : 0);
    }
  }

  bool choose_grid() {
    PointBuffer all = objects_;
    for (std::size_t i = 0; i < ground_.size(); ++i) {
      all.push_back(ground_.x[i], ground_.y[i], ground_.z[i]);
    }
    const SensorModel sensor = estimate_sensor_model(all);
    if (!sensor.known()) return false;
    grid_ = RangeImageGrid::for_sensor(sensor);
    return true;
  }

  SessionReferencesConfig config_;
  RangeImageGrid grid_;
  std::optional<Eigen::Vector3d> latest_;  // m, position of the sensor, world frame
  PointBuffer ground_, objects_;
  std::vector<std::uint8_t> moving_;
  RangeImage::Scratch scratch_;
  SessionReference reference_;
};

/// Visibility of points from a reference, with the margins of FreeSpaceConfig.
class ReferenceTest {
 public:
  explicit ReferenceTest(const FreeSpaceConfig& config)
      : margin_(static_cast<float>(config.margin)),
        slope_(static_cast<float>(config.margin_slope)) {}

  /// Tests the first `count` points (m; padded for packs). The result is valid until the next call.
  const detail::Visibility& operator()(const SessionReference& reference, const PointBuffer& points,
                                       std::size_t count, const Eigen::Isometry3d& T_world_points) {
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
