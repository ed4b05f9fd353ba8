#include "grid/floors.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <utility>

#include "dynains/errors.hpp"

namespace dynains::grid {
namespace {

constexpr double kMostCells = 4e8;  // some 2 GB

/// Columns of this edge around the points, with a margin (m).
Columns columns_around(const Eigen::AlignedBox2d& box, double edge, double margin) {
  Columns columns;
  columns.edge = edge;
  const Eigen::Array2d low = ((box.min().array() - margin) / edge).floor();
  const Eigen::Array2d high = ((box.max().array() + margin) / edge).floor() + 1.0;
  columns.origin = low * edge;
  columns.width = static_cast<std::int64_t>(high.x() - low.x());
  columns.height = static_cast<std::int64_t>(high.y() - low.y());
  return columns;
}

/// Sets of numbers that are joined two by two.
class JoinedSets {
 public:
  explicit JoinedSets(std::size_t size) : parent_(size), size_(size, 1) {
    std::iota(parent_.begin(), parent_.end(), 0U);
  }
  std::uint32_t root(std::uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = root(a);
    b = root(b);
    if (a == b) return;
    if (size_[a] < size_[b]) std::swap(a, b);
    parent_[b] = a;
    size_[a] += size_[b];
  }
  std::size_t size_of(std::uint32_t i) { return size_[root(i)]; }

 private:
  std::vector<std::uint32_t> parent_;
  std::vector<std::size_t> size_;
};

}  // namespace

void Floors::add(const Eigen::Vector3d& point, bool is_ground) {
  const auto index = [](double position, double edge) {
    return detail::floor_to<std::int64_t>(position / edge);
  };
  const VoxelKey key =
      voxel_key(index(point.x(), kEdge), index(point.y(), kEdge), index(point.z(), kBin));
  const std::uint32_t number = numbers_.insert(key);
  if (number == bins_.size()) {
    bins_.emplace_back();
    keys_.push_back(key);
  }
  Bin& bin = bins_[number];
  ++(is_ground ? bin.ground : bin.others);
  if (is_ground) bin.sum += point.z();
}

void Floors::add_map(const std::vector<Eigen::Vector3d>& points, double step) {
  constexpr double kHigh = std::numeric_limits<double>::infinity();
  VoxelHashTable<> numbers;
  // By column. A single point below the ground is a reflection.
  std::vector<std::array<double, 2>> lowest;
  std::vector<std::uint32_t> column_of;
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Vector3d flat(point.x(), point.y(), 0.0);
    column_of.push_back(numbers.insert(voxel_at(flat, 2.0 * kEdge)));
    if (numbers.size() > lowest.size()) lowest.push_back({kHigh, kHigh});
    auto& [first, second] = lowest[column_of.back()];
    second = std::min(second, std::max(first, point.z()));
    first = std::min(first, point.z());
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto& [first, second] = lowest[column_of[i]];
    add(points[i], points[i].z() <= (second < kHigh ? second : first) + step);
  }
}

/// By column, then from below. The labels of ground reach up to half a metre up a wall: the lower
/// end counts alone.
std::vector<Floors::Floor> Floors::lowest_of_spans() const {
  constexpr std::int64_t kGap = 10;   // bins without points between two spans
  constexpr std::int64_t kDepth = 3;  // bins of a floor: noise, and the slope within a column
  std::vector<std::uint32_t> order(bins_.size());
  std::iota(order.begin(), order.end(), 0U);
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return keys_[a] < keys_[b]; });
  std::vector<Floor> floors;
  Bin lowest;
  std::int64_t x = 0, y = 0, begin = 0, latest = 0;
  const auto end_span = [&] {
    if (lowest.ground == 0 || lowest.ground < lowest.others) return;
    floors.push_back({x, y, lowest.sum / lowest.ground});
  };
  for (const std::uint32_t i : order) {
    const Bin& bin = bins_[i];
    const std::int64_t z = voxel_index(keys_[i], 2);
    const bool is_same = voxel_index(keys_[i], 0) == x && voxel_index(keys_[i], 1) == y;
    if (!is_same || z - latest > kGap) {
      end_span();
      lowest = Bin();
      begin = z;
      x = voxel_index(keys_[i], 0);
      y = voxel_index(keys_[i], 1);
    }
    latest = z;
    if (z - begin >= kDepth) continue;
    lowest.ground += bin.ground;
    lowest.others += bin.others;
    lowest.sum += bin.sum;
  }
  end_span();
  return floors;
}

