// Reference scans of a session: what its beams saw, in compact form for later comparisons.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "dynains/evidence/free_space_config.hpp"
#include "dynains/evidence/range_image.hpp"
#include "dynains/evidence/visibility.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/sensor/sensor_model.hpp"

namespace dynains {

/// Bytes of a range image: for each of the two values of Cell, the cells row by row. A value is the
/// difference to the previous value of its row (to 0 for the first), zigzag-coded as 2d or -2d - 1,
/// in groups of 7 bits, the lowest first; bit 7 tells that another group follows. A byte 0 is a
/// difference of 0, and the coded number behind it counts further differences of 0.
/// They are added to `bytes`.
inline void pack_image(const RangeImage& image, std::vector<std::uint8_t>& bytes) {
  const RangeImageGrid& grid = image.grid();
  const auto put = [&](std::uint32_t value) {
    for (; value >= 0x80U; value >>= 7U) bytes.push_back(static_cast<std::uint8_t>(value | 0x80U));
    bytes.push_back(static_cast<std::uint8_t>(value));
  };
  std::uint32_t zeros = 0;
  const auto end_zeros = [&] {
    if (zeros == 0) return;
    put(0);
    put(zeros - 1);
    zeros = 0;
  };
  for (const auto value_of : {&RangeImage::Cell::nearest, &RangeImage::Cell::around}) {
    for (std::int32_t row = 0; row < grid.rows; ++row) {
      const RangeImage::Cell* const cells = &image[grid.cell(row, 0)];
      std::int32_t before = 0;
      for (std::int32_t column = 0; column < grid.columns; ++column) {
        const std::int32_t step = cells[column].*value_of - before;
        before = cells[column].*value_of;
        if (step == 0) {
          ++zeros;
          continue;
        }
        end_zeros();
        put(static_cast<std::uint32_t>(step) << 1U ^ (step < 0 ? ~0U : 0U));
      }
    }
  }
  end_zeros();
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
  image.clear(grid);
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

/// Makes the reference scans of one session: the first scan, and each scan that is 1 m of way or
/// some scans away from the latest reference. The grid of all images is that of the first scan.
class RecordingReferences {
 public:
  /// `most_scans`: from one reference to the next. `lateral_margin`: m, of FreeSpaceConfig.
  RecordingReferences(std::uint32_t most_scans, double lateral_margin)
      : most_scans_(most_scans), lateral_margin_(lateral_margin) {}

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
    reference_.image.build(grid_, split_.ground(), split_.non_ground(), moving_,
                           static_cast<float>(lateral_margin_), scratch_);
    forget_moving(reference_.image);
    return &reference_;
  }

 private:
  bool is_near_latest(const Eigen::Vector3d& position, std::uint32_t scan) const {
    constexpr double kWay = 1.0;  // m
    return latest_ && (position - *latest_).norm() < kWay && scan - reference_.scan < most_scans_;
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
    split_.resize(points.size());
    moving_.clear();
    std::size_t count = 0;
    for (const bool takes_ground : {true, false}) {
      for (std::size_t i = 0; i < points.size(); ++i) {
        const bool is_ground = verdicts[i] == PointLabel::kGround;
        if (verdicts[i] == PointLabel::kInvalid || is_ground != takes_ground) continue;
        split_.points.x[count] = points.x[i];
        split_.points.y[count] = points.y[i];
        split_.points.z[count] = points.z[i];
        ++count;
        if (!is_ground) moving_.push_back(verdicts[i] == PointLabel::kDynamic ? 1 : 0);
      }
      if (takes_ground) split_.ground_count = count;
    }
    split_.count = count;
  }

  bool choose_grid() {
    const SensorModel sensor =
        estimate_sensor_model(PointsView(split_.points).subview(0, split_.count));
    if (sensor.known()) grid_ = RangeImageGrid::for_sensor(sensor);
    return sensor.known();
  }

  std::uint32_t most_scans_;
  double lateral_margin_;  // m
  RangeImageGrid grid_;
  std::optional<Eigen::Vector3d> latest_;  // m, position of the sensor, world frame
  GroundSplit split_;
  std::vector<std::uint8_t> moving_;  // by point above the ground
  RangeImage::Scratch scratch_;
  RecordingReference reference_;
};

/// Tests the first `count` points (m, relative to `origin`, axes of the world; padded for packs) by
/// a reference, with the margins of `config`. Returns `out`.
inline const detail::Visibility& test_visibility(const RecordingReference& reference,
                                                 const FreeSpaceConfig& config,
                                                 const PointBuffer& points, std::size_t count,
                                                 const Eigen::Vector3d& origin,
                                                 detail::Visibility& out) {
  const Pose T = detail::composed(detail::inverted(reference.T_world_beams),
                                  Pose(Eigen::Translation3d(origin)));
  detail::test_visibility(reference.image, T, points, count, static_cast<float>(config.margin),
                          static_cast<float>(config.margin_slope), out);
  return out;
}

}  // namespace dynains
