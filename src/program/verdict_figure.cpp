#include "verdict_figure.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

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

/// add(point, layer, colour) for every point that the figure shows.
template <class Add>
void for_each_shown(const VerdictCloud& cloud, Content content, Add&& add) {
  const double ground = height_quantile(cloud, 0.1);
  for (const VerdictCloud::Point& point : cloud.points()) {
    if (!is_shown(point.fate, content)) continue;
    const std::size_t layer = layer_of(point.fate, content);
    const Colour colour = colour_of(point.fate, content);
    add(point.local.cast<double>(), layer,
        layer == 0 ? shaded(colour, point.local.z() - ground) : colour);
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

/// Names of the layers for the legend, with their colours.
std::vector<Figure::LegendEntry> legend_of(Content content) {
  if (content == Content::kRaw) {
    return {{"static", colour_of(Fate::kKeptStatic, content)},
            {"dynamic", colour_of(Fate::kRemovedDynamic, content)}};
  }
  std::vector<Figure::LegendEntry> entries;
  const std::pair<Fate, const char*> names[] = {{Fate::kKeptStatic, "kept static"},
                                                {Fate::kRemovedDynamic, "removed dynamic"},
                                                {Fate::kLostStatic, "lost static"},
                                                {Fate::kMissedDynamic, "missed dynamic"}};
  for (const auto& [fate, name] : names) {
    if (is_shown(fate, content)) entries.push_back({name, colour_of(fate, content)});
  }
  return entries;
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

Figure view_from_above(const VerdictCloud& cloud, Content content, int pixels) {
  Eigen::Array2d low = Eigen::Array2d::Zero();
  Eigen::Array2d high = Eigen::Array2d::Zero();
  for (const VerdictCloud::Point& point : cloud.points()) {
    const Eigen::Array2d p = point.local.head<2>().cast<double>().array();
    low = low.min(p);
    high = high.max(p);
  }
  ViewFromAbove view(low, high, pixels, kFateCount, legend_of(content));
  for_each_shown(cloud, content, [&](const Eigen::Vector3d& p, std::size_t layer, Colour colour) {
    view.add(p, layer, colour);
  });
  return view.figure();
}

Figure view_in_perspective(const VerdictCloud& cloud, Content content, int pixels) {
  Figure figure;
  figure.legend = legend_of(content);
  figure.layers.resize(kFateCount);
  figure.width = pixels;
  figure.height = std::max(1, pixels * 9 / 16);
  figure.high_x = figure.width;
  figure.high_y = figure.height;
  if (cloud.path().empty()) return figure;
  const Eigen::Vector3d forward = viewing_direction(cloud);

  constexpr double kBack = 22, kUp = 16, kAhead = 25, kFocal = 0.9;  // m, m, m, picture widths
  const Eigen::Vector3d eye = -kBack * forward + kUp * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d axis = (kAhead * forward - eye).normalized();
  const Eigen::Vector3d right = axis.cross(Eigen::Vector3d::UnitZ()).normalized();
  const Eigen::Vector3d up = right.cross(axis);
  DotGrid grid(figure);
  for_each_shown(cloud, content, [&](const Eigen::Vector3d& p, std::size_t layer, Colour colour) {
    constexpr double kNearest = 2;  // m
    const double depth = axis.dot(p - eye);
    if (depth < kNearest) return;
    const double scale = kFocal * figure.width / depth;
    grid.add(0.5 * figure.width + scale * right.dot(p - eye),
             0.5 * figure.height + scale * up.dot(p - eye), depth, layer, colour);
  });
  return grid.figure();
}

}  // namespace dynains::program
