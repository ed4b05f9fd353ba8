// The page of a run: HTML without references to other files.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <ostream>
#include <string>
#include <unordered_set>
#include <utility>
#include <vector>

#include "dynains/verdict.hpp"

namespace dynains::viewer {

/// Verdict of a run on a point. The page has the numbers of these and of ViewTruth, from 0.
enum class ViewLabel : std::uint8_t { kNotJudged, kStatic, kMoving };

/// Ground truth of a point.
enum class ViewTruth : std::uint8_t {
  kUnknown,
  kStatic,  ///< ground
  kMoving,
  kStaticObject,  ///< anything else that stands
};

/// A measured point with its verdict.
struct ViewPoint {
  Eigen::Vector3f local = Eigen::Vector3f::Zero();  ///< m, world axes, relative to Page::origin()
  float intensity = 0.0F;                           ///< in the unit of the recording
  using ScanIndex = std::uint16_t;                  ///< from 0
  ScanIndex scan = 0;                               ///< set by Page::add()
  std::uint16_t instance = 0;                       ///< 0: none
  std::uint8_t belief = 0;                          ///< probability of being dynamic times 255
  std::uint8_t cause = 0;                           ///< number of the Cause
  ViewLabel label = ViewLabel::kNotJudged;
  ViewTruth truth = ViewTruth::kUnknown;
};

/// Keeps one point per cell and scan, the first one. Cells grow until at most `budget` points are
/// left; when they are 0.6 m wide, more and more scans share them first. Same input, same points.
class ThinnedPoints {
 public:
  /// `cell`: edge of the first cells, m. `scans`: so many in a row share the first cells.
  ThinnedPoints(std::size_t budget, double cell, std::size_t scans)
      : budget_(budget), cell_(cell), scans_per_cell_(scans) {}

  void add(const ViewPoint& point) {
    if (!is_first(point)) return;
    points_.push_back(point);
    // Rarely, so that the time is linear: each call goes over all points.
    if (points_.size() > 2 * budget_ + 1000) thin();
  }

  /// At most `most` points, which is at most `budget`. Call it after the last point.
  std::vector<ViewPoint> take(std::size_t most) {
    while (points_.size() > most) thin();
    occupied_ = {};  // frees its memory
    return std::move(points_);
  }

 private:
  /// A bijective mixing of 64 bits: multiplications by odd numbers and shifts.
  static std::uint64_t mixed(std::uint64_t value) {
    value ^= value >> 31U;
    value *= 0x9E3779B97F4A7C15U;
    value ^= value >> 29U;
    value *= 0xD6E8FEB86659FD93U;
    return value ^ value >> 32U;
  }

  bool is_first(const ViewPoint& point) {
    std::uint64_t key = point.scan / scans_per_cell_;
    for (int axis = 0; axis < 3; ++axis) {
      const double cell = std::floor(static_cast<double>(point.local[axis]) / cell_);
      key = mixed(key) + static_cast<std::uint64_t>(static_cast<std::int64_t>(cell));
    }
    return occupied_.insert(mixed(key)).second;
  }

  void thin() {
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

  std::size_t budget_;
  double cell_;
  std::size_t scans_per_cell_;
  std::vector<ViewPoint> points_;
  std::unordered_set<std::uint64_t> occupied_;
};

/// Collects points: the first static point of each voxel, up to two thirds, and moving points.
class Page {
 public:
  /// `origin`: m, world. `voxel`: edge, m. The page has at most `max_points` points.
  Page(const std::string& title, const Eigen::Vector3d& origin, bool has_truth, double voxel,
       std::size_t max_points);

  const Eigen::Vector3d& origin() const { return origin_; }
  /// Points have beliefs.
  void set_has_beliefs() { description_["has_beliefs"] = true; }
  /// The points that follow are of a scan at `time` (s) by a sensor at `position`, as
  /// ViewPoint::local. At most 65535 scans.
  void begin_scan(const std::string& name, double time, const Eigen::Vector3f& position);
  void add(ViewPoint point);
  /// After the last point. Writes the page with its style, its program and the points. Needs WebGL
  /// 2 and DecompressionStream to be shown (Firefox from 113 on, Chromium from 80 on).
  void write(std::ostream& out);

 private:
  Eigen::Vector3d origin_;
  std::size_t max_points_;
  ThinnedPoints static_, moving_;
  nlohmann::ordered_json description_;
  std::size_t scans_ = 0;
  // Numbers of points in the files, of which the page has a part.
  std::uint64_t points_ = 0, removed_ = 0;
  std::uint64_t missed_ = 0;  // moving by ground truth, but static by the run
  std::uint64_t lost_ = 0;    // static by ground truth, but moving by the run
  std::array<std::uint64_t, kCauseCount> by_cause_{};
};

}  // namespace dynains::viewer
