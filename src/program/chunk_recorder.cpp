#include "chunk_recorder.hpp"

#include <algorithm>
#include <utility>

namespace dynains::program {

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
      map_(outputs.map) {}

void ChunkRecorder::take_newest(std::size_t i, TimingRow row, RecordedScan scan,
                                const ScanVerdict& verdict) {
  const Span<const std::uint32_t> ids = verdict.instances;
  if (i == shared_before_) summary_.instances.shared_before.assign(ids.begin(), ids.end());
  if (i == shared_behind_) summary_.instances.shared_behind.assign(ids.begin(), ids.end());
  if (!is_own(i)) {
    spare_.push_back(std::move(scan));
    return;
  }
  summary_.timing.rows.push_back(std::move(row));
  open_scans_.push_back(std::move(scan));
  if (outputs_.with_online) {
    open_online_.emplace_back(verdict.labels.begin(), verdict.labels.end());
  }
}

void ChunkRecorder::take_final(std::size_t i, const ScanVerdict& verdict) {
  if (!is_own(i)) return;
  RecordedScan scan = std::move(open_scans_.front());
  open_scans_.pop_front();
  record_.take(verdict, outputs_.with_beliefs);
  record_.online.clear();
  if (outputs_.with_online) {
    record_.online = std::move(open_online_.front());
    open_online_.pop_front();
  }
  add_moving_points(scan, verdict);
  writer_.add(record_);

  summary_.points += verdict.labels.size();
  for (const PointLabel label : verdict.labels) ++summary_.labels[static_cast<std::size_t>(label)];
  std::uint32_t& last = summary_.instances.last;
  for (const std::uint32_t id : verdict.instances) last = std::max(last, id);
  overview_.add(scan, verdict);
  if (outputs_.with_map) add_to_map(scan, verdict);
  spare_.push_back(std::move(scan));
  ++finished_;
}

void ChunkRecorder::add_moving_points(const RecordedScan& scan, const ScanVerdict& verdict) {
  record_.moving.clear();
  for (std::size_t i = 0; i < verdict.labels.size(); ++i) {
    if (verdict.labels[i] != PointLabel::kDynamic) continue;
    const FilePoint point = scan.point(i);
    const Eigen::Vector3d position = verdict.T_world_sensor * point.position;
    MovingPoint moving;
    moving.position = {position.x(), position.y(), position.z()};
    moving.time = point.time;
    moving.intensity = point.intensity;
    moving.instance = verdict.instances[i];
    moving.ring = point.ring;
    record_.moving.push_back(moving);
  }
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

RecordedScan ChunkRecorder::recycle() {
  if (spare_.empty()) return {};
  RecordedScan scan = std::move(spare_.back());
  spare_.pop_back();
  return scan;
}

void ChunkRecorder::finish() {
  summary_.overview = overview_.places();
  writer_.finish(summary_, map_);
}

}  // namespace dynains::program
