// Reference scans of a session: what its beams saw, in compact form for later comparisons.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <vector>

#include "dynains/evidence/free_space_config.hpp"
#include "dynains/evidence/range_image.hpp"
#include "dynains/evidence/visibility.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/recording/byte_store.hpp"
#include "dynains/sensor/sensor_model.hpp"
#include "dynains/simd/pack_loops.hpp"

namespace dynains {

namespace detail {

/// A value of up to 64 cells in a row, as changes from cell to cell.
struct RowChanges {
  std::uint64_t cells = 0;  ///< bits of those that change, the first lowest
  std::array<std::int16_t, kWordBits + 1> values =
      {};  ///< before these cells, and after each change

  /// Takes `value_of(i)` of the next `count` cells of the row, and adds the changes to `bytes`.
  template <class ValueOf>
  void pack(std::int32_t count, ValueOf&& value_of, std::vector<std::uint8_t>& bytes) {
    std::int16_t latest = values[0];
    std::uint8_t changes = 0;
    cells = 0;
    for (std::int32_t i = 0; i < count; ++i) {
      const std::int16_t value = value_of(i);
      const bool is_new = value != latest;
      latest = value;
      values[changes + 1U] = latest;
      cells |= std::uint64_t{is_new} << i;
      changes = static_cast<std::uint8_t>(changes + is_new);
    }
    bytes.push_back(changes);
    if (changes > 0) add_bytes(&cells, 1, bytes);
    add_bytes(&values[1], changes, bytes);
    values[0] = latest;
  }
  /// Reads the bytes of pack() from `at`, which advances. Returns false if they are not valid.
  bool unpack(const std::uint8_t*& at, const std::uint8_t* end) {
    if (at == end) return false;
    const std::size_t changes = *at++;
    const std::size_t size = changes == 0 ? 0 : sizeof(cells) + changes * sizeof(values[0]);
    if (changes > kWordBits || static_cast<std::size_t>(end - at) < size) return false;
    cells = 0;
    if (changes > 0) {
      std::memcpy(&cells, at, sizeof(cells));
      std::memcpy(&values[1], at + sizeof(cells), size - sizeof(cells));
    }
    at += size;
    return count_ones(cells) == changes;
  }
};

}  // namespace detail

/// Adds a range image to `bytes`, row by row. A part of a row has 64 columns, the last part fewer.
/// Each part has the changes of Cell::nearest, then the changes of Cell::around, then the changes
/// of the beams, with the place of the column in the lower byte and that of the row in the upper
/// one. A cell changes if its value differs from the value of the cell before; before the first
/// cell of a row it is 0. A byte counts the changes of the part. If there are any, 64 bits mark the
/// cells that change, the lowest bit for the first column, and the new values follow as int16.
inline void pack_image(const RangeImage& image, std::vector<std::uint8_t>& bytes) {
  const RangeImageGrid& grid = image.grid();
  for (std::int32_t row = 0; row < grid.rows; ++row) {
    detail::RowChanges nearest, around, beam;
    for (std::int32_t begin = 0; begin < grid.columns; begin += 64) {
      const RangeImage::Cell* const cells = &image[grid.cell(row, begin)];
      const RangeImage::Beam* const beams = image.beams() + grid.cell(row, begin);
      const std::int32_t count = std::min(64, grid.columns - begin);
      nearest.pack(
          count, [&](std::int32_t i) { return cells[i].nearest; }, bytes);
      around.pack(
          count, [&](std::int32_t i) { return cells[i].around; }, bytes);
      beam.pack(
          count, [&](std::int32_t i) { return static_cast<std::int16_t>(beams[i]); }, bytes);
    }
  }
}

/// Inverse of pack_image(). Returns false if `bytes` is not an image of this grid.
inline bool unpack_image(const RangeImageGrid& grid, Span<const std::uint8_t> bytes,
                         RangeImage& image) {
  const std::uint8_t* at = bytes.begin();
  image.allocate(grid);
  for (std::int32_t row = 0; row < grid.rows; ++row) {
    detail::RowChanges nearest, around, beam;
    for (std::int32_t begin = 0; begin < grid.columns; begin += 64) {
      if (!nearest.unpack(at, bytes.end()) || !around.unpack(at, bytes.end()) ||
          !beam.unpack(at, bytes.end())) {
        return false;
      }
      RangeImage::Cell* const cells = &image.cell(grid.cell(row, begin));
      RangeImage::Beam* const beams = &image.beam(grid.cell(row, begin));
      const std::int32_t count = std::min(64, grid.columns - begin);
      const std::int16_t *near = &nearest.values[0], *least = &around.values[0],
                         *place = &beam.values[0];
      for (std::int32_t i = 0; i < count; ++i) {
        near += nearest.cells >> i & 1U;
        least += around.cells >> i & 1U;
        place += beam.cells >> i & 1U;
        cells[i] = {*near, *least};
        beams[i] = static_cast<RangeImage::Beam>(*place);
      }
      nearest.values[0] = *near;
      around.values[0] = *least;
      beam.values[0] = *place;
    }
  }
  return at == bytes.end();
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
  /// `max_scans`: from one reference to the next. `lateral_margin`: m, of FreeSpaceConfig.
  RecordingReferences(std::uint32_t max_scans, double lateral_margin)
      : max_scans_(max_scans), lateral_margin_(lateral_margin) {}

  /// The grid of the images; without rows until the first scan with a known sensor.
  const RangeImageGrid& grid() const { return grid_; }

  /// The reference of a scan, or null if the scan is not one; valid until the next call. `points`:
  /// m, sensor frame. `verdicts`: final verdict by point. Directions of dynamic points are unknown
  /// in the image, so that a wrong verdict on them removes nothing else.
  const RecordingReference* add(PointsView points, Span<const PointLabel> verdicts,
                                const Pose& T_world_sensor, std::uint32_t scan) {
    constexpr double kWay = 1.0;  // m
    const Eigen::Vector3d position = T_world_sensor.translation();
    const bool is_near = latest_ && (position - *latest_).norm() < kWay;
    if (is_near && scan - reference_.scan < max_scans_) return nullptr;
    split(points, verdicts);
    if (grid_.rows == 0) {
      const SensorModel sensor =
          estimate_sensor_model(PointsView(split_.points).subview(0, split_.count));
      if (!sensor.known()) return nullptr;
      grid_ = RangeImageGrid::for_sensor(sensor);
    }
    latest_ = position;
    reference_.scan = scan;
    reference_.T_world_beams = T_world_sensor;
    const RangeImage::Scan only = {split_.ground(), split_.non_ground(), moving_, {}};
    reference_.image.build(grid_, {&only, 1}, static_cast<float>(lateral_margin_), scratch_);
    forget_moving(reference_.image);
    return &reference_;
  }

 private:
  static void forget_moving(RangeImage& image) {
    for (std::int32_t row = 0; row < image.grid().rows; ++row) {
      RangeImage::Cell* const cells = &image.cell(image.grid().cell(row, 0));
      std::replace_if(
          cells, cells + image.grid().columns,
          [](const RangeImage::Cell& cell) { return (cell.nearest & RangeImage::kMoving) != 0; },
          RangeImage::Cell{RangeImage::kNothing, RangeImage::kUnknown});
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
        split_.points.set(count++, points, i);
        if (!is_ground) moving_.push_back(verdicts[i] == PointLabel::kDynamic ? 1 : 0);
      }
      if (takes_ground) split_.ground_count = count;
    }
    split_.count = count;
  }

  std::uint32_t max_scans_;
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
