#include "dynains/recording/visit.hpp"

#include <algorithm>
#include <array>
#include <tuple>
#include <utility>

#include "dynains/errors.hpp"
#include "dynains/median.hpp"
#include "dynains/sensor/mounting.hpp"
#include "dynains/threads/background.hpp"

namespace dynains {
namespace {

constexpr float kBelief = 0.95F;         // of points that the second pass removes
constexpr float kRestoredBelief = 0.5F;  // of objects that it brings back
constexpr double kPlaceShare = 0.75;     // of the memory; the rest is for the ground

std::size_t bytes_of(double megabytes) { return static_cast<std::size_t>(1e6 * megabytes); }

// m, around one vehicle, z up.
bool is_compact(const Eigen::Vector3f& size) {
  constexpr float kLongest = 18.0F, kHighest = 4.5F;
  return std::max(size.x(), size.y()) <= kLongest && size.z() <= kHighest;
}

}  // namespace

bool Visit::Instance::leaves() const {
  constexpr float kChangedRatio = 0.25F;       // of the known places of an instance that leaves
  constexpr float kLowChangedRatio = 0.2F;     // of those in its lower half: panes are higher
  constexpr float kLeastChangedRatio = 0.15F;  // of all known ones
  constexpr float kLargeChangedRatio = 0.5F;   // of a larger instance
  const auto has = [](std::uint32_t part, float of, std::uint32_t all) {
    return static_cast<float>(part) >= of * static_cast<float>(all);
  };
  const float ratio = is_compact(highest - lowest) ? kChangedRatio : kLargeChangedRatio;
  return has(changed, kLeastChangedRatio, known) && changed > 0 &&
         has(changed, ratio, changed + stays) &&
         has(low_changed, kLowChangedRatio, low_changed + low_stays);
}

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
  points_ = points;
  for (const std::size_t i : placed_) place_of_[i] = nullptr;
  placed_.clear();
  place_of_.resize(points_.size(), nullptr);
  is_restored_.assign(points_.size(), 0);
  const Pose& T_level_sensor = T_level_sensor_[number];
  const std::uint64_t before = restored_ + removed_;
  find_places(number, T_level_sensor, verdict);
  restore_ground(T_level_sensor, verdict);
  remove_objects(number, T_level_sensor, verdict);
  return restored_ + removed_ > before;
}

