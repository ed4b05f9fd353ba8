#include "overview.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "moving_points.hpp"

namespace dynains::program {
namespace {

constexpr double kMargin = 50.0;        // m around the path
constexpr double kLongerSide = 1200.0;  // pixels of a panel
constexpr double kMostPerMetre = 8.0;   // pixels
constexpr int kGap = 8;                 // pixels between panels
constexpr Colour kMoving = {30, 80, 220};
constexpr Colour kRemoved = {30, 160, 60};
constexpr Colour kPale = {232, 232, 232};

/// One of so many static points of a scan is drawn: later scans show the same places again.
std::size_t static_step(std::size_t scans) {
  return std::clamp(scans / 4, std::size_t{1}, std::size_t{32});
}

/// Grey that gets darker with the height above the ground below the sensor.
std::uint8_t shade(double height) {
  return static_cast<std::uint8_t>(std::clamp(205.0 - 18.0 * (height + 1.7), 70.0, 215.0));
}

}  // namespace

Overview::Overview(const std::vector<Eigen::Vector3d>& path)
    : static_step_(static_step(path.size())) {
  Eigen::Array2d low = path.front().head<2>().array();
  Eigen::Array2d high = low;
  for (const Eigen::Vector3d& position : path) {
    low = low.min(position.head<2>().array());
    high = high.max(position.head<2>().array());
  }
  low_ = low - kMargin;
  const Eigen::Array2d size = high + kMargin - low_.array();
  scale_ = std::min(kMostPerMetre, kLongerSide / size.maxCoeff());
  const auto pixels = [&](double metres) {
    return std::max(1, static_cast<int>(std::ceil(metres * scale_)));
  };
  width_ = pixels(size.x());
  height_ = pixels(size.y());
  rows_.resize(static_cast<std::size_t>(height_));
}

void Overview::add(const RecordedScan& scan, const ScanVerdict& verdict) {
  const Pose& T_world_sensor = verdict.T_world_sensor;
  const double sensor_height = T_world_sensor.translation().z();
  static_points_.clear();
  for (std::size_t i = 0; i < verdict.labels.size(); i += static_step_) {
    if (!is_static(verdict.labels[i])) continue;
    const Eigen::Vector3d p = T_world_sensor * scan.point(i).position;
    if (Pixel* pixel = pixel_at(p)) {
      __builtin_prefetch(pixel, 1);
      static_points_.push_back({pixel, static_cast<float>(p.z()), shade(p.z() - sensor_height)});
    }
  }
  for (const StaticPoint& point : static_points_) point.pixel->add_static(point.height, point.grey);
  for_each_moving(verdict.labels, [&](std::size_t i) {
    if (Pixel* pixel = pixel_at(T_world_sensor * scan.point(i).position)) pixel->has_moving = true;
  });
}

Overview::Pixel* Overview::pixel_at(const Eigen::Vector3d& p) {
  const double x = (p.x() - low_.x()) * scale_;
  const double y = height_ - (p.y() - low_.y()) * scale_;
  if (!(x >= 0 && x < width_ && y >= 0 && y < height_)) return nullptr;
  std::vector<Pixel>& row = rows_[static_cast<std::size_t>(y)];
  if (row.empty()) row.resize(static_cast<std::size_t>(width_));
  return &row[static_cast<std::size_t>(x)];
}

Picture Overview::picture() const {
  const bool is_beside = height_ > width_;
  const int step_x = is_beside ? width_ + kGap : 0;
  const int step_y = is_beside ? 0 : height_ + kGap;
  Picture picture(width_ + 2 * step_x, height_ + 2 * step_y);
  const auto draw = [&](int panel, int x, int y, Colour colour) {
    picture.set(x + panel * step_x, y + panel * step_y, colour);
  };
  for (int y = 0; y < height_; ++y) {
    const std::vector<Pixel>& row = rows_[static_cast<std::size_t>(y)];
    for (int x = 0; x < static_cast<int>(row.size()); ++x) {
      const Pixel& pixel = row[static_cast<std::size_t>(x)];
      const Colour grey = {pixel.grey, pixel.grey, pixel.grey};
      if (pixel.has_moving) {
        draw(0, x, y, kMoving);
        draw(2, x, y, kRemoved);
      } else if (pixel.has_static()) {
        draw(0, x, y, grey);
        draw(2, x, y, kPale);
      }
      if (pixel.has_static()) draw(1, x, y, grey);
    }
  }
  return picture;
}

}  // namespace dynains::program
