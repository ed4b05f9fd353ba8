#include "grid/floors.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>

#include "dynains/errors.hpp"

namespace dynains::grid {
namespace {

constexpr double kMargin = 2.0;    // m, around the ground
constexpr double kMaxCells = 4e8;  // some 2 GB

std::int64_t index(double position, double edge) {
  return detail::floor_to<std::int64_t>(position / edge);
}

/// Columns around take the value of the nearest that has one, at most `reach` columns away along
/// the axes. `value`: by column, or kNoIndex.
void spread(const Columns& columns, std::int64_t reach, std::vector<std::uint32_t>& value) {
  std::vector<std::size_t> border, next;
  for (std::size_t i = 0; i < value.size(); ++i) {
    if (value[i] != kNoIndex) border.push_back(i);
  }
  constexpr std::array<std::array<int, 2>, 4> kSides = {{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
  for (std::int64_t step = 0; step < reach; ++step, border.swap(next)) {
    next.clear();
    for (const std::size_t i : border) {
      const auto x = static_cast<std::int64_t>(i) % columns.width;
      const auto y = static_cast<std::int64_t>(i) / columns.width;
      for (const auto& [dx, dy] : kSides) {
        if (!columns.contains(x + dx, y + dy)) continue;
        const std::size_t other = columns.index(x + dx, y + dy);
        if (value[other] != kNoIndex) continue;
        value[other] = value[i];
        next.push_back(other);
      }
    }
  }
}

}  // namespace

void Floors::add(const Eigen::Vector3d& point, bool is_ground, bool is_below) {
  const VoxelKey key =
      voxel_key(index(point.x(), kEdge), index(point.y(), kEdge), index(point.z(), kBin));
  const std::uint32_t number = numbers_.insert(key);
  if (number == bins_.size()) {
    bins_.emplace_back();
    keys_.push_back(key);
  }
  Bin& bin = bins_[number];
  ++(is_ground ? bin.ground : bin.others);
  if (!is_ground) return;
  bin.sum += point.z();
  bin.is_seen_from_above = bin.is_seen_from_above || !is_below;
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
    floors.push_back({x, y, lowest.sum / lowest.ground, lowest.is_seen_from_above});
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
    lowest.is_seen_from_above = lowest.is_seen_from_above || bin.is_seen_from_above;
  }
  end_span();
  return floors;
}

/// The floors of surfaces that are large, or the largest ones there are, and were seen from above.
std::vector<Floors::Floor> Floors::large_surfaces(const std::vector<Floor>& floors, double step) {
  constexpr double kCell = 1.0;  // m: a gap without ground that does not end a surface
  VoxelHashTable<> numbers;
  std::vector<VoxelKey> keys;
  std::vector<std::uint32_t> cell_of;
  for (const Floor& floor : floors) {
    const VoxelKey key =
        voxel_key(index(static_cast<double>(floor.x) * kEdge, kCell),
                  index(static_cast<double>(floor.y) * kEdge, kCell), index(floor.height, step));
    cell_of.push_back(numbers.insert(key));
    if (numbers.size() > keys.size()) keys.push_back(key);
  }
  std::vector<bool> is_seen_from_above(keys.size());
  for (std::size_t i = 0; i < floors.size(); ++i) {
    if (floors[i].is_seen_from_above) is_seen_from_above[cell_of[i]] = true;
  }
  std::vector<std::size_t> size(keys.size());
  ComponentSearch().for_each(keys, numbers, [&](const std::vector<std::uint32_t>& members) {
    const bool is_seen = std::any_of(members.begin(), members.end(),
                                     [&](std::uint32_t cell) { return is_seen_from_above[cell]; });
    for (const std::uint32_t cell : members) size[cell] = is_seen ? members.size() : 0;
  });
  const std::size_t largest = size.empty() ? 0 : *std::max_element(size.begin(), size.end());
  is_small_ = largest < 10;  // cells: the roof of a car is smaller
  const std::size_t least = std::clamp<std::size_t>(largest, 1, 10);
  std::vector<Floor> large;
  for (std::size_t i = 0; i < floors.size(); ++i) {
    if (size[cell_of[i]] >= least) large.push_back(floors[i]);
  }
  return large;
}

void Floors::finish(double step, double resolution) {
  const std::vector<Floor> all = large_surfaces(lowest_of_spans(), step);
  if (all.empty()) {
    throw IoError(place_ +
                  ": no ground was found; a grid needs static points of the ground, and a "
                  "z axis that points up");
  }
  Eigen::AlignedBox2d box;
  for (const Floor& floor : all) {
    box.extend(kEdge * Eigen::Vector2d(static_cast<double>(floor.x), static_cast<double>(floor.y)));
  }
  columns_ = Columns(kEdge, box.min().array() - kMargin, box.max().array() + kMargin);
  const double cells = static_cast<double>(columns_.size()) * std::pow(kEdge / resolution, 2);
  if (cells > kMaxCells) {
    throw IoError(place_ + ": a grid of " + std::to_string(static_cast<int>(box.sizes().x())) +
                  " x " + std::to_string(static_cast<int>(box.sizes().y())) +
                  " m has too many cells; choose a coarser --resolution");
  }
  is_seen_.assign(columns_.size(), false);
  source_.assign(columns_.size(), kNoIndex);
  std::size_t latest = columns_.size();
  for (const Floor& floor : all) {
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
  spread(columns_, static_cast<std::int64_t>(kReach / kEdge), source_);
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
