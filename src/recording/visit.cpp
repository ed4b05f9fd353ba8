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
    : config_(config), store_(store), places_(store, config.memory) {
  for (std::size_t i = 0; i < config.sensors.size(); ++i) {
    references_.emplace_back(/*max_step=*/5, config.evidence.lateral_margin);
  }
}

void Visit::add(PointsView points, const ScanVerdict& verdict, Span<const std::uint8_t> sensor_of) {
  const ComparedPose& compared = verdict.compared;
  const std::uint32_t number = scans();
  if (number == 0) {
    first_ = static_cast<std::uint32_t>(verdict.scan);
    // The ground of the first scan determines which way is up, because worlds may be tilted.
    T_level_world_.linear() = estimate_mounting(points).R_level_sensor();
    T_level_world_ = orthonormalized(T_level_world_ * compared.T_world_sensor.inverse());
  }
  const Pose T = orthonormalized(T_level_world_ * compared.T_world_sensor);
  is_suspicious_ = is_suspicious_ || compared.suspicion != Suspicion::kNone;
  scans_.push_back({T, epochs_.next(T.translation(), verdict.time)});
  last_ = static_cast<std::uint32_t>(verdict.scan);
  if (is_suspicious_) return;  // first verdicts stay
  places_.add(points, verdict.labels, verdict.causes, T, scans_.back().epoch);
  const std::vector<Pose>& sensors = config_.sensors;
  if (sensors.size() == 1 && sensors.front().matrix().isIdentity(0.0)) {
    keep_reference(0, points, verdict.labels);
    return;
  }
  for (std::size_t sensor = 0; sensor < sensors.size(); ++sensor) {
    select_own(sensor, points, verdict.labels, sensor_of);
    keep_reference(sensor, own_, own_labels_);
  }
}

void Visit::select_own(std::size_t sensor, PointsView points, Span<const PointLabel> labels,
                       Span<const std::uint8_t> sensor_of) {
  const Eigen::Isometry3f T_sensor_cloud(config_.sensors[sensor].inverse().cast<float>().matrix());
  own_.clear();
  own_labels_.clear();
  for (std::size_t i = 0; i < points.size(); ++i) {
    if ((sensor_of.empty() ? 0U : sensor_of[i]) != sensor) continue;
    const Eigen::Vector3f p =
        T_sensor_cloud * Eigen::Vector3f(points.x[i], points.y[i], points.z[i]);
    own_.push_back(p.x(), p.y(), p.z());
    own_labels_.push_back(labels[i]);
  }
}

// Keeps the newest scan, as one sensor has measured it, if it is a reference.
void Visit::keep_reference(std::size_t sensor, PointsView points, Span<const PointLabel> labels) {
  const std::uint32_t number = scans() - 1;
  const RecordingReference* const reference = references_[sensor].add(
      points, labels, scans_.back().T_level_sensor * config_.sensors[sensor], number);
  if (reference == nullptr) return;
  packed_.clear();
  pack_image(reference->image, packed_);
  kept_.push_back({number, sensor, store_.append(packed_), packed_.size()});
}

void Visit::rest() { places_.rest(); }

bool Visit::test(const std::function<bool()>& keep_going) {
  detail::Visibility visibility;
  RecordingReference reference;
  for (const Reference& kept : kept_) {
    if (!keep_going()) return false;
    store_.read(kept.offset, kept.size, packed_);
    reference.T_world_beams = scans_[kept.scan].T_level_sensor * config_.sensors[kept.sensor];
    if (!unpack_image(references_[kept.sensor].grid(), packed_, reference.image)) {
      throw IoError("a reference of the second pass was damaged in its store");
    }
    places_.test(
        scans_[kept.scan].epoch, reference.T_world_beams.translation(),
        [&](const auto& points, std::size_t count, const auto& origin) -> const auto& {
          return test_visibility(reference, config_.evidence, points, count, origin, visibility);
        });
  }
  places_.decide();
  return true;
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
      verdict.labels[i] = PointLabel::kDynamic;
      verdict.causes[i] = Cause::kCameOrWent;
      if (!verdict.beliefs.empty()) verdict.beliefs[i] = std::max(verdict.beliefs[i], kBelief);
      ++revised.removed;
    }
  };
  for_each_in_cells(points, T_level_sensor, revise_point);
  return revised;
}

// Whether a point that was kept, in a place that has changed, is of the object there. Ground is, if
// it rises above the mean.
bool Visit::belongs_to_object(PointLabel label, const Eigen::Vector3d& point) {
  // 10 cm are more than 0.1 deg moves ground 50 m away.
  return label != PointLabel::kGround || places_.rise(point).value_or(0.0) >= 0.10;
}

// Restores a removed point if it stands, or if it does not rise above the ground of all scans and
// no observation of its place is free. Ground that left with the instance above it stays removed:
// it holds wheels and undersides.
bool Visit::restore(std::size_t i, bool stands, const Eigen::Vector3d& point,
                    VerdictArrays& verdict) {
  const Cause cause = verdict.causes[i];
  if (cause == Cause::kUnderInstance) return false;
  const auto is_ground = [&] {
    const std::optional<double> rise = places_.rise(point);
    return rise && *rise <= 0.02 && places_.is_level(point);  // m
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

}  // namespace dynains