// Finds the places of points that may have changed, and restores removed points that stand.
void Visit::find_places(std::uint32_t number, const Pose& T_level_sensor, VerdictArrays& verdict) {
  places_.begin_scan(points_, T_level_sensor, is_near_);
  const auto is_near_ground = [&](std::size_t i) {
    return is_near_[i] != 0 && verdict.labels[i] == PointLabel::kGround;
  };
  // m, more than a pose that is off by 0.1 deg moves ground 50 m away
  constexpr double kRise = 0.10;
  ground_.for_each_rise(points_, T_level_sensor, is_near_ground,
                        [&](std::size_t i, const WorldCell& cell, double rise, bool) {
                          if (rise < kRise) return;
                          if (const Place* const place = changed_at_ground(cell)) put(i, *place);
                        });
  const auto is_near_object = [&](std::size_t i) {
    return verdict.labels[i] == PointLabel::kDynamic ||
           (is_near_[i] != 0 && verdict.labels[i] == PointLabel::kStatic);
  };
  const auto take = [&](std::size_t i, const Place* place) {
    if (place == nullptr) return;
    if (verdict.labels[i] == PointLabel::kDynamic) {
      if (stands(*place, number)) restore(i, verdict);
    } else if (place->state != PlaceState::kUnknown) {
      put(i, *place);
    }
  };
  places_.for_each_place(points_, T_level_sensor, is_near_object, take);
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

void Visit::restore(std::size_t point, VerdictArrays& verdict) {
  if (verdict.causes[point] == Cause::kUnderInstance) return;
  verdict.labels[point] = PointLabel::kStatic;
  verdict.causes[point] = Cause::kStands;
  if (!verdict.beliefs.empty()) verdict.beliefs[point] = kRestoredBelief;
  is_restored_[point] = 1;
  ++restored_;
}

// Removed points that do not rise above the ground of all scans come back. The underside of a lorry
// can look like ground where the ground nearby is lower.
void Visit::restore_ground(const Pose& T_level_sensor, VerdictArrays& verdict) {
  constexpr double kMostRise = 0.02;  // m
  ground_.free_far(T_level_sensor.translation());
  const auto is_removed = [&](std::size_t i) { return verdict.labels[i] == PointLabel::kDynamic; };
  ground_.for_each_rise(points_, T_level_sensor, is_removed,
                        [&](std::size_t i, const WorldCell&, double rise, bool is_level) {
                          if (!is_level || rise > kMostRise) return;
                          verdict.labels[i] = PointLabel::kGround;
                          verdict.causes[i] = Cause::kGround;
                          verdict.instances[i] = kNoInstance;
                          if (!verdict.beliefs.empty()) verdict.beliefs[i] = 0.0F;
                          ++restored_;
                        });
}

void Visit::remove_objects(std::uint32_t number, const Pose& T_level_sensor,
                           VerdictArrays& verdict) {
  find_instances(number, T_level_sensor, verdict);
  for (const std::size_t i : placed_) {
    if (!has_changed(*place_of_[i], number)) continue;
    remove(i, verdict);
    Object& object = objects_[place_of_[i]->object - 1];
    if (object.points++ == 0) object.first_measured = numbers_of_scans_[number];
    object.last_measured = numbers_of_scans_[number];
  }
  const auto leaves = [](const Instance& instance) { return instance.is_leaving; };
  if (std::none_of(instances_.begin(), instances_.end(), leaves)) return;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (!is_static(verdict.labels[i]) || is_restored_[i] != 0) continue;
    const std::uint32_t instance = numbers_.find(verdict.instances[i]);
    if (instance != InstanceNumbers::kNone && instances_[instance].is_leaving) remove(i, verdict);
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

// Numbers the instances of which places have changed: no other leaves.
void Visit::choose_instances(std::uint32_t number, const VerdictArrays& verdict) {
  numbers_.clear();
  for (const std::size_t i : placed_) {
    if (verdict.labels[i] != PointLabel::kStatic) continue;
    if (verdict.instances[i] == kNoInstance || !has_changed(*place_of_[i], number)) continue;
    numbers_.add(verdict.instances[i]);
  }
}

void Visit::find_instances(std::uint32_t number, const Pose& T_level_sensor,
                           const VerdictArrays& verdict) {
  choose_instances(number, verdict);
  instances_.assign(numbers_.ids().size(), {});
  seen_.clear();
  if (instances_.empty()) return;
  find_other_places(T_level_sensor, verdict);
  level_.resize(points_.size());
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const std::uint32_t chosen = numbers_.find(verdict.instances[i]);
    if (chosen == InstanceNumbers::kNone || verdict.labels[i] != PointLabel::kStatic) continue;
    const Eigen::Vector3d point(static_cast<double>(points_.x[i]),
                                static_cast<double>(points_.y[i]),
                                static_cast<double>(points_.z[i]));
    // Single precision is enough for sizes, if positions are relative to the sensor.
    level_[i] = (T_level_sensor.linear() * point).cast<float>();
    Instance& instance = instances_[chosen];
    instance.lowest = instance.lowest.cwiseMin(level_[i]);
    instance.highest = instance.highest.cwiseMax(level_[i]);
  }
  list_seen(verdict);
  for (std::size_t begin = 0, end; begin < seen_.size(); begin = end) {
    end = begin;
    while (end < seen_.size() && seen_[end].instance == seen_[begin].instance) ++end;
    judge(number, seen_.data() + begin, seen_.data() + end);
  }
}

// Finds the places of points of instances that are not near what has changed.
void Visit::find_other_places(const Pose& T_level_sensor, const VerdictArrays& verdict) {
  const auto is_taken = [&](std::size_t i) {
    return verdict.labels[i] == PointLabel::kStatic && is_near_[i] == 0 && is_restored_[i] == 0 &&
           numbers_.find(verdict.instances[i]) != InstanceNumbers::kNone;
  };
  places_.for_each_place(points_, T_level_sensor, is_taken, [&](std::size_t i, const Place* place) {
    if (place != nullptr && place->state != PlaceState::kUnknown) put(i, *place);
  });
}

// Lists the places of instances. A place is low if any of its points is.
void Visit::list_seen(const VerdictArrays& verdict) {
  for (const std::size_t i : placed_) {
    if (verdict.labels[i] != PointLabel::kStatic) continue;
    const std::uint32_t chosen = numbers_.find(verdict.instances[i]);
    if (chosen == InstanceNumbers::kNone) continue;
    const Instance& instance = instances_[chosen];
    const bool is_low = level_[i].z() <= 0.5F * (instance.lowest.z() + instance.highest.z());
    const Seen seen = {chosen, place_of_[i], is_low};
    if (seen_.empty() || !seen_.back().is_same(seen)) {
      seen_.push_back(seen);
    } else {
      seen_.back().is_low = seen_.back().is_low || is_low;
    }
  }
  // Low ones come first, and stay.
  std::sort(seen_.begin(), seen_.end(), [](const Seen& a, const Seen& b) {
    return std::make_tuple(a.instance, a.place, !a.is_low) <
           std::make_tuple(b.instance, b.place, !b.is_low);
  });
  const auto is_same = [](const Seen& a, const Seen& b) { return a.is_same(b); };
  seen_.erase(std::unique(seen_.begin(), seen_.end(), is_same), seen_.end());
}

// Scans in which an instance was not there: medians over its places that have changed.
ScanSpan Visit::absence(std::uint32_t number, const Seen* begin, const Seen* end) const {
  std::vector<std::uint32_t> firsts, lasts;
  for (const Seen* seen = begin; seen != end; ++seen) {
    if (!has_changed(*seen->place, number)) continue;
    const ScanSpan span = seen->place->absence();
    firsts.push_back(span.first);
    lasts.push_back(span.last);
  }
  if (firsts.empty()) return {};
  const ScanSpan span = {median(std::move(firsts)), median(std::move(lasts))};
  const std::uint32_t newest = scans() - 1;
  // The first pass has compared scans that are closer in time.
  const std::uint32_t scans = std::min(span.last, newest) - std::min(span.first, newest);
  return scans >= kIndependentScans ? span : ScanSpan();
}

void Visit::judge(std::uint32_t number, const Seen* begin, const Seen* end) {
  Instance& instance = instances_[begin->instance];
  const ScanSpan span = absence(number, begin, end);
  for (const Seen* seen = begin; seen != end; ++seen) {
    const bool is_gone = has_changed(*seen->place, number);
    const bool stays = !is_gone && seen->place->present.any_within(span);
    ++instance.known;
    instance.changed += is_gone ? 1 : 0;
    instance.stays += stays ? 1 : 0;
    instance.low_changed += is_gone && seen->is_low ? 1 : 0;
    instance.low_stays += stays && seen->is_low ? 1 : 0;
  }
  instance.is_leaving = instance.leaves();
}

}  // namespace dynains
