#include "dynains/recording/visit.hpp"

#include <algorithm>
#include <optional>

#include "dynains/errors.hpp"
#include "dynains/sensor/mounting.hpp"

namespace dynains {
namespace {

constexpr float kBelief = 0.95F;  // of points that the second pass removes

}  // namespace

Visit::Visit(ByteStore& store, const SecondPassConfig& config)
    : config_(config),
      store_(store),
      places_(store, config.memory),
      references_(/*most_scans=*/5, config.evidence.lateral_margin) {}

// Axes of the places: which way is up is told by the ground of the first scan, not by the world.
void Visit::find_up(PointsView points, const Pose& T_world_sensor) {
  T_level_world_.linear() = estimate_mounting(points).R_level_sensor();
  T_level_world_ = orthonormalized(T_level_world_ * T_world_sensor.inverse());
}

void Visit::add(PointsView points, const ScanVerdict& verdict, const ComparedPose& compared) {
  const std::uint32_t number = scans();
  if (number == 0) {
    first_ = static_cast<std::uint32_t>(verdict.scan);
    find_up(points, compared.T_world_sensor);
  }
  const Pose T = orthonormalized(T_level_world_ * compared.T_world_sensor);
  is_suspicious_ = is_suspicious_ || compared.is_suspicious;
  scans_.push_back({T, epochs_.next(T.translation(), verdict.time)});
  last_ = static_cast<std::uint32_t>(verdict.scan);
  if (is_suspicious_) return;  // first verdicts stay
  places_.add(points, verdict.labels, verdict.causes, T, scans_.back().epoch);
  const RecordingReference* const reference = references_.add(points, verdict.labels, T, number);
  if (reference == nullptr) return;
  packed_.clear();
  pack_image(reference->image, packed_);
  kept_.push_back({number, store_.append(packed_), packed_.size()});
}

void Visit::rest() { places_.rest(); }

bool Visit::test(const std::function<bool()>& keep_going) {
  detail::Visibility visibility;
  RecordingReference reference;
  for (const Reference& kept : kept_) {
    if (!keep_going()) return false;
    read(kept, reference);
    places_.test(
        scans_[kept.scan].epoch, reference.T_world_beams.translation(),
        [&](const PointBuffer& points, std::size_t count,
            const Eigen::Vector3d& origin) -> const auto& {
          return test_visibility(reference, config_.evidence, points, count, origin, visibility);
        });
  }
  places_.decide();
  return true;
}

void Visit::read(const Reference& kept, RecordingReference& reference) {
  store_.read(kept.offset, kept.size, packed_);
  reference.scan = kept.scan;
  reference.T_world_beams = scans_[kept.scan].T_level_sensor;
  if (!unpack_image(references_.grid(), packed_, reference.image)) {
    throw IoError("a reference of the second pass was damaged in its store");
  }
}

RevisedPoints Visit::revise(PointsView points, std::uint32_t number, VerdictArrays& verdict) {
  const auto& [T_level_sensor, epoch] = scans_[number];
  places_.free_far(T_level_sensor.translation());
  RevisedPoints revised;
  const ChangedPlace* place = nullptr;
  VoxelKey cell_of_place = 0;
  const auto revise_point = [&, &T = T_level_sensor, epoch = epoch](std::size_t i, auto&& cell_of,
                                                                    unsigned) {
    const PointLabel label = verdict.labels[i];
    const bool is_removed = label == PointLabel::kDynamic;
    if (!is_removed && !is_static(label)) return;
    const VoxelKey cell = cell_of();
    if (cell != cell_of_place) place = places_.changed(cell);
    cell_of_place = cell;
    if (!is_removed && place == nullptr) return;
    const Eigen::Vector3d point = world_point(points, i, T);
    const bool stands = place != nullptr && config_.static_policy == StaticPolicy::kLast &&
                        place->stands_since(epoch);
    if (is_removed) {
      revised.restored += restore(i, stands, point, verdict) ? 1 : 0;
    } else if (!stands && belongs_to_object(label, point)) {
      remove(i, verdict);
      ++revised.removed;
    }
  };
  for_each_in_cells(points, T_level_sensor, revise_point);
  if (revised.removed > 0) revised.removed += remove_instances(points, scans_[number], verdict);
  return revised;
}

// Whether a point that was kept, in a place that has changed, is of the object there. Ground is, if
// it rises above the mean.
bool Visit::belongs_to_object(PointLabel label, const Eigen::Vector3d& point) {
  constexpr double kRise = 0.10;  // m, more than 0.1 deg moves ground 50 m away
  return label != PointLabel::kGround || places_.rise(point).value_or(0.0) >= kRise;
}

// Restores a removed point if it stands, or if it does not rise above the ground of all scans and
// no look passed it. Ground that left with the instance above it stays removed: it holds wheels and
// undersides.
bool Visit::restore(std::size_t i, bool stands, const Eigen::Vector3d& point,
                    VerdictArrays& verdict) {
  constexpr double kMostRise = 0.02;  // m
  const Cause cause = verdict.causes[i];
  if (cause == Cause::kUnderInstance) return false;
  const auto is_ground = [&] {
    const std::optional<double> rise = places_.rise(point);
    return rise && *rise <= kMostRise && places_.is_level(point);
  };
  if (stands) {
    verdict.labels[i] = PointLabel::kStatic;
    verdict.causes[i] = Cause::kStands;
  } else if (cause != Cause::kFreeSpace && is_ground()) {
    verdict.labels[i] = PointLabel::kGround;
    verdict.causes[i] = Cause::kGround;
    verdict.instances[i] = kNoInstance;
  } else {
    return false;
  }
  if (!verdict.beliefs.empty()) verdict.beliefs[i] = 0.0F;
  return true;
}

// Removes the rest of the instances of a scan of which at least half of the points have left. What
// the first pass kept while looks passed the others is another object. Returns the number of
// points.
std::uint64_t Visit::remove_instances(PointsView points, const Scan& scan, VerdictArrays& verdict) {
  const auto cell_of = [&](std::size_t i) {
    return cell_at(world_point(points, i, scan.T_level_sensor));
  };
  std::uint64_t removed = 0;
  leaving_.assign(1 + *std::max_element(verdict.instances.begin(), verdict.instances.end()), {});
  for (std::size_t i = 0; i < verdict.labels.size(); ++i) {
    const bool has_left = verdict.causes[i] == Cause::kCameOrWent;
    const bool stays = verdict.labels[i] == PointLabel::kStatic;
    Leaving& instance = leaving_[verdict.instances[i]];
    instance.majority += (has_left ? 1 : 0) - (stays ? 1 : 0);
    const ChangedPlace* const place = has_left ? places_.changed(cell_of(i)) : nullptr;
    if (place == nullptr) continue;
    instance.first = std::min(instance.first, place->passed_first);
    instance.last = std::max(instance.last, place->passed_last);
  }
  for (std::size_t i = 0; i < verdict.labels.size(); ++i) {
    const bool may_leave = verdict.labels[i] == PointLabel::kStatic &&
                           verdict.causes[i] != Cause::kStands &&
                           verdict.instances[i] != kNoInstance;
    const Leaving& instance = leaving_[verdict.instances[i]];
    if (!may_leave || instance.majority < 0) continue;
    if (places_.any_kept(cell_of(i), instance.first, instance.last)) continue;
    remove(i, verdict);
    ++removed;
  }
  return removed;
}

void Visit::remove(std::size_t point, VerdictArrays& verdict) {
  verdict.labels[point] = PointLabel::kDynamic;
  verdict.causes[point] = Cause::kCameOrWent;
  if (!verdict.beliefs.empty()) {
    verdict.beliefs[point] = std::max(verdict.beliefs[point], kBelief);
  }
}

}  // namespace dynains
