// One tile of a map of many sessions: cubes, what a session itself saw.
#include "dynains/city/tile_history.hpp"

#include <cstddef>
#include <functional>
#include <utility>
#include <vector>

#include "support/catch.hpp"
#include "support/visibility.hpp"

using namespace dynains;
using test::BeamResult;

namespace {

/// `label`: 1 for the ground, else of an object.
SessionPoint point_at(float x, float y, float z, std::uint32_t label) {
  return {x, y, z, 0, label, label == 1 ? 1U : 0U};
}

void add_box(std::vector<SessionPoint>& points, float from, float to, float bottom, float top,
             std::uint32_t label) {
  for (float x = from + 0.1F; x < to; x += 0.2F) {
    for (float z = bottom + 0.05F; z < top; z += 0.2F)
      points.push_back(point_at(x, 2.1F, z, label));
  }
}

using Beam = std::function<BeamResult(const Eigen::Vector3d& position)>;

/// `count` references that see each point of the tile as `beam` tells.
void revise(TileHistory& history, int count, const Beam& beam) {
  const Eigen::Vector3d sensor(5.0, 2.0, 2.0);
  detail::Visibility visibility;
  for (int scan = 0; scan < count; ++scan) {
    history.revise(
        sensor, [&](const PointBuffer& points, std::size_t size) -> const auto& {
          return visibility = test::visibility_by(beam, points, size, sensor);
        });
  }
}

/// Points of the map after a session that have the label of a point; with `session`, of it.
std::size_t count_standing(const TileHistory& history, std::uint32_t last, std::size_t session,
                           const std::function<bool(const SessionPoint&)>& matches) {
  std::size_t count = 0;
  history.for_each_standing(last, [&](std::size_t of, std::size_t i) {
    count += of == session && matches(history.points(of)[i]) ? 1U : 0U;
  });
  return count;
}

}  // namespace

TEST_CASE("a tile: a tree that was felled beside a wall leaves with what no beam reached") {
  // A wall of 20 m, and a tree that touches its end.
  std::vector<SessionPoint> points;
  add_box(points, 0.0F, 20.0F, 0.0F, 2.0F, 50);
  add_box(points, 20.0F, 22.4F, 0.0F, 6.0F, 70);
  const auto is_tree = [](const SessionPoint& point) { return point.label == 70; };
  const auto is_wall = [](const SessionPoint& point) { return point.label == 50; };
  TileHistory history(SessionGrid{});
  history.add_session(points);
  history.add_session({});
  history.end_session();
  const std::size_t tree = count_standing(history, 0, 0, is_tree);
  const std::size_t wall = count_standing(history, 0, 0, is_wall);
  // Beams of the next day hit the wall and pass through every second metre of height of the tree.
  revise(history, 5, [](const Eigen::Vector3d& p) {
    if (p.x() < 19.2) return BeamResult::kHit;
    return static_cast<int>(p.z() / 0.8) % 2 == 0 ? BeamResult::kFree : BeamResult::kUnknown;
  });
  history.end_session();
  CHECK(tree > 300);
  CHECK(count_standing(history, 1, 0, is_tree) == 0);
  CHECK(count_standing(history, 1, 0, is_wall) > wall * 9 / 10);
}

TEST_CASE("a tile: tells what beams of the own session passed through, sooner or later") {
  const auto passed = [](BeamResult first, int first_count, BeamResult second, int second_count) {
    std::vector<SessionPoint> points;
    add_box(points, 2.0F, 4.0F, 0.0F, 1.6F, 10);
    TileHistory history(SessionGrid{});
    history.add_session(points);
    revise(history, first_count, [=](const Eigen::Vector3d&) { return first; });
    revise(history, second_count, [=](const Eigen::Vector3d&) { return second; });
    history.end_session();
    return history.own_beams_passed(0, 0);
  };
  CHECK(passed(BeamResult::kHit, 20, BeamResult::kFree, 4));  // drove off
  CHECK(passed(BeamResult::kFree, 4, BeamResult::kHit, 20));  // came and stopped
  CHECK_FALSE(passed(BeamResult::kHit, 20, BeamResult::kFree, 3));
  CHECK_FALSE(passed(BeamResult::kHit, 20, BeamResult::kUnknown, 9));
}
