// large_map FOLDER POINTS
// Writes a folder of results that has nothing but a static map of a synthetic city: streets with
// houses and trees on hilly ground, in squares of 100 m with 50,000 points each.
#include <Eigen/Core>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <random>
#include <string>

#include "dynains/io/point_file.hpp"
#include "dynains/version.hpp"

namespace {

namespace fs = std::filesystem;

constexpr double kSquare = 100.0;  // m
constexpr std::size_t kSquarePoints = 50000;

/// Points of a square: half of them on the ground, the others on walls and in trees.
class City {
 public:
  Eigen::Vector3d point(double x0, double y0) {
    const double x = x0 + uniform(0.0, kSquare);
    const double y = y0 + uniform(0.0, kSquare);
    const double kind = uniform(0.0, 1.0);
    if (kind < 0.5) return {x, y, ground(x, y)};
    if (kind < 0.8) {  // walls around a house
      const bool along = uniform(0.0, 1.0) < 0.5;
      const double side = uniform(0.0, 1.0) < 0.5 ? 20.0 : 80.0;
      const double at = uniform(20.0, 80.0);
      const Eigen::Vector3d wall(x0 + (along ? at : side), y0 + (along ? side : at), 0.0);
      return wall + Eigen::Vector3d(0, 0, ground(wall.x(), wall.y()) + uniform(0.0, 12.0));
    }
    const Eigen::Vector3d tree(x0 + 8.0 + 12.0 * std::floor(uniform(0.0, 7.0)), y0 + 8.0, 0.0);
    const double turn = uniform(0.0, 6.28);
    const double rise = uniform(-1.5, 1.5);
    const double radius = std::sqrt(2.25 - rise * rise) * std::sqrt(uniform(0.3, 1.0));
    return tree + Eigen::Vector3d(radius * std::cos(turn), radius * std::sin(turn),
                                  ground(tree.x(), tree.y()) + 4.0 + rise);
  }

 private:
  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_() >> 11U) * 0x1p-53;
  }
  static double ground(double x, double y) {
    return 5.0 * std::sin(0.004 * x) + 3.0 * std::cos(0.007 * y);
  }

  std::mt19937_64 engine_{1};
};

}  // namespace

int main(int count, char** arguments) {
  if (count != 3) {
    std::cerr << "expected: large_map FOLDER POINTS\n";
    return 2;
  }
  const fs::path folder = arguments[1];
  const std::size_t points = std::strtoull(arguments[2], nullptr, 10);
  fs::create_directories(folder);
  dynains::PointColumns columns;
  columns.intensity = true;
  dynains::PointFileWriter writer(folder / "static_map.ply", columns);
  const auto squares = static_cast<std::size_t>(
      std::ceil(std::sqrt(static_cast<double>(points) / static_cast<double>(kSquarePoints))));
  City city;
  for (std::size_t i = 0; i < points; ++i) {
    const std::size_t square = i / kSquarePoints;
    dynains::FilePoint point;
    point.position = city.point(kSquare * static_cast<double>(square % squares),
                                kSquare * static_cast<double>(square / squares));
    point.intensity = static_cast<float>(i % 256);
    writer.add(point);
  }
  writer.commit();
  std::ofstream(folder / "report.json")
      << R"({"program": "dynains", "version": ")" << dynains::kVersionString
      << R"(", "command": "run", "complete": true, "static_map": {"file": "static_map.ply"},)"
      << R"( "outputs": {"files": ["static_map.ply"], "folders": {}, "scans": []}})" << '\n';
  std::cout << points << " points in " << folder.string() << '\n';
  return 0;
}
