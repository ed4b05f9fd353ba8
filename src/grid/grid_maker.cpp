#include "grid/grid_maker.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iomanip>
#include <limits>
#include <locale>
#include <optional>
#include <string>

#include "dynains/io/atomic_file.hpp"

namespace dynains::grid {
namespace {

/// The part of a beam that is lower than `low`, as shares of its way. `from`, `to`: m over ground.
std::array<double, 2> low_part(double from, double to, double low) {
  const double crossing = (low - from) / (to - from);
  if (from < low) return {0.0, to < low ? 1.0 : crossing};
  return {to < low ? crossing : 1.0, 1.0};
}

/// Value of a pixel: the darker, the more probably occupied.
char pixel_of(CellState state) {
  if (state == CellState::kOccupied) return static_cast<char>(0);
  return static_cast<char>(state == CellState::kFree ? 254 : 205);
}

}  // namespace

void Config::validate() const {
  validate_parameters("grid", *this);
  if (min_height < max_height) return;
  throw ConfigError("grid.min_height = " + std::to_string(min_height) +
                    " must be less than max_height = " + std::to_string(max_height));
}

std::size_t OccupancyGrid::count(CellState state) const {
  return static_cast<std::size_t>(std::count(cells.begin(), cells.end(), state));
}

GridMaker::GridMaker(const Config& config, const Floors& floors, double spacing)
    : config_((config.validate(), config)),
      reach_(static_cast<std::int64_t>(std::max(1.0, std::round(spacing / config.resolution)))),
      floors_(floors),
      columns_(config.resolution, floors.columns().origin, floors.columns().end()),
      cells_(columns_.size()) {}

GridMaker::Cell* GridMaker::cell_at(const Eigen::Vector3d& position) {
  const std::int64_t x = columns_.along(0, position.x()), y = columns_.along(1, position.y());
  return columns_.contains(x, y) ? &cells_[columns_.index(x, y)] : nullptr;
}

void GridMaker::add(const Eigen::Vector3d& point, bool is_moving) {
  const std::int64_t x = columns_.along(0, point.x()), y = columns_.along(1, point.y());
  const std::optional<Floors::Height> height = height_of(point);
  if (!columns_.contains(x, y) || !height || height->over_floor > config_.max_height) return;
  Cell& cell = cells_[columns_.index(x, y)];
  const bool is_ground = height->over_floor < config_.min_height;
  cell.is_free = cell.is_free || (is_ground && !is_moving);
  if (!is_moving && !is_ground) return add_obstacle(x, y);
  // The upper end of a step does not show that the step is none.
  if (!is_moving && height->over_lowest >= 2.0 * config_.min_height) return;
  if (cell.latest_obstacle != static_cast<std::uint8_t>(scan_)) {
    count(cell.clear, cell.latest_clear, cell);
  }
}

void GridMaker::add_obstacle(std::int64_t x, std::int64_t y) {
  cells_[columns_.index(x, y)].has_obstacle = true;
  for (std::int64_t row = y - reach_; row <= y + reach_; ++row) {
    for (std::int64_t column = x - reach_; column <= x + reach_; ++column) {
      if (!columns_.contains(column, row)) continue;
      Cell& cell = cells_[columns_.index(column, row)];
      if (cell.latest_obstacle == static_cast<std::uint8_t>(scan_)) continue;
      // The scan does not show that the cell is clear.
      const bool was_clear = cell.latest_clear == static_cast<std::uint8_t>(scan_);
      if (was_clear && cell.clear > 0) --cell.clear;
      count(cell.obstacle, cell.latest_obstacle, cell);
    }
  }
}

/// Counts the scan at hand once.
void GridMaker::count(std::uint8_t& scans, std::uint8_t& latest, Cell& cell) const {
  const auto scan = static_cast<std::uint8_t>(scan_);
  if (latest == scan) return;
  latest = scan;
  if (scans == std::numeric_limits<std::uint8_t>::max()) {
    cell.obstacle /= 2;
    cell.clear /= 2;
  }
  ++scans;
}

void GridMaker::add_beams(const Eigen::Vector3d& sensor, Span<const Eigen::Vector3d> ends) {
  const std::optional<Floors::Height> from = height_of(sensor);
  if (!from) return;
  const double low = 0.5 * config_.max_height;
  // Beams count up to 30 m.
  const auto ranges = static_cast<std::size_t>(30.0 / config_.resolution);
  const auto azimuths = static_cast<std::size_t>(2.0 * M_PI * static_cast<double>(ranges));
  begun_.assign(azimuths * (ranges + 1), 0);
  for (const Eigen::Vector3d& end : ends) {
    const std::optional<Floors::Height> to = height_of(end);
    if (!to) continue;
    const double dx = end.x() - sensor.x(), dy = end.y() - sensor.y();
    const double range = std::hypot(dx, dy) / config_.resolution;  // cells
    const auto [begin, finish] = low_part(from->over_floor, to->over_floor, low);
    const double turn = std::atan2(dy, dx) / (2.0 * M_PI);
    const auto azimuth =
        static_cast<std::size_t>((turn < 0.0 ? turn + 1.0 : turn) * static_cast<double>(azimuths));
    std::int32_t* const row = &begun_[std::min(azimuth, azimuths - 1) * (ranges + 1)];
    // Without the cell of the return.
    const double last = std::min(finish * range, range - 1.0);
    const auto index = [&](double cell) {
      return std::min(static_cast<std::size_t>(cell), ranges);
    };
    if (last <= begin * range) continue;
    ++row[index(begin * range)];
    --row[index(last)];
  }
  for (std::size_t a = 0; a < azimuths; ++a) {
    const double angle =
        2.0 * M_PI * (static_cast<double>(a) + 0.5) / static_cast<double>(azimuths);
    const Eigen::Vector3d step =
        config_.resolution * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0);
    std::int32_t beams = 0;
    for (std::size_t r = 0; r < ranges; ++r) {
      beams += begun_[a * (ranges + 1) + r];
      if (beams == 0) continue;
      Cell* const cell = cell_at(sensor + (static_cast<double>(r) + 0.5) * step);
      if (cell != nullptr) cell->is_free = true;
    }
  }
}

