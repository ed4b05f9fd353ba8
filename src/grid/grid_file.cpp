#include "grid/grid_file.hpp"

#include <iomanip>
#include <limits>
#include <locale>
#include <ostream>
#include <string>

#include "dynains/io/atomic_file.hpp"

namespace dynains::grid {
namespace {

/// Value of a pixel: the darker, the more probably occupied.
char pixel_of(CellState state) {
  if (state == CellState::kOccupied) return static_cast<char>(0);
  return static_cast<char>(state == CellState::kFree ? 254 : 205);
}

}  // namespace

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
