// Content of the page of a run.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "dynains/evaluation/truth.hpp"
#include "dynains/verdict.hpp"

namespace dynains::viewer {

/// Verdict of a run on a point, as the label files have it.
enum class ViewLabel : std::uint8_t { kNotJudged = 0, kStatic = 1, kMoving = 2 };

/// Ground truth of a point.
enum class ViewTruth : std::uint8_t {
  kUnknown = 0,
  kStatic = 1,  ///< ground
  kMoving = 2,
  kStaticObject = 3,  ///< anything else that stands
};

/// A measured point with its verdict.
struct ViewPoint {
  /// Scan of a map point that was not found in any scan.
  static constexpr std::uint16_t kNoScan = 65535;

  Eigen::Vector3f local = Eigen::Vector3f::Zero();  ///< m, world axes, relative to ViewData::origin
  float intensity = 0.0F;                           ///< in the unit of the recording
  std::uint16_t scan = kNoScan;                     ///< index in ViewData::scans
  std::uint16_t instance = 0;                       ///< 0: none
  std::uint8_t belief = 0;                          ///< probability of being dynamic times 255
  std::uint8_t cause = 0;                           ///< number of the Cause
  ViewLabel label = ViewLabel::kNotJudged;
  ViewTruth truth = ViewTruth::kUnknown;
};

/// Results of the reference scans of a point at its place. Bit k stands for reference k of its
/// ReferenceWindow.
struct Sightings {
  std::uint64_t passed = 0;    ///< beams passed through the place
  std::uint64_t returned = 0;  ///< a beam was returned there
};

struct ViewScan {
  std::string name;
  double time;               ///< s
  Eigen::Vector3f position;  ///< of the sensor, m, as ViewPoint::local
};

/// Numbers of points in the files, of which the page has a part.
struct ViewCounts {
  std::uint64_t points = 0;
  std::uint64_t map = 0;
  std::uint64_t moving = 0;
  std::uint64_t missed = 0;  ///< moving by ground truth, but static by the run
  std::uint64_t lost = 0;    ///< static by ground truth, but moving by the run
  std::array<std::uint64_t, kCauseCount> by_cause{};
};

struct ViewData {
  std::string title;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< m, world
  std::vector<ViewScan> scans;
  std::vector<ViewPoint> map;
  std::vector<ViewPoint> moving;
  std::vector<Sightings> sightings;    ///< by point of `moving`
  std::size_t reference_step = 1;      ///< of the window of the sightings, scans
  std::size_t reference_lookback = 0;  ///< of that window, scans
  double map_cell = 0.0;  ///< edge of cells with one map point each, m; 0: all points of the file
  double moving_cell = 0.0;  ///< edge of cells with one moving point per scan, m
  ViewCounts counts;
  bool has_truth = false;
  bool has_beliefs = false;
};

}  // namespace dynains::viewer