OccupancyGrid GridMaker::grid() const {
  OccupancyGrid grid{columns_, std::vector<CellState>(columns_.size(), CellState::kUnknown)};
  for (std::int64_t y = 0; y < columns_.height; ++y) {
    for (std::int64_t x = 0; x < columns_.width; ++x) {
      const std::size_t i = columns_.index(x, y);
      const Cell& cell = cells_[i];
      const Eigen::Vector2d middle =
          columns_.origin + columns_.edge * Eigen::Vector2d(static_cast<double>(x) + 0.5,
                                                            static_cast<double>(y) + 0.5);
      if (is_obstacle(cell)) {
        grid.cells[i] = CellState::kOccupied;
      } else if (cell.is_free || floors_.is_seen(middle)) {
        grid.cells[i] = CellState::kFree;
      }
    }
  }
  close_gaps(grid);
  return grid;
}

/// Cells between two obstacles near each other become occupied, so that walls have no holes, unless
/// a third one is nearer to both: lines by it connect them (relative neighbourhood graph).
void GridMaker::close_gaps(OccupancyGrid& grid) const {
  const std::vector<CellState> before = grid.cells;
  const auto is_occupied = [&](std::int64_t x, std::int64_t y) {
    return columns_.contains(x, y) && before[columns_.index(x, y)] == CellState::kOccupied;
  };
  // Cells: no robot passes a gap of three, and thinned points are farther apart.
  const int most = static_cast<int>(std::max<std::int64_t>(3, reach_ + reach_ / 2)) + 1;
  const auto has_middle = [&](std::int64_t x, std::int64_t y, int dx, int dy) {
    const auto is_near = [&](int u, int v) { return u * u + v * v < dx * dx + dy * dy; };
    // Lines to obstacles farther than `most` from either along an axis are not drawn.
    for (int v = dy - most; v <= most; ++v) {
      for (int u = std::max(-most, dx - most); u <= std::min(most, dx + most); ++u) {
        if (is_near(u, v) && is_near(u - dx, v - dy) && is_occupied(x + u, y + v)) return true;
      }
    }
    return false;
  };
  for (std::int64_t y = 0; y < columns_.height; ++y) {
    for (std::int64_t x = 0; x < columns_.width; ++x) {
      if (!is_occupied(x, y)) continue;
      for (int dy = 0; dy <= most; ++dy) {
        for (int dx = dy == 0 ? 2 : -most; dx <= most; ++dx) {
          if (!is_occupied(x + dx, y + dy) || has_middle(x, y, dx, dy)) continue;
          const double steps = std::max(std::abs(dx), dy);
          for (int k = 1; k < steps; ++k) {
            grid.cells[columns_.index(x + std::llround(k * dx / steps),
                                      y + std::llround(k * dy / steps))] = CellState::kOccupied;
          }
        }
      }
    }
  }
}

void write_grid(const std::filesystem::path& image, const std::filesystem::path& description,
                const OccupancyGrid& grid, const Eigen::Vector2d& origin) {
  const Columns& columns = grid.columns;
  AtomicFile picture(image);
  picture.stream() << "P5\n" << columns.width << ' ' << columns.height << "\n255\n";
  std::string row;
  for (std::int64_t y = columns.height; y-- > 0;) {
    row.clear();
    for (std::int64_t x = 0; x < columns.width; ++x) {
      row += pixel_of(grid.cells[columns.index(x, y)]);
    }
    picture.stream() << row;
  }
  picture.commit();

  const Eigen::Vector2d corner = origin + columns.origin;
  AtomicFile text(description);
  text.stream().imbue(std::locale::classic());
  // 205 of an unknown cell is 0.19608 in the server, which must not be below free_thresh.
  text.stream() << "image: " << std::quoted(image.filename().string())
                << "\nmode: trinary\nresolution: " << columns.edge << std::fixed
                << std::setprecision(6) << "\norigin: [" << corner.x() << ", " << corner.y()
                << ", 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";
  text.commit();
}

}  // namespace dynains::grid
