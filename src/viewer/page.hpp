// The page of a run: HTML without references to other files.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <ostream>
#include <string>
#include <unordered_set>
#include <vector>

#include "dynains/evaluation/truth.hpp"
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
  Eigen::Vector3f local = Eigen::Vector3f::Zero();  ///< m, world axes, relative to ViewData::origin
  float intensity = 0.0F;                           ///< in the unit of the recording
  using ScanIndex = std::uint16_t;                  ///< in ViewData::scans
  ScanIndex scan = 0;
  std::uint16_t instance = 0;  ///< 0: none
  std::uint8_t belief = 0;     ///< probability of being dynamic times 255
  std::uint8_t cause = 0;      ///< number of the Cause
  ViewLabel label = ViewLabel::kNotJudged;
  ViewTruth truth = ViewTruth::kUnknown;
};

struct ViewScan {
  std::string name;
  double time;               ///< s
  Eigen::Vector3f position;  ///< of the sensor, m, as ViewPoint::local
};

/// Numbers of points in the files, of which the page has a part.
struct ViewCounts {
  std::uint64_t points = 0;
  std::uint64_t moving = 0;
  std::uint64_t missed = 0;  ///< moving by ground truth, but static by the run
  std::uint64_t lost = 0;    ///< static by ground truth, but moving by the run
  std::array<std::uint64_t, kCauseCount> by_cause{};
};

struct ViewData {
  std::string title;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< m, world
  std::vector<ViewScan> scans;
  std::vector<ViewPoint> map;  ///< static points
  std::vector<ViewPoint> moving;
  ViewCounts counts;
  bool has_truth = false;
  bool has_beliefs = false;
};

/// Keeps one point per cell and scan, the first one. Cells grow until at most `budget` points are
/// left; when they are 0.6 m wide, more and more scans share them first. Same input, same points.
class ThinnedPoints {
 public:
  /// `cell`: edge of the first cells, m. `scans`: so many in a row share the first cells.
  ThinnedPoints(std::size_t budget, double cell, std::size_t scans);

  void add(const ViewPoint& point);

  /// At most `most` points, which is at most `budget`. Call it after the last point.
  std::vector<ViewPoint> take(std::size_t most);

 private:
  bool is_first(const ViewPoint& point);
  void thin();

  std::size_t budget_;
  double cell_;
  std::size_t scans_per_cell_;
  std::vector<ViewPoint> points_;
  std::unordered_set<std::uint64_t> occupied_;
};

/// Writes the page of a run with its style, its program and the points. Needs WebGL 2 and
/// DecompressionStream to be shown (Firefox from 113 on, Chromium from 80 on).
void write_page(std::ostream& out, const ViewData& data);

}  // namespace dynains::viewer