/// The floors of surfaces that are large, or the largest ones there are.
std::vector<Floors::Floor> Floors::large_surfaces(const std::vector<Floor>& floors,
                                                  double step) const {
  constexpr double kSlope = 0.3;    // of the steepest ramp
  constexpr std::int64_t kGap = 4;  // columns without floor around each one
  const double rise = step + kSlope * kEdge;
  std::vector<std::uint32_t> source(columns_.size(), kNoIndex), next(floors.size(), kNoIndex);
  for (std::uint32_t i = 0; i < floors.size(); ++i) {
    next[i] = std::exchange(source[column_of(floors[i])], i);  // the one below
  }
  JoinedSets surfaces(floors.size());
  spread(columns_, kGap, source, [&](std::uint32_t top_a, std::uint32_t top_b) {
    for (std::uint32_t i = top_a; i != kNoIndex; i = next[i]) {
      for (std::uint32_t k = top_b; k != kNoIndex; k = next[k]) {
        if (std::abs(floors[i].height - floors[k].height) <= rise) surfaces.join(i, k);
      }
    }
  });
  std::size_t least = 0;
  for (std::uint32_t i = 0; i < floors.size(); ++i) least = std::max(least, surfaces.size_of(i));
  least = std::min(least, static_cast<std::size_t>(kLeastArea / (kEdge * kEdge)));
  std::vector<Floor> large;
  for (std::uint32_t i = 0; i < floors.size(); ++i) {
    if (surfaces.size_of(i) >= least) large.push_back(floors[i]);
  }
  return large;
}

void Floors::finish(double step, double resolution) {
  const std::vector<Floor> all = lowest_of_spans();
  if (all.empty()) {
    throw IoError(place_ +
                  ": no ground was found; a grid needs static points of the ground, and a "
                  "z axis that points up");
  }
  Eigen::AlignedBox2d box;
  for (const Floor& floor : all) {
    box.extend(kEdge * Eigen::Vector2d(static_cast<double>(floor.x), static_cast<double>(floor.y)));
  }
  columns_ = columns_around(box, kEdge, kReach);
  const double cells = static_cast<double>(columns_.size()) * std::pow(kEdge / resolution, 2);
  if (cells > kMostCells) {
    throw IoError(place_ + ": a grid of " + std::to_string(static_cast<int>(box.sizes().x())) +
                  " x " + std::to_string(static_cast<int>(box.sizes().y())) +
                  " m has too many cells; choose a coarser --resolution");
  }
  is_seen_.assign(columns_.size(), false);
  source_.assign(columns_.size(), kNoIndex);
  std::size_t latest = columns_.size();
  for (const Floor& floor : large_surfaces(all, step)) {
    const std::size_t column = column_of(floor);
    if (column != latest) {
      heights_.push_back(std::numeric_limits<float>::infinity());
      source_[column] = static_cast<std::uint32_t>(heights_.size());
      is_seen_[column] = true;
      latest = column;
    }
    heights_.push_back(static_cast<float>(floor.height));
  }
  heights_.push_back(std::numeric_limits<float>::infinity());
  numbers_ = VoxelHashTable<>();
  keys_ = {};
  bins_ = {};
  spread(columns_, kReachColumns, source_, [](std::uint32_t, std::uint32_t) {});
}

std::optional<Floors::Height> Floors::height_of(const Eigen::Vector3d& point, double step,
                                                double storey) const {
  const std::int64_t x = columns_.along(0, point.x()), y = columns_.along(1, point.y());
  const auto top = static_cast<float>(point.z() + step);
  const auto bottom = static_cast<float>(point.z() - storey);
  float highest = -std::numeric_limits<float>::infinity(), lowest = top;
  std::uint32_t latest = kNoIndex;
  for (std::int64_t row = y - 1; row <= y + 1; ++row) {
    for (std::int64_t column = x - 1; column <= x + 1; ++column) {
      if (!columns_.contains(column, row)) continue;
      const std::uint32_t source = source_[columns_.index(column, row)];
      if (source == kNoIndex || source == latest) continue;
      latest = source;
      for (const float* floor = &heights_[source]; *floor <= top; ++floor) {
        highest = std::max(highest, *floor);
        if (*floor >= bottom) lowest = std::min(lowest, *floor);
      }
    }
  }
  if (std::isinf(highest)) return std::nullopt;
  return Height{point.z() - static_cast<double>(highest), point.z() - static_cast<double>(lowest)};
}

bool Floors::is_seen(const Eigen::Vector2d& position) const {
  const std::int64_t i = columns_.along(0, position.x()), j = columns_.along(1, position.y());
  return has_floor(i, j) || (has_floor(i - 1, j) && has_floor(i + 1, j)) ||
         (has_floor(i, j - 1) && has_floor(i, j + 1));
}

}  // namespace dynains::grid
