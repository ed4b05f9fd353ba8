// Two sessions, one map: raw arrays, without a program. On the first day a box stands on a square;
// on the second day it is gone, and beams pass through its place.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <iostream>
#include <utility>
#include <vector>

#include "dynains/city/city.hpp"
#include "dynains/city/session_writer.hpp"

namespace {

struct Scan {
  std::vector<float> x, y, z;                 // m, sensor frame
  std::vector<dynains::PointLabel> verdicts;  // of any removal of moving points
};

constexpr double kSensorHeight = 1.8;  // m

/// Scan from (0, y) of a flat square with walls 25 m away and, if it is there, a box 8 to 10 m in
/// front, 2 m wide and 1.5 m high.
Scan measure(double y, bool has_box) {
  Scan scan;
  for (double elevation = -0.35; elevation < 0.15; elevation += 0.012) {
    for (double azimuth = -3.14; azimuth < 3.14; azimuth += 0.008) {
      const double dx = std::cos(elevation) * std::cos(azimuth);
      const double dy = std::cos(elevation) * std::sin(azimuth);
      const double dz = std::sin(elevation);
      double range = dx != 0.0 ? 25.0 / std::abs(dx) : 1e9;
      range = std::min(range, dy > 0.0 ? (25.0 - y) / dy : (-25.0 - y) / dy);
      const bool is_ground = dz < 0.0 && -kSensorHeight / dz < range;
      if (is_ground) range = -kSensorHeight / dz;
      const double at_box = 8.0 / dx;
      const bool hits_box = has_box && dx > 0.0 && at_box < range &&
                            std::abs(y + at_box * dy) < 1.0 && kSensorHeight + at_box * dz < 1.5;
      if (hits_box) range = at_box;
      scan.x.push_back(static_cast<float>(range * dx));
      scan.y.push_back(static_cast<float>(range * dy));
      scan.z.push_back(static_cast<float>(range * dz));
      scan.verdicts.push_back(is_ground && !hits_box ? dynains::PointLabel::kGround
                                                     : dynains::PointLabel::kStatic);
    }
  }
  return scan;
}

void add_session(dynains::City& city, const char* name, double begin, bool has_box) {
  dynains::SessionInfo session;
  session.name = name;
  session.begin = begin;
  dynains::SessionWriter writer(city, session);
  for (std::uint32_t number = 0; number < 8; ++number) {
    const double y = static_cast<double>(number) - 4.0;
    const Scan scan = measure(y, has_box);
    Eigen::Isometry3d T_world_sensor = Eigen::Isometry3d::Identity();
    T_world_sensor.translation() = Eigen::Vector3d(0.0, y, kSensorHeight);
    writer.add({scan.x, scan.y, scan.z}, scan.verdicts, {}, T_world_sensor, number);
  }
  writer.commit();
  city.reload();
}

/// Points of the map after session number `last` in the middle of the box.
std::size_t count_box_points(const dynains::City& city, std::uint32_t last) {
  std::size_t count = 0;
  for (const dynains::TileIndex& tile : city.tiles()) {
    const dynains::TileHistory history = city.history(tile, last);
    history.for_each_standing(last, [&](std::size_t session, std::size_t i) {
      const Eigen::Vector3d p = position_of(city.grid(), tile, history.points(session)[i]);
      const bool is_inside = p.x() > 7.5 && p.x() < 10.5 && std::abs(p.y()) < 1.2;
      if (is_inside && p.z() > 0.5) ++count;
    });
  }
  return count;
}

}  // namespace

int main(int argc, char** argv) {
  const std::filesystem::path folder =
      argc > 1 ? argv[1] : std::filesystem::temp_directory_path() / "dynains_many_sessions";
  dynains::City city = dynains::City::open_or_make(folder, {});
  // The order of processing does not matter: `begin` decides.
  add_session(city, "second_day", 86400.0, false);
  add_session(city, "first_day", 0.0, true);

  const std::size_t before = count_box_points(city, city.number_of("first_day"));
  const std::size_t after = count_box_points(city, city.number_of("second_day"));
  std::cout << "points of the box after the first day: " << before
            << ", after the second day: " << after << std::endl;
  for (const char* const name : {"first_day", "second_day"}) city.drop(name);
  std::filesystem::remove(folder);
  return before > 20 && after == 0 ? 0 : 1;
}
