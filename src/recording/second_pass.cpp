#include "dynains/recording/second_pass.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include "dynains/errors.hpp"
#include "dynains/median.hpp"
#include "dynains/threads/background.hpp"

namespace dynains {
namespace {

constexpr float kChangedRatio = 0.25F;       // of the known points of an instance that leaves
constexpr float kLowChangedRatio = 0.2F;     // of those in its lower half: panes are higher
constexpr float kLeastChangedRatio = 0.15F;  // of all known ones
constexpr float kLargeChangedRatio = 0.5F;   // of a larger instance
constexpr float kBelief = 0.95F;             // of points that the second pass removes
constexpr float kRestoredBelief = 0.5F;      // of objects that it brings back
constexpr double kPlaceShare = 0.75;         // of the memory; the rest is for the ground

std::size_t bytes_of(double megabytes) { return static_cast<std::size_t>(1e6 * megabytes); }

void check_sizes(PointsView points, std::size_t labels, std::size_t causes, std::size_t instances) {
  if (labels == points.size() && causes == points.size() && instances == points.size()) return;
  throw UsageError("SecondPass: a verdict of " + std::to_string(labels) + " labels, " +
                   std::to_string(causes) + " causes and " + std::to_string(instances) +
                   " instances on " + std::to_string(points.size()) + " points");
}

}  // namespace

bool SecondPass::Instance::leaves() const {
  const float ratio = is_compact(highest - lowest) ? kChangedRatio : kLargeChangedRatio;
  if (moved && 4 * places.stays <= places.known) return true;
  return points.leave(ratio) || places.leave(ratio);
}

bool SecondPass::Share::leave(float ratio) const {
  const auto has = [](std::uint32_t part, float of, std::uint32_t all) {
    return static_cast<float>(part) >= of * static_cast<float>(all);
  };
  return has(changed, kLeastChangedRatio, known) && changed > 0 &&
         has(changed, ratio, changed + stays) &&
         has(low_changed, kLowChangedRatio, low_changed + low_stays);
}

SecondPass::SecondPass(ByteStore& store, const SecondPassConfig& config)
    : config_((config.validate(), config)),
      store_(store),
      places_(RecordingPlacesConfig(), store, bytes_of(kPlaceShare * config.memory)),
      ground_(store, bytes_of((1.0 - kPlaceShare) * config.memory)),
      references_(RecordingReferencesConfig{1.0, 5}) {}

void SecondPass::add(PointsView points, const ScanVerdict& verdict) {
  const auto number = static_cast<std::uint32_t>(verdict.scan);
  if (verdict.scan != scans_ || is_decided_) {
    throw UsageError(
        "SecondPass::add: scan " + std::to_string(verdict.scan) +
        (is_decided_ ? " comes after test()" : ", expected scan " + std::to_string(scans_)));
  }
  check_sizes(points, verdict.labels.size(), verdict.causes.size(), verdict.instances.size());
  places_.add(points, verdict.labels, verdict.causes, verdict.T_world_sensor, verdict.time, number);
  chains_.add(points, verdict.labels, verdict.instances, verdict.T_world_sensor);
  ground_.add(points, verdict.labels, verdict.T_world_sensor);
  ++scans_;
  const RecordingReference* const reference =
      references_.add(points, verdict.labels, verdict.T_world_sensor, number);
  if (reference == nullptr) return;
  packed_.resize(most_packed_bytes(reference->image.grid()));
  const auto size =
      static_cast<std::size_t>(pack_image(reference->image, packed_.data()) - packed_.data());
  const std::uint64_t offset = store_.append({packed_.data(), size});
  kept_.push_back({number, verdict.time, verdict.T_world_sensor, offset, size});
}

void SecondPass::test(const std::function<bool()>& keep_going) {
  std::array<ReferenceTest, 2> tests = {ReferenceTest(FreeSpaceConfig()),
                                        ReferenceTest(FreeSpaceConfig())};
  RecordingReference reference, next;
  Background reader;
  Background* const other = config_.threads > 1 ? &reader : nullptr;
  if (!kept_.empty()) read(kept_.front(), next);
  for (std::size_t i = 0; i < kept_.size(); ++i) {
    if (!keep_going()) return;
    std::swap(reference, next);
    const Pose T_world_points(Eigen::Translation3d(kept_[i].T_world_sensor.translation()));
    places_.begin_test(kept_[i].scan, kept_[i].time, T_world_points.translation());
    const auto test_part = [&](std::size_t part) {
      places_.test(
          part, [&](const PointBuffer& points, std::size_t count) -> const auto& {
            return tests[part](reference, points, count, T_world_points);
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
  chains_.find_moves();
  ground_.complete();
  list_objects();
  is_decided_ = true;
}

void SecondPass::read(const Reference& kept, RecordingReference& reference) {
  store_.read(kept.offset, kept.size, packed_);
  reference.scan = kept.scan;
  reference.T_world_beams = kept.T_world_sensor;
  if (!unpack_image(references_.grid(), packed_, reference.image)) {
    throw IoError("a reference of the second pass was damaged in its store");
  }
}

void SecondPass::list_objects() {
  objects_.assign(places_.object_count(), {});
  places_.for_each([&](const Eigen::Vector3d& middle, const Place& place) {
    if (place.state != PlaceState::kChanged) return;
    Object& object = objects_[place.object - 1];
    const Eigen::Vector3d half = Eigen::Vector3d::Constant(0.5 * kWorldCell);
    object.lowest = object.lowest.cwiseMin(middle - half);
    object.highest = object.highest.cwiseMax(middle + half);
    if (!place.was_passed()) return;
    const auto [first, last] = places_.free_scans(place);
    object.first_passed = std::min(object.first_passed, first);
    object.last_passed = std::max(object.last_passed, last);
  });
}

bool SecondPass::revise(PointsView points, std::uint32_t number, const Pose& T_world_sensor,
                        VerdictArrays& verdict) {
  check_sizes(points, verdict.labels.size(), verdict.causes.size(), verdict.instances.size());
  points_ = points;
  for (const std::size_t i : placed_) place_of_[i] = nullptr;
  placed_.clear();
  place_of_.resize(points_.size(), nullptr);
  is_restored_.assign(points_.size(), 0);
  if (!is_decided_) return false;
  const std::uint64_t before = restored_ + removed_;
  find_places(number, T_world_sensor, verdict);
  restored_ += ground_.restore(points_, T_world_sensor, verdict);
  remove_objects(number, T_world_sensor, verdict);
  return restored_ + removed_ > before;
}

// Finds the places of points that may have changed, and restores removed points that stand.
void SecondPass::find_places(std::uint32_t number, const Pose& T_world_sensor,
                             VerdictArrays& verdict) {
  places_.begin_scan(points_, T_world_sensor, is_near_);
  const auto is_near_ground = [&](std::size_t i) {
    return is_near_[i] != 0 && verdict.labels[i] == PointLabel::kGround;
  };
  const auto put_ground = [&](std::size_t i, const WorldCell& cell) {
    if (const Place* const place = changed_at_ground(cell)) put(i, *place);
  };
  ground_.for_each_rising(points_, T_world_sensor, is_near_ground, put_ground);
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
  places_.for_each_place(points_, T_world_sensor, is_near_object, take);
}

// The place that has changed of a ground point that rises, or one that touches it; else null.
const SecondPass::Place* SecondPass::changed_at_ground(const WorldCell& cell) {
  const Place* const place = places_.find(cell);
  const bool has_changed = place != nullptr && place->state == PlaceState::kChanged;
  return has_changed ? place : places_.changed_beside(cell);
}

// Whether what scan `number` measured in a place is no part of the static map.
bool SecondPass::has_changed(const Place& place, std::uint32_t number) const {
  const bool stays = config_.static_policy == StaticPolicy::kLast && place.stands_since(number);
  return place.state == PlaceState::kChanged && !stays;
}

bool SecondPass::stands(const Place& place, std::uint32_t number) const {
  const bool has_come =
      config_.static_policy == StaticPolicy::kLast && place.state == PlaceState::kChanged;
  return place.stands() || (has_come && place.stands_since(number));
}

void SecondPass::restore(std::size_t point, VerdictArrays& verdict) {
  if (verdict.causes[point] == Cause::kUnderInstance) return;
  verdict.labels[point] = PointLabel::kStatic;
  verdict.causes[point] = Cause::kStands;
  if (!verdict.beliefs.empty()) verdict.beliefs[point] = kRestoredBelief;
  is_restored_[point] = 1;
  ++restored_;
}

void SecondPass::remove_objects(std::uint32_t number, const Pose& T_world_sensor,
                                VerdictArrays& verdict) {
  find_instances(number, T_world_sensor, verdict);
  for (const std::size_t i : placed_) {
    if (!has_changed(*place_of_[i], number)) continue;
    remove(i, verdict);
    Object& object = objects_[place_of_[i]->object - 1];
    if (object.points++ == 0) object.first_measured = number;
    object.last_measured = number;
  }
  const auto leaves = [](const Instance& instance) { return instance.is_leaving; };
  if (std::none_of(instances_.begin(), instances_.end(), leaves)) return;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (!is_static(verdict.labels[i]) || is_restored_[i] != 0) continue;
    const std::uint32_t instance = numbers_.find(verdict.instances[i]);
    if (instance != InstanceNumbers::kNone && instances_[instance].is_leaving) remove(i, verdict);
  }
}

void SecondPass::remove(std::size_t point, VerdictArrays& verdict) {
  verdict.labels[point] = PointLabel::kDynamic;
  verdict.causes[point] = Cause::kCameOrWent;
  if (!verdict.beliefs.empty()) {
    verdict.beliefs[point] = std::max(verdict.beliefs[point], kBelief);
  }
  ++removed_;
}

// Numbers the instances of which places have changed, or that have moved: no other leaves.
void SecondPass::choose_instances(std::uint32_t number, const VerdictArrays& verdict) {
  numbers_.clear();
  chains_.for_each_move(number, [&](std::uint32_t id) { numbers_.add(id); });
  for (const std::size_t i : placed_) {
    if (verdict.labels[i] != PointLabel::kStatic) continue;
    if (verdict.instances[i] == kNoInstance || !has_changed(*place_of_[i], number)) continue;
    numbers_.add(verdict.instances[i]);
  }
}

void SecondPass::find_instances(std::uint32_t number, const Pose& T_world_sensor,
                                const VerdictArrays& verdict) {
  choose_instances(number, verdict);
  instances_.assign(numbers_.ids().size(), {});
  seen_.clear();
  if (instances_.empty()) return;
  find_other_places(T_world_sensor, verdict);
  world_.resize(points_.size());
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const std::uint32_t chosen = numbers_.find(verdict.instances[i]);
    if (chosen == InstanceNumbers::kNone || verdict.labels[i] != PointLabel::kStatic) continue;
    const Eigen::Vector3d point(static_cast<double>(points_.x[i]),
                                static_cast<double>(points_.y[i]),
                                static_cast<double>(points_.z[i]));
    // Single precision is enough for sizes, if positions are relative to the sensor.
    world_[i] = (T_world_sensor.linear() * point).cast<float>();
    Instance& instance = instances_[chosen];
    instance.lowest = instance.lowest.cwiseMin(world_[i]);
    instance.highest = instance.highest.cwiseMax(world_[i]);
  }
  list_seen(verdict);
  for (std::size_t begin = 0, end; begin < seen_.size(); begin = end) {
    end = begin;
    while (end < seen_.size() && seen_[end].instance == seen_[begin].instance) ++end;
    judge(number, seen_.data() + begin, seen_.data() + end);
  }
}

// Finds the places of points of instances that are not near what has changed.
void SecondPass::find_other_places(const Pose& T_world_sensor, const VerdictArrays& verdict) {
  const auto is_taken = [&](std::size_t i) {
    return verdict.labels[i] == PointLabel::kStatic && is_near_[i] == 0 && is_restored_[i] == 0 &&
           numbers_.find(verdict.instances[i]) != InstanceNumbers::kNone;
  };
  places_.for_each_place(points_, T_world_sensor, is_taken, [&](std::size_t i, const Place* place) {
    if (place != nullptr && place->state != PlaceState::kUnknown) put(i, *place);
  });
}

// Lists the places of instances. A place is low if any of its points is.
void SecondPass::list_seen(const VerdictArrays& verdict) {
  for (const std::size_t i : placed_) {
    if (verdict.labels[i] != PointLabel::kStatic) continue;
    const std::uint32_t chosen = numbers_.find(verdict.instances[i]);
    if (chosen == InstanceNumbers::kNone) continue;
    const Instance& instance = instances_[chosen];
    const bool is_low = world_[i].z() <= 0.5F * (instance.lowest.z() + instance.highest.z());
    if (seen_.empty() || !seen_.back().is_same(chosen, place_of_[i])) {
      seen_.push_back({chosen, place_of_[i], 0, false});
    }
    seen_.back().add(1, is_low);
  }
  std::sort(seen_.begin(), seen_.end(), [](const Seen& a, const Seen& b) {
    return std::make_pair(a.instance, a.place) < std::make_pair(b.instance, b.place);
  });
  std::size_t size = 0;
  for (const Seen& seen : seen_) {
    if (size > 0 && seen_[size - 1].is_same(seen.instance, seen.place)) {
      seen_[size - 1].add(seen.points, seen.is_low);
    } else {
      seen_[size++] = seen;
    }
  }
  seen_.resize(size);
}

// Scans in which an instance was not there: medians over its places that have changed.
ScanSpan SecondPass::absence(std::uint32_t number, const Seen* begin, const Seen* end) const {
  std::vector<std::uint32_t> firsts, lasts;
  for (const Seen* seen = begin; seen != end; ++seen) {
    if (!has_changed(*seen->place, number)) continue;
    const ScanSpan span = places_.absence(*seen->place);
    firsts.push_back(span.first);
    lasts.push_back(span.last);
  }
  if (firsts.empty()) return {};
  const ScanSpan span = {median(std::move(firsts)), median(std::move(lasts))};
  const std::uint32_t newest = scans_ - 1;
  // The first pass has compared scans that are closer in time.
  const std::uint32_t scans = std::min(span.last, newest) - std::min(span.first, newest);
  return scans >= kIndependentScans ? span : ScanSpan();
}

void SecondPass::judge(std::uint32_t number, const Seen* begin, const Seen* end) {
  Instance& instance = instances_[begin->instance];
  const InstanceChains::Move* const move = chains_.move_of(number, numbers_.ids()[begin->instance]);
  instance.moved =
      move != nullptr && (move->is_later || config_.static_policy == StaticPolicy::kAlways);
  const ScanSpan span = instance.moved ? move->elsewhere : absence(number, begin, end);
  for (const Seen* seen = begin; seen != end; ++seen) {
    const bool is_gone = has_changed(*seen->place, number);
    const bool stays = !is_gone && seen->place->present.any_within(span);
    const auto add = [&](Share& share, std::uint32_t count) {
      share.known += count;
      share.changed += is_gone ? count : 0;
      share.stays += stays ? count : 0;
      share.low_changed += is_gone && seen->is_low ? count : 0;
      share.low_stays += stays && seen->is_low ? count : 0;
    };
    add(instance.points, seen->points);
    add(instance.places, 1);
  }
  instance.is_leaving = instance.leaves();
}

}  // namespace dynains
