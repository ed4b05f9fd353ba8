#include "second_pass.hpp"

#include <algorithm>

#include "dynains/errors.hpp"
#include "points_of.hpp"

namespace dynains::program {
namespace {

constexpr float kChangedRatio = 0.25F;      // of the known points of an instance that leaves
constexpr float kLowChangedRatio = 0.2F;    // of those in its lower half: panes are higher
constexpr float kLargeChangedRatio = 0.5F;  // of a larger instance
constexpr float kCompactLength = 18.0F, kCompactHeight = 4.5F;  // m
constexpr float kBelief = 0.95F;         // of points that the second pass removes
constexpr float kRestoredBelief = 0.5F;  // of objects that it brings back

}  // namespace

bool SecondPass::Instance::leaves() const {
  const Eigen::Vector3f size = highest - lowest;
  const bool is_compact =
      std::max(size.x(), size.y()) <= kCompactLength && size.z() <= kCompactHeight;
  const float ratio = is_compact ? kChangedRatio : kLargeChangedRatio;
  return points.leave(ratio) || places.leave(ratio);
}

void SecondPass::Share::add(bool has_changed, bool is_low) {
  ++known;
  changed += has_changed ? 1 : 0;
  low_known += is_low ? 1 : 0;
  low_changed += has_changed && is_low ? 1 : 0;
}

bool SecondPass::Share::leave(float ratio) const {
  const auto has = [](std::uint32_t part, float of, std::uint32_t all) {
    return static_cast<float>(part) >= of * static_cast<float>(all);
  };
  return changed > 0 && has(changed, ratio, known) && has(low_changed, kLowChangedRatio, low_known);
}

SecondPass::SecondPass(const std::filesystem::path& folder)
    : places_(RecordingPlacesConfig()),
      references_(SessionReferencesConfig{1.0, 5}),
      file_(folder) {}

void SecondPass::add(const RecordedScan& scan, const ScanVerdict& verdict) {
  copy_points(scan, points_);
  places_.add(points_, verdict.labels, verdict.causes, verdict.T_world_sensor, verdict.time,
              static_cast<std::uint32_t>(verdict.scan));
  ground_.add(points_, verdict.labels, verdict.T_world_sensor);
  const auto number = static_cast<std::uint32_t>(verdict.scan);
  const SessionReference* const reference =
      references_.add(points_, verdict.labels, verdict.T_world_sensor, number);
  if (reference == nullptr) return;
  packed_.resize(most_packed_bytes(reference->image.grid()));
  const auto size =
      static_cast<std::size_t>(pack_image(reference->image, packed_.data()) - packed_.data());
  const std::uint64_t offset = file_.append({packed_.data(), size});
  kept_.push_back({number, verdict.time, verdict.T_world_sensor, offset, size});
}

void SecondPass::test(const std::function<bool()>& keep_going) {
  ReferenceTest test_visibility{FreeSpaceConfig()};
  SessionReference reference;
  for (const Reference& kept : kept_) {
    if (!keep_going()) return;
    file_.read(kept.offset, kept.size, packed_);
    reference.scan = kept.scan;
    reference.T_world_beams = kept.T_world_sensor;
    if (!unpack_image(references_.grid(), packed_, reference.image)) {
      throw IoError("a reference of the second pass was damaged on the disk");
    }
    const Eigen::Vector3d sensor = kept.T_world_sensor.translation();
    places_.test(kept.scan, kept.time, sensor,
                 [&](const PointBuffer& points, std::size_t count) -> const detail::Visibility& {
                   return test_visibility(reference, points, count,
                                          Pose(Eigen::Translation3d(sensor)));
                 });
  }
  places_.decide();
  list_objects();
  is_decided_ = true;
}

void SecondPass::list_objects() {
  objects_.assign(places_.object_count(), {});
  places_.for_each([&](const Eigen::Vector3d& middle, const Place& place) {
    if (place.state != PlaceState::kChanged) return;
    Object& object = objects_[place.object - 1];
    const Eigen::Vector3d half = Eigen::Vector3d::Constant(0.5 * RecordingPlaces::kPlace);
    object.lowest = object.lowest.cwiseMin(middle - half);
    object.highest = object.highest.cwiseMax(middle + half);
    if (!place.was_passed()) return;
    const auto [first, last] = places_.free_scans(place);
    object.first_passed = std::min(object.first_passed, first);
    object.last_passed = std::max(object.last_passed, last);
  });
}

bool SecondPass::revise(const RecordedScan& scan, std::uint32_t number, const Pose& T_world_sensor,
                        VerdictArrays& verdict) {
  copy_points(scan, points_);
  place_of_.assign(points_.size(), nullptr);
  is_restored_.assign(points_.size(), 0);
  if (!is_decided_) return false;
  const std::uint64_t before = restored_ + removed_;
  bool has_changed = false;
  places_.for_each_place(points_, verdict.labels, T_world_sensor,
                         [&](std::size_t i, const Place* place) {
                           if (place == nullptr) return;
                           if (verdict.labels[i] == PointLabel::kDynamic) {
                             if (place->stands()) restore(i, verdict);
                           } else if (place->state != PlaceState::kUnknown) {
                             place_of_[i] = place;
                             has_changed = has_changed || place->state == PlaceState::kChanged;
                           }
                         });
  restored_ += ground_.restore(points_, T_world_sensor, verdict);
  if (has_changed) remove_objects(number, T_world_sensor, verdict);
  return restored_ + removed_ > before;
}

void SecondPass::restore(std::size_t point, VerdictArrays& verdict) {
  if (verdict.causes[point] == Cause::kUnderInstance) return;
  verdict.labels[point] = PointLabel::kStatic;
  verdict.causes[point] = Cause::kReverted;
  if (!verdict.beliefs.empty()) verdict.beliefs[point] = kRestoredBelief;
  is_restored_[point] = 1;
  ++restored_;
}

void SecondPass::remove_objects(std::uint32_t number, const Pose& T_world_sensor,
                                VerdictArrays& verdict) {
  find_instances(T_world_sensor, verdict);
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (verdict.labels[i] != PointLabel::kStatic || is_restored_[i] != 0) continue;
    const std::uint32_t id = verdict.instances[i];
    const bool is_free = place_of_[i] != nullptr && place_of_[i]->state == PlaceState::kChanged;
    const bool leaves = id != kNoInstance && id < instances_.size() && instances_[id].leaves();
    if (!is_free && !leaves) continue;
    verdict.labels[i] = PointLabel::kDynamic;
    verdict.causes[i] = is_free ? Cause::kFreeSpace : Cause::kWithInstance;
    if (!verdict.beliefs.empty()) verdict.beliefs[i] = std::max(verdict.beliefs[i], kBelief);
    ++removed_;
    if (!is_free) continue;
    Object& object = objects_[place_of_[i]->object - 1];
    if (object.points++ == 0) object.first_measured = number;
    object.last_measured = number;
  }
}

