// One tile of a map of many sessions: ground of other sessions, cubes, what a session itself saw.
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
  return {x, y, z, 0, label, label == 1};
}

/// A street of 10 m x 4 m, its ground at a height.
std::vector<SessionPoint> street(float height) {
  std::vector<SessionPoint> points;
  for (float x = 0.1F; x < 10.0F; x += 0.2F) {
    for (float y = 0.1F; y < 4.0F; y += 0.2F) points.push_back(point_at(x, y, height, 1));
  }
  return points;
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
    history.revise(static_cast<std::uint32_t>(scan), sensor,
                   [&](const PointBuffer& points, std::size_t size) -> const detail::Visibility& {
                     visibility = test::visibility_by(beam, points, size, sensor);
                     return visibility;
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

TEST_CASE("a tile: ground above the ground of another session leaves, unless another one has it") {
  // Ground points above the street: the lower part of a car that drove by.
  const auto with_low_part = [](float height) {
    std::vector<SessionPoint> points = street(0.19F);
    for (float x = 2.1F; x < 6.0F; x += 0.2F)
      points.push_back(point_at(x, 2.1F, 0.19F + height, 1));
    return points;
  };
  const auto is_raised = [](const SessionPoint& p) { return p.is_ground && p.z > 0.2F; };
  const std::size_t raised = 20, ground = street(0.19F).size();
  const auto history_of = [](std::vector<std::vector<SessionPoint>> sessions) {
    TileHistory history(SessionGrid{});
    for (std::vector<SessionPoint>& points : sessions) history.add_session(std::move(points));
    for (std::size_t i = 0; i < history.session_count(); ++i) history.end_session();
    return history;
  };
  const std::vector<SessionPoint> with_car = with_low_part(0.11F);
  // The session alone cannot tell; the next one can, and so can the one before.
  const TileHistory next = history_of({with_car, street(0.19F)});
  CHECK(count_standing(next, 0, 0, is_raised) == raised);
  CHECK(count_standing(next, 1, 0, is_raised) == 0);
  CHECK(next.removal(0, ground).session == 1);
  CHECK(count_standing(history_of({street(0.19F), with_car}), 1, 1, is_raised) == 0);
  // The street itself stands, also below the car.
  const auto is_street = [&](const SessionPoint& point) { return !is_raised(point); };
  CHECK(count_standing(history_of({street(0.19F), with_car}), 1, 1, is_street) == ground);
  // Less than 0.1 m above the ground, it is ground.
  CHECK(count_standing(history_of({with_low_part(0.09F), street(0.19F)}), 1, 0, is_raised) ==
        raised);

  // A low wall that both sessions have seen stands, also if the second one saw it 0.05 m lower.
  const std::vector<SessionPoint> with_wall = with_low_part(0.2F);
  CHECK(count_standing(history_of({with_wall, with_wall}), 1, 1, is_raised) == raised);
  const auto count_with = [&](float other) {
    const TileHistory history = history_of({with_wall, with_low_part(other)});
    std::size_t count = 0;
    for (std::size_t i = ground; i < with_wall.size(); ++i) count += history.stands(0, i, 1);
    return count;
  };
  CHECK(count_with(0.15F) == raised);
  CHECK(count_with(0.06F) == 0);
  // A car that is parked there stands with its lower part.
  std::vector<SessionPoint> parked = with_car;
  add_box(parked, 2.0F, 6.0F, 0.4F, 1.5F, 10);
  CHECK(count_standing(history_of({street(0.19F), parked}), 1, 1, is_raised) == raised);
  // A session without points at this place removes nothing there.
  CHECK(count_standing(history_of({with_car, {point_at(20.0F, 20.0F, 0.0F, 1)}}), 1, 0,
                       is_raised) == raised);
  // Ground of which the session saw no lower part anywhere is none of an object.
  CHECK(history_of({street(0.35F), street(0.19F)}).stands(0, 0, 1));
}

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
