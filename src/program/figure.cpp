#include "figure.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace dynains::program {
namespace {

/// Static points get lighter with height, so that walls and trees stand out from the ground.
Colour shaded(Colour colour, double height) {
  const double light = std::clamp(0.55 + 0.07 * height, 0.55, 1.2);
  const auto scale = [&](std::uint8_t value) {
    return static_cast<std::uint8_t>(std::min(215.0, value * light));
  };
  return {scale(colour.r), scale(colour.g), scale(colour.b)};
}

/// Height that a share of the points lies below; the ground for small shares.
double height_quantile(const VerdictCloud& cloud, double share) {
  std::vector<float> heights;
  for (const VerdictCloud::Point& point : cloud.points()) heights.push_back(point.local.z());
  if (heights.empty()) return 0;
  const auto rank = static_cast<std::ptrdiff_t>(share * static_cast<double>(heights.size() - 1));
  std::nth_element(heights.begin(), heights.begin() + rank, heights.end());
  return heights[static_cast<std::size_t>(rank)];
}

/// Errors are drawn last, over correct points.
std::size_t layer_of(Fate fate, Content content) {
  if (content == Content::kRaw) return is_dynamic(fate) ? 1 : 0;
  return static_cast<std::size_t>(fate);
}

/// splat(point, radius, colour) for every point, layer by layer. What is not plain is larger.
template <class Splat>
void draw_layers(const VerdictCloud& cloud, Content content, Picture& picture, Splat&& splat) {
  const double ground = height_quantile(cloud, 0.1);
  for (std::size_t layer = 0; layer < kFateCount; ++layer) {
    picture.begin_layer();
    for (const VerdictCloud::Point& point : cloud.points()) {
      if (!is_shown(point.fate, content) || layer_of(point.fate, content) != layer) continue;
      const Colour colour = colour_of(point.fate, content);
      const bool plain = layer == 0;
      splat(point.local.cast<double>(), plain ? 0 : 1,
            plain ? shaded(colour, point.local.z() - ground) : colour);
    }
  }
}

/// Horizontal direction of the path; towards dynamic points if the sensor stands.
Eigen::Vector3d viewing_direction(const VerdictCloud& cloud) {
  Eigen::Vector3d forward = cloud.path().back() - cloud.path().front();
  forward.z() = 0;
  if (forward.norm() < 1) {
    forward.setZero();
    for (const VerdictCloud::Point& point : cloud.points()) {
      if (is_dynamic(point.fate)) forward += point.local.cast<double>();
    }
    forward.z() = 0;
  }
  return forward.norm() > 0 ? Eigen::Vector3d(forward.normalized()) : Eigen::Vector3d::UnitX();
}

}  // namespace

bool is_shown(Fate fate, Content content) {
  return content != Content::kMap || fate == Fate::kKeptStatic || fate == Fate::kMissedDynamic;
}

Colour colour_of(Fate fate, Content content) {
  if (content != Content::kRaw) return kFateColours[static_cast<std::size_t>(fate)];
  return is_dynamic(fate) ? kRawDynamicColour
                          : kFateColours[static_cast<std::size_t>(Fate::kKeptStatic)];
}

Picture draw_from_above(const VerdictCloud& cloud, Content content, int pixels) {
  Eigen::Array2d low = Eigen::Array2d::Zero();
  Eigen::Array2d high = Eigen::Array2d::Zero();
  for (const VerdictCloud::Point& point : cloud.points()) {
    const Eigen::Array2d p = point.local.head<2>().cast<double>().array();
    low = low.min(p);
    high = high.max(p);
  }
  const Eigen::Array2d size = (high - low).max(1.0);
  const double scale = pixels / size.maxCoeff();
  const auto side = [&](double metres) {
    return std::clamp(static_cast<int>(std::ceil(metres * scale)), 1, std::max(1, pixels));
  };
  Picture picture(side(size.x()), side(size.y()));
  draw_layers(cloud, content, picture, [&](const Eigen::Vector3d& p, int radius, Colour colour) {
    picture.splat((p.x() - low.x()) * scale, (high.y() - p.y()) * scale, -p.z(), radius, colour);
  });
  return picture;
}

Picture draw_perspective(const VerdictCloud& cloud, Content content, int pixels) {
  Picture picture(pixels, std::max(1, pixels * 9 / 16));
  if (cloud.path().empty()) return picture;
  const Eigen::Vector3d forward = viewing_direction(cloud);

  constexpr double kBack = 22, kUp = 16, kAhead = 25, kFocal = 0.9;  // m, m, m, picture widths
  const Eigen::Vector3d eye = -kBack * forward + kUp * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d axis = (kAhead * forward - eye).normalized();
  const Eigen::Vector3d right = axis.cross(Eigen::Vector3d::UnitZ()).normalized();
  const Eigen::Vector3d down = axis.cross(right);
  draw_layers(cloud, content, picture, [&](const Eigen::Vector3d& p, int radius, Colour colour) {
    constexpr double kNearest = 2;  // m
    const double depth = axis.dot(p - eye);
    if (depth < kNearest) return;
    const double scale = kFocal * picture.width() / depth;
    const int size = radius + (depth < 30 ? 1 : 0);
    picture.splat(0.5 * picture.width() + scale * right.dot(p - eye),
                  0.5 * picture.height() + scale * down.dot(p - eye), depth, size, colour);
  });
  return picture;
}

}  // namespace dynains::program