void SecondPass::find_instances(const Pose& T_world_sensor, const VerdictArrays& verdict) {
  instances_.clear();
  world_.resize(points_.size());
  const auto for_each_object_point = [&](auto&& visit) {
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const std::uint32_t id = verdict.instances[i];
      if (verdict.labels[i] == PointLabel::kStatic && id != kNoInstance) visit(i, id);
    }
  };
  for_each_object_point([&](std::size_t i, std::uint32_t id) {
    if (id >= instances_.size()) instances_.resize(id + 1);
    const Eigen::Vector3d point(static_cast<double>(points_.x[i]),
                                static_cast<double>(points_.y[i]),
                                static_cast<double>(points_.z[i]));
    // Single precision is enough for sizes, if positions are relative to the sensor.
    world_[i] = (T_world_sensor.linear() * point).cast<float>();
    Instance& instance = instances_[id];
    instance.lowest = instance.lowest.cwiseMin(world_[i]);
    instance.highest = instance.highest.cwiseMax(world_[i]);
  });
  seen_.clear();
  for_each_object_point([&](std::size_t i, std::uint32_t id) {
    if (place_of_[i] == nullptr) return;
    Instance& instance = instances_[id];
    const bool is_low = world_[i].z() <= 0.5F * (instance.lowest.z() + instance.highest.z());
    instance.points.add(place_of_[i]->state == PlaceState::kChanged, is_low);
    seen_.push_back({id, place_of_[i], is_low});
  });
  // A place is low if any of its points is.
  std::sort(seen_.begin(), seen_.end());
  for (std::size_t i = 0; i < seen_.size(); ++i) {
    const auto [id, place, is_low] = seen_[i];
    const bool goes_on = i + 1 < seen_.size() && std::get<0>(seen_[i + 1]) == id &&
                         std::get<1>(seen_[i + 1]) == place;
    if (!goes_on) instances_[id].places.add(place->state == PlaceState::kChanged, is_low);
  }
}

}  // namespace dynains::program
