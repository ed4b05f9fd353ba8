#include "overview.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "verdict_cloud.hpp"

namespace dynains::program {
namespace {

constexpr double kMargin = 50.0;        // m around the path
constexpr double kLongerSide = 1200.0;  // pixels of a panel
constexpr double kMostPerMetre = 8.0;   // pixels
constexpr double kOverStatic = 1000.0;  // m: moving points cover static ones
constexpr int kGap = 8;                 // pixels between panels
constexpr std::size_t kStaticStep = 4;  // one of so many static points is drawn

/// Grey that gets darker with the height above the ground below the sensor.
Colour shaded(double height) {
  const double light = std::clamp(205.0 - 18.0 * (height + 1.7), 70.0, 215.0);
  const auto value = static_cast<std::uint8_t>(light);
  return {value, value, value};
}

}  // namespace

Overview::Layout Overview::layout_of(const std::vector<Eigen::Vector3d>& path) {
  Eigen::Array2d low = path.front().head<2>().array();
  Eigen::Array2d high = low;
  for (const Eigen::Vector3d& position : path) {
    low = low.min(position.head<2>().array());
    high = high.max(position.head<2>().array());
  }
  low -= kMargin;
  high += kMargin;
  const Eigen::Array2d size = high - low;
  const double scale = std::min(kMostPerMetre, kLongerSide / size.maxCoeff());
  const auto pixels = [&](double metres) {
    return std::max(1, static_cast<int>(std::ceil(metres * scale)));
  };
  Layout layout{low.matrix(), scale, pixels(size.x()), pixels(size.y()), {}};
  const bool is_beside = layout.height > layout.width;
  layout.step = is_beside ? Eigen::Vector2d(layout.width + kGap, 0)
                          : Eigen::Vector2d(0, layout.height + kGap);
  return layout;
}

Overview::Overview(const std::vector<Eigen::Vector3d>& path) : Overview(layout_of(path)) {}

Overview::Overview(const Layout& layout)
    : layout_(layout),
      picture_(layout.width + 2 * static_cast<int>(layout.step.x()),
               layout.height + 2 * static_cast<int>(layout.step.y())) {}

void Overview::splat(int panel, const Eigen::Vector2d& pixel, double depth, Colour colour) {
  const Eigen::Vector2d place = pixel + panel * layout_.step;
  picture_.splat(place.x(), place.y(), depth, 0, colour);
}

void Overview::add(const RecordedScan& scan, const ScanVerdict& verdict) {
  constexpr Colour kRemoved = kFateColours[static_cast<std::size_t>(Fate::kRemovedDynamic)];
  constexpr Colour kPale = {232, 232, 232};
  const double sensor_height = verdict.T_world_sensor.translation().z();
  for (std::size_t i = 0; i < verdict.labels.size(); ++i) {
    const PointLabel label = verdict.labels[i];
    const bool is_moving = label == PointLabel::kDynamic;
    const bool is_static = label == PointLabel::kGround || label == PointLabel::kStatic;
    if (!is_moving && !(is_static && i % kStaticStep == 0)) continue;
    const Eigen::Vector3d p = verdict.T_world_sensor * scan.point(i).position;
    const Eigen::Vector2d pixel((p.x() - layout_.low.x()) * layout_.scale,
                                layout_.height - (p.y() - layout_.low.y()) * layout_.scale);
    const bool is_inside =
        pixel.x() >= 0 && pixel.x() < layout_.width && pixel.y() >= 0 && pixel.y() < layout_.height;
    if (!is_inside) continue;
    if (is_moving) {
      splat(0, pixel, -kOverStatic - p.z(), kRawDynamicColour);
      splat(2, pixel, -kOverStatic - p.z(), kRemoved);
    } else {
      const Colour colour = shaded(p.z() - sensor_height);
      splat(0, pixel, -p.z(), colour);
      splat(1, pixel, -p.z(), colour);
      splat(2, pixel, -p.z(), kPale);
    }
  }
}

}  // namespace dynains::program
