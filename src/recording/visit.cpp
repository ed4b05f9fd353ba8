#include "dynains/recording/visit.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "dynains/errors.hpp"
#include "dynains/sensor/mounting.hpp"
#include "dynains/threads/background.hpp"

namespace dynains {
namespace {

constexpr float kBelief = 0.95F;         // of points that the second pass removes
constexpr float kRestoredBelief = 0.5F;  // of objects that it brings back
constexpr double kPlaceShare = 0.75;     // of the memory; the rest is for the ground

std::size_t bytes_of(double megabytes) { return static_cast<std::size_t>(1e6 * megabytes); }

}  // namespace

Visit::Visit(ByteStore& store, const SecondPassConfig& config)
    : config_(config),
      store_(store),
      places_(store, bytes_of(kPlaceShare * config.memory)),
      ground_(store, bytes_of((1.0 - kPlaceShare) * config.memory)),
      references_(RecordingReferencesConfig{1.0, 5}, config.evidence.lateral_margin) {}

// Axes of the places: which way is up is told by the ground of the first scan, not by the world.
void Visit::find_up(PointsView points, const Pose& T_world_sensor) {
  T_level_world_.linear() = estimate_mounting(points).R_level_sensor();
  T_level_world_ = orthonormalized(T_level_world_ * T_world_sensor.inverse());
}

void Visit::add(PointsView points, const ScanVerdict& verdict, const Pose& T_world_sensor) {
  const std::uint32_t number = scans();
  if (number == 0) find_up(points, T_world_sensor);
  const Pose T = orthonormalized(T_level_world_ * T_world_sensor);
  T_level_sensor_.push_back(T);
  numbers_of_scans_.push_back(static_cast<std::uint32_t>(verdict.scan));
  places_.add(points, verdict.labels, verdict.causes, T, verdict.time, number);
  ground_.add(points, verdict.labels, T);
  const RecordingReference* const reference = references_.add(points, verdict.labels, T, number);
  if (reference == nullptr) return;
  packed_.resize(most_packed_bytes(reference->image.grid()));
  const auto size =
      static_cast<std::size_t>(pack_image(reference->image, packed_.data()) - packed_.data());
  const std::uint64_t offset = store_.append({packed_.data(), size});
  kept_.push_back({number, verdict.time, offset, size});
}

void Visit::rest() {
  places_.rest();
  ground_.rest();
}

bool Visit::test(const std::function<bool()>& keep_going) {
  std::array<ReferenceTest, 2> tests = {ReferenceTest(config_.evidence),
                                        ReferenceTest(config_.evidence)};
  RecordingReference reference, next;
  Background reader;
  Background* const other = config_.threads > 1 ? &reader : nullptr;
  if (!kept_.empty()) read(kept_.front(), next);
  for (std::size_t i = 0; i < kept_.size(); ++i) {
    if (!keep_going()) return false;
    std::swap(reference, next);
    const Pose T_level_points(Eigen::Translation3d(reference.T_world_beams.translation()));
    places_.begin_test(kept_[i].scan, kept_[i].time, T_level_points.translation());
    const auto test_part = [&](std::size_t part) {
      places_.test(
          part, [&](const PointBuffer& points, std::size_t count) -> const auto& {
            return tests[part](reference, points, count, T_level_points);
          });
    };
    run_both(
        other, [&] { test_part(0); },
        [&] {
          if (i + 1 < kept_.size()) read(kept_[i + 1], next);
          test_part(1);
        });
  }
  places_.decide();
  ground_.complete();
  list_objects();
  return true;
}

void Visit::read(const Reference& kept, RecordingReference& reference) {
  store_.read(kept.offset, kept.size, packed_);
  reference.scan = kept.scan;
  reference.T_world_beams = T_level_sensor_[kept.scan];
  if (!unpack_image(references_.grid(), packed_, reference.image)) {
    throw IoError("a reference of the second pass was damaged in its store");
  }
}

void Visit::list_objects() {
  const Pose T_world_level = T_level_world_.inverse();
  objects_.assign(places_.object_count(), {});
  places_.for_each([&](const Eigen::Vector3d& middle, const Place& place) {
    if (place.state != PlaceState::kChanged) return;
    Object& object = objects_[place.object - 1];
    const Eigen::Vector3d at = T_world_level * middle;
    const Eigen::Vector3d half = Eigen::Vector3d::Constant(0.5 * kWorldCell);
    object.lowest = object.lowest.cwiseMin(at - half);
    object.highest = object.highest.cwiseMax(at + half);
    if (!place.was_passed()) return;
    const auto [first, last] = places_.free_scans(place);
    object.first_passed = std::min(object.first_passed, numbers_of_scans_[first]);
    object.last_passed = std::max(object.last_passed, numbers_of_scans_[last]);
  });
}

bool Visit::revise(PointsView points, std::uint32_t number, VerdictArrays& verdict) {
  const std::uint64_t before = restored_ + removed_;
  const Pose& T_level_sensor = T_level_sensor_[number];
  places_.begin_scan(points, T_level_sensor, is_near_);
  ground_.free_far(T_level_sensor.translation());
  restore(points, number, verdict);
  remove_objects(points, number, verdict);
  return restored_ + removed_ > before;
}

// The place that has changed of a ground point that rises, or one that touches it; else null.
const Visit::Place* Visit::changed_at_ground(const WorldCell& cell) {
  const Place* const place = places_.find(cell);
  const bool has_changed = place != nullptr && place->state == PlaceState::kChanged;
  return has_changed ? place : places_.changed_beside(cell);
}

// Whether what scan `number` measured in a place is no part of the static map.
bool Visit::has_changed(const Place& place, std::uint32_t number) const {
  const bool stays = config_.static_policy == StaticPolicy::kLast && place.stands_since(number);
  return place.state == PlaceState::kChanged && !stays;
}

bool Visit::stands(const Place& place, std::uint32_t number) const {
  const bool has_come =
      config_.static_policy == StaticPolicy::kLast && place.state == PlaceState::kChanged;
  return place.stands() || (has_come && place.stands_since(number));
}

// Restores removed points that stand, or do not rise above the ground of all scans. What looks like
// ground under an instance is often its underside or its wheels, and stays removed.
void Visit::restore(PointsView points, std::uint32_t number, VerdictArrays& verdict) {
  constexpr double kMostRise = 0.02;  // m
  const Pose& T_level_sensor = T_level_sensor_[number];
  const auto is_removed = [&](std::size_t i) {
    return verdict.labels[i] == PointLabel::kDynamic && verdict.causes[i] != Cause::kUnderInstance;
  };
  const auto restore_point = [&](std::size_t i, const Place* place) {
    if (place == nullptr || !stands(*place, number)) return;
    verdict.labels[i] = PointLabel::kStatic;
    verdict.causes[i] = Cause::kStands;
    if (!verdict.beliefs.empty()) verdict.beliefs[i] = kRestoredBelief;
    ++restored_;
  };
  places_.for_each_place(points, T_level_sensor, is_removed, restore_point);
  ground_.for_each_rise(points, T_level_sensor, is_removed,
                        [&](std::size_t i, const WorldCell&, double rise, bool is_level) {
                          if (!is_level || rise > kMostRise) return;
                          verdict.labels[i] = PointLabel::kGround;
                          verdict.causes[i] = Cause::kGround;
                          verdict.instances[i] = kNoInstance;
                          if (!verdict.beliefs.empty()) verdict.beliefs[i] = 0.0F;
                          ++restored_;
                        });
}

void Visit::remove_objects(PointsView points, std::uint32_t number, VerdictArrays& verdict) {
  const std::uint64_t before = removed_;
  const auto is_near = [&](PointLabel label) {
    return [this, &verdict, label](std::size_t i) {
      return is_near_[i] != 0 && verdict.labels[i] == label;
    };
  };
  const auto leave = [&](std::size_t i, const Place* place) {
    if (place == nullptr || !has_changed(*place, number)) return;
    remove(i, verdict);
    Object& object = objects_[place->object - 1];
    if (object.points++ == 0) object.first_measured = numbers_of_scans_[number];
    object.last_measured = numbers_of_scans_[number];
  };
  const Pose& T_level_sensor = T_level_sensor_[number];
  // m, more than a pose that is off by 0.1 deg moves ground 50 m away
  constexpr double kRise = 0.10;
  ground_.for_each_rise(points, T_level_sensor, is_near(PointLabel::kGround),
                        [&](std::size_t i, const WorldCell& cell, double rise, bool) {
                          if (rise >= kRise) leave(i, changed_at_ground(cell));
                        });
  places_.for_each_place(points, T_level_sensor, is_near(PointLabel::kStatic), leave);
  if (removed_ > before) remove_instances(verdict);
}

// Removes the instances of a scan of which at least half of the points have left.
void Visit::remove_instances(VerdictArrays& verdict) {
  majority_.assign(1 + *std::max_element(verdict.instances.begin(), verdict.instances.end()), 0);
  for (std::size_t i = 0; i < verdict.labels.size(); ++i) {
    const bool has_left = verdict.causes[i] == Cause::kCameOrWent;
    const bool stays = verdict.labels[i] == PointLabel::kStatic;
    majority_[verdict.instances[i]] += (has_left ? 1 : 0) - (stays ? 1 : 0);
  }
  for (std::size_t i = 0; i < verdict.labels.size(); ++i) {
    const bool may_leave = verdict.labels[i] == PointLabel::kStatic &&
                           verdict.causes[i] != Cause::kStands &&
                           verdict.instances[i] != kNoInstance;
    if (may_leave && majority_[verdict.instances[i]] >= 0) remove(i, verdict);
  }
}

void Visit::remove(std::size_t point, VerdictArrays& verdict) {
  verdict.labels[point] = PointLabel::kDynamic;
  verdict.causes[point] = Cause::kCameOrWent;
  if (!verdict.beliefs.empty()) {
    verdict.beliefs[point] = std::max(verdict.beliefs[point], kBelief);
  }
  ++removed_;
}

}  // namespace dynains
