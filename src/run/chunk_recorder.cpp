#include "chunk_recorder.hpp"

#include <algorithm>
#include <utility>

#include "moving_points.hpp"

namespace dynains::program {
namespace {

/// An instance moves up to the end of a chunk if it is dynamic in so many scans: fewer could be an
/// error of few scans, and an instance that moved lately is seen by the next chunk, too.
constexpr std::size_t kSteadyScans = 30;

/// Neighbouring points often have the same id.
std::set<std::uint32_t> set_of(Span<const std::uint32_t> ids) {
  std::set<std::uint32_t> set;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (i == 0 || ids[i] != ids[i - 1]) set.insert(ids[i]);
  }
  return set;
}

}  // namespace

void InstancePoints::count(Span<const PointLabel> labels, Span<const std::uint32_t> instances) {
  for (const std::uint32_t id : ids_) all_[id] = dynamic_[id] = 0;
  ids_.clear();
  for (std::size_t i = 0; i < instances.size(); ++i) {
    const std::uint32_t id = instances[i];
    if (id == kNoInstance) continue;
    if (id >= all_.size()) {
      all_.resize(std::size_t{id} + 1, 0);
      dynamic_.resize(std::size_t{id} + 1, 0);
    }
    if (all_[id]++ == 0) ids_.push_back(id);
    dynamic_[id] += labels[i] == PointLabel::kDynamic ? 1U : 0U;
  }
}

ChunkRecorder::ChunkRecorder(const Chunk& chunk, std::optional<std::size_t> shared_before,
                             std::optional<std::size_t> shared_behind,
                             const std::vector<Eigen::Vector3d>& path, const ChunkOutputs& outputs,
                             ChunkFileWriter& writer)
    : chunk_(chunk),
      shared_before_(shared_before),
      shared_behind_(shared_behind),
      outputs_(outputs),
      writer_(writer),
      overview_(path),
      map_(outputs.map),
      moving_(outputs.moving) {}

void ChunkRecorder::take_newest(std::size_t i, TimingRow row, const ScanVerdict& verdict) {
  const Span<const std::uint32_t> ids = verdict.instances;
  if (i == shared_before_) {
    summary_.instances.shared_before.assign(ids.begin(), ids.end());
    ids_before_ = set_of(ids);
  }
  if (i == shared_behind_) summary_.instances.shared_behind.assign(ids.begin(), ids.end());
  if (!is_own(i)) return;
  summary_.timing.rows.push_back(std::move(row));
  if (outputs_.with_online) {
    open_online_.emplace_back(verdict.labels.begin(), verdict.labels.end());
  }
}

void ChunkRecorder::take_shared(std::vector<std::uint32_t> before,
                                std::vector<std::uint32_t> behind) {
  ids_before_ = set_of(before);
  summary_.instances.shared_before = std::move(before);
  summary_.instances.shared_behind = std::move(behind);
}

void ChunkRecorder::take_final(std::size_t i, const RecordedScan& scan,
                               const ScanVerdict& verdict) {
  record_.take(verdict, outputs_.with_beliefs);
  record_.online.clear();
  if (outputs_.with_online) {
    record_.online = std::move(open_online_.front());
    open_online_.pop_front();
  }
  add_moving_points(scan, verdict);
  writer_.add(record_);

  summary_.points += verdict.labels.size();
  summary_.labels.add(verdict.labels);
  count_instances(i, verdict);
  overview_.add(scan, verdict);
  if (outputs_.with_map) add_to_map(scan, verdict);
  ++finished_;
}

void ChunkRecorder::count_instances(std::size_t i, const ScanVerdict& verdict) {
  const bool is_one_of_last = chunk_.own.last - i < kSteadyScans;
  points_.count(verdict.labels, verdict.instances);
  points_.for_each([&](std::uint32_t id, bool is_dynamic) {
    summary_.instances.last = std::max(summary_.instances.last, id);
    if (is_dynamic && is_one_of_last) ++moving_scans_[id];
    if (!is_dynamic && ids_before_.count(id) > 0) still_before_.insert(id);
  });
}

void ChunkRecorder::add_moving_points(const RecordedScan& scan, const ScanVerdict& verdict) {
  moving_.clear();
  for_each_moving_point(
      scan, verdict, [&](std::size_t i) { return verdict.instances[i]; },
      [&](const FilePoint& point) { moving_.add(point); });
  record_.moving.assign(moving_.bytes().begin(), moving_.bytes().end());
}

void ChunkRecorder::add_to_map(const RecordedScan& scan, const ScanVerdict& verdict) {
  kept_.grow(verdict.labels.size());
  std::size_t count = 0;
  for (std::size_t i = 0; i < verdict.labels.size(); ++i) {
    const float* const p = scan.xyzi.data() + 4 * i;
    kept_.x[count] = p[0];
    kept_.y[count] = p[1];
    kept_.z[count] = p[2];
    count += is_static(verdict.labels[i]) ? 1U : 0U;
  }
  map_.insert(PointsView(kept_).subview(0, count), {}, verdict.T_world_sensor);
}

void ChunkRecorder::finish() {
  summary_.overview = overview_.places();
  summary_.instances.still_before.assign(still_before_.begin(), still_before_.end());
  const std::size_t steady = std::min(kSteadyScans, chunk_.own.size());
  for (const auto& [id, scans] : moving_scans_) {
    if (scans == steady) summary_.instances.moving_behind.push_back(id);
  }
  writer_.finish(summary_, map_);
}

}  // namespace dynains::program
