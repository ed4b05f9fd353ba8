// Pipeline of Section II of the paper: turns scans and poses into verdicts and a static map.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "dynains/clusters/cluster_set.hpp"
#include "dynains/config.hpp"
#include "dynains/errors.hpp"
#include "dynains/ground/ground_segmenter.hpp"
#include "dynains/pipeline/decisions.hpp"
#include "dynains/pipeline/ingest.hpp"
#include "dynains/pipeline/interfaces.hpp"
#include "dynains/pipeline/object_tracks.hpp"
#include "dynains/pipeline/plausibility_check.hpp"
#include "dynains/pipeline/scan_ring.hpp"
#include "dynains/pipeline/verdict_writer.hpp"
#include "dynains/point_cloud_traits.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/registration/motion_stage.hpp"
#include "dynains/sensor/mounting.hpp"
#include "dynains/sensor/sensor_model.hpp"
#include "dynains/threads/background.hpp"
#include "dynains/verdict.hpp"

namespace dynains::detail {

/// Runs `work` and adds its time to `milliseconds`.
template <class Work>
void timed(double& milliseconds, Work&& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - begin;
  milliseconds += time.count();
}

/// Owns the stages and every buffer.
template <class Stages>
class Pipeline final : public RemoverPipeline<Stages>, private NewestVerdictMaker {
  static_assert(check_stages<Stages>());

 public:
  using Config = PipelineConfig<Stages>;
  using Ground = typename Stages::Ground;
  using Clusterer = typename Stages::Clusterer;
  using Descriptor = typename Stages::Descriptor;
  using Belief = typename Stages::Belief;
  using Map = typename Stages::Map;

  explicit Pipeline(const Config& config)
      : config_(validated(config)),
        build_map_(config.build_map),
        other_(config.threads > 1 ? std::make_unique<Background>() : nullptr),
        frame_(config.level, config.mounting_pitch, config.mounting_roll, config.sensors),
        region_{static_cast<float>(config.min_range), static_cast<float>(config.max_range),
                frame_.origin().template cast<float>(), frame_.positions()},
        ground_(config.ground),
        clusterer_(config.clusterer),
        motion_(make_motion(config, config.evidence)),
        decision_(make_decision<Stages>(config, other_.get())),
        finishes_later_(other_ && decision_->latency() > 0),
        newest_objects_(make_objects(config, latency() > 0, nullptr)),
        final_objects_(make_objects(config, true, newest_objects_.get())),
        map_(config.map),
        // At least two: ids are propagated from the previous scan.
        scans_(std::max({decision_->window_length(), latency() + 1, std::size_t{2}})) {}
  // Not copyable: window_ refers to memory of clusterer_.
  Pipeline(const Pipeline&) = delete;
  Pipeline& operator=(const Pipeline&) = delete;

  const Config& config() const override { return config_; }
  const Map& map() const override { return map_; }
  std::size_t latency() const override { return decision_->latency() + (finishes_later_ ? 1 : 0); }
  const SensorModel& sensor() const override { return frame_.sensor(); }

  FrameResult push(const CloudView& cloud, const Pose& T_world_sensor,
                   std::optional<double> time) override {
    StageTimes times;
    ScanSlot& newest =
        scans_.prepare(T_world_sensor, time.value_or(scans_.next_time()), frame_.origin(), config_);
    timed(times.ingest, [&] { ingest(cloud, newest); });
    PushTransaction transaction(scans_, newest);
    unwritten_ = nullptr;
    if (is_sensor_wanted()) {
      if (finishes_later_) finish_due(times);  // before the stages are adapted
      timed(times.ingest, [&] { find_sensor(newest); });
    }
    const auto cluster = [&] {
      newest.split.input = std::move(split_input_);
      newest.split.sensor_of_input = ingest_.sensors();
      timed(times.ground,
            [&] { ground_.segment(ingest_.points(), ingest_.input(), newest.split); });
      timed(times.window, [&] { window_.gather(scans_, decision_->window_length()); });  // Eq. 3
      timed(times.cluster, [&] { window_.cluster(clusterer_); });                        // Eq. 4
    };
    if (finishes_later_) {
      run_both(other_.get(), cluster, [&] { finish_due(times); });
    } else {
      cluster();
    }
    timed(times.motion, [&] { align(newest); });
    timed(times.evidence, [&] {  // Eq. 4-18
      const Span<const std::uint32_t> predecessors = decision_->observe(scans_, window_);
      Span<const std::uint32_t> ids_before;
      if (newest.scan > 0) ids_before = scans_[newest.scan - 1].ids;
      instance_ids_.propagate(predecessors, ids_before, newest.ids);
    });
    timed(times.judge, [&] {
      decision_->judge(newest, false);  // Eq. 19
      if (const auto movers = decision_->may_move()) make_reference(newest, *movers);
    });
    timed(times.verdict, [&] {
      split_input_ = std::move(newest.split.input);
      newest.split.sensor_of_input = {};
      split_input_.resize(ingest_.points().size());
      for (const auto* list : {&ingest_.out_of_range(), &ingest_.invalid()}) {
        newest.valid = split_input_.size();
        split_input_.insert(split_input_.end(), list->begin(), list->end());
      }
      newest.input.assign(split_input_);
    });
    transaction.commit();
    const std::optional<PoseResidual> residual = pose_residual();
    const Plausibility shares = plausibility(newest, residual);
    newest.compared.suspicion = shares.suspicion;
    unwritten_ = &newest;
    if (newest_objects_) timed(times.verdict, [&] { make_newest(); });  // every scan, in order
    if (!finishes_later_) finish_due(times);
    const std::optional<ScanVerdict> finished = take_finished();
    if (finished && finished->scan == newest.scan) {
      newest_ = *finished;
      unwritten_ = nullptr;
    }
    return {{*this, newest.scan}, finished,           times, residual,
            time_doubt(),         newest.began_epoch, shares};
  }

  std::optional<ScanVerdict> finish_oldest() override {
    if (is_finished_known()) return take_finished();
    if (scans_.open() == 0) return std::nullopt;
    StageTimes times;
    return finish_oldest(times);
  }

  void start_epoch() override { scans_.start_epoch(); }

  void reserve_like(const CloudView& example, std::size_t scans) override {
    if (scans_.pushed() > 0) throw UsageError("memory is reserved before the first push");
    // Scans of the warm-up are not inserted into the map, which may be on disk.
    struct WarmUp {
      Pipeline& pipeline;
      ~WarmUp() {
        pipeline.build_map_ = pipeline.config_.build_map;
        pipeline.forget_scans();
      }
    };
    const WarmUp warm_up{*this};
    build_map_ = false;
    for (std::size_t i = 0; i < std::min(scans, scans_.capacity() + 1); ++i) {
      push(example, Pose::Identity(), std::nullopt);
      make_newest();
    }
  }

  void reset() override {
    map_.clear();
    forget_scans();
  }

 private:
  static const Config& validated(const Config& config) {
    config.validate();
    return config;
  }

  std::unique_ptr<ObjectTracks> make_objects(const Config& config, bool is_used,
                                             ObjectTracks* later) const {
    if (!config.objects || !is_used) return nullptr;
    return std::make_unique<ObjectTracks>(config.evidence.track_length,
                                          config.evidence.track_height, latency() + 1, later);
  }

  // Filters the input points. If the sensor is known, the valid points are rotated into the level
  // frame.
  void ingest(const CloudView& cloud, ScanSlot& next) {
    if (frame_.rotates_scans()) {
      const Eigen::Matrix3d R_level_sensor = level(next);
      ingest_.read(cloud, region_, &R_level_sensor);
    } else {
      ingest_.read(cloud, region_, nullptr);
    }
  }

  bool is_sensor_wanted() const {
    if (!frame_.is_new(ingest_.counts())) return false;
    return decision_->needs_sensor() || config_.level || needs_sensor(ground_) ||
           needs_sensor(clusterer_);
  }

  // Estimates the models of the sensors from the newest scan and adapts the stages to them. Stages
  // use SensorModel::typical() until a scan has enough points.
  void find_sensor(ScanSlot& newest) {
    const bool is_turned = frame_.rotates_scans();
    frame_.estimate(ingest_.points(), ingest_.valid_sensors(), newest.split.points, other_.get());
    if (sensor().known() && newest.scan > 0) scans_.begin_epoch(newest, EpochReason::kSensor);
    const SensorModel typical = SensorModel::typical();
    const SensorModel& model = sensor().known() ? sensor() : typical;
    try {
      adapt_stage(ground_, model);
      adapt_stage(clusterer_, model);
      decision_->adapt(model,
                       sensor().known() ? frame_.sensors() : Span<const SensorModel>(&typical, 1));
    } catch (...) {
      frame_.forget();  // the next scan adapts all stages
      throw;
    }
    if (frame_.rotates_scans() && !is_turned) ingest_.turn(level(newest));
  }

  // Levels the pose of the scan. Returns the rotation for its points.
  Eigen::Matrix3d level(ScanSlot& scan) const {
    const Eigen::Matrix3d R_level_sensor = sensor().R_level_sensor();
    scan.T_world_level = rotated(scan.T_world_level, R_level_sensor);
    return R_level_sensor;
  }

  // The pose by which the newest scan is compared. Begins an epoch if it does not fit earlier ones.
  void align(ScanSlot& newest) {
    newest.T_world_compared = newest.T_world_level;
    newest.compared.T_world_sensor = newest.T_world_sensor;
    if (motion_ == nullptr) return;
    if (newest.began_epoch) motion_->begin_epoch(newest.T_world_level);
    newest.T_world_compared = motion_->correct(newest.T_world_level, newest.split, newest.time);
    newest.compared.T_world_sensor = motion_->corrected(newest.T_world_sensor);
    if (motion_->misfit()) scans_.begin_epoch(newest, *motion_->misfit());
  }

  // The newest scan is a reference for the evidence and, without what may move, for the motion.
  void make_reference(const ScanSlot& newest, Span<const std::uint8_t> movers) {
    run_both(
        other_.get(), [&] { decision_->make_reference(newest); },
        [&] {
          if (motion_) motion_->insert(newest.T_world_compared, newest.split, movers);
        });
  }

  const ScanVerdict& newest_verdict(std::uint64_t scan) override {
    const ReentrancyGuard::Guard guard(this->guard());
    if (scan + 1 != scans_.pushed()) {
      throw UsageError("FrameResult::newest() must be called before the next call of the remover");
    }
    make_newest();
    return newest_;
  }

  void make_newest() {
    if (unwritten_ == nullptr) return;
    newest_ = write(*unwritten_, decision_->verdict(*unwritten_, false), newest_writer_,
                    newest_objects_.get());
    unwritten_ = nullptr;
  }

  static ScanVerdict write(const ScanSlot& scan, const EvidenceVerdict& evidence,
                           VerdictWriter& writer, ObjectTracks* objects) {
    ScanVerdict verdict = writer.write(scan, evidence);  // Eq. 2
    if (objects != nullptr) verdict.objects = objects->observe(scan, evidence);
    return verdict;
  }

  // The scan becomes final even if the map throws, because the ring reuses its slot.
  ScanVerdict finish_oldest(StageTimes& times) {
    const ScanSlot& scan = scans_.finish_oldest();
    timed(times.judge, [&] { decision_->judge(scan, true); });
    ScanVerdict verdict;
    timed(times.verdict, [&] {
      const EvidenceVerdict evidence = decision_->verdict(scan, true);
      verdict = write(scan, evidence, final_writer_, final_objects_.get());
      if (build_map_) final_writer_.write_flags(scan, evidence);
    });
    if (build_map_) {
      timed(times.map,
            [&] { map_.insert(scan.split.all(), final_writer_.is_kept(), scan.T_world_level); });
    }
    return verdict;
  }

  // Finishes the oldest scan if its verdict is due and no other one waits for take_finished().
  void finish_due(StageTimes& times) {
    if (scans_.open() <= latency() || is_finished_known()) return;
    try {
      finished_ = finish_oldest(times);
    } catch (...) {
      finishing_error_ = std::current_exception();
    }
  }

  bool is_finished_known() const { return finished_ || finishing_error_; }
  std::optional<ScanVerdict> take_finished() {
    if (finishing_error_) std::rethrow_exception(std::exchange(finishing_error_, nullptr));
    return std::exchange(finished_, std::nullopt);
  }

  // The residual of the newest scan, with its motion in the frame of the pushed cloud.
  std::optional<PoseResidual> pose_residual() {
    std::optional<PoseResidual> residual;
    if (motion_) residual = motion_->residual();
    if (residual) {
      residual->previous_scan = scans_.newest().scan - 1;
      residual->previous_time = scans_[residual->previous_scan].time;
    }
    const Eigen::Vector3d& origin = frame_.origin();
    if (residual && (frame_.rotates_scans() || !origin.isZero(0.0))) {
      Pose T_cloud_level = Pose::Identity();
      T_cloud_level.linear() = sensor().R_level_sensor().transpose();
      T_cloud_level.translation() = origin;
      const Pose T_level_sensor = inverted(T_cloud_level);
      for (auto* T : {&residual->T_previous_newest, &residual->T_previous_aligned}) {
        *T = composed(composed(T_cloud_level, *T), T_level_sensor);
      }
      residual->covariance = transported_covariance(residual->covariance, T_cloud_level);
    }
    return residual;
  }

  // After a push: the doubt about the times of the last scans.
  TimeDoubt time_doubt() {
    const ScanSlot& newest = scans_.newest();
    if (newest.scan == 0) return TimeDoubt::kNone;
    return rate_.add(newest.time - scans_[newest.scan - 1].time, config_.max_gap);
  }

  // Adds the newest scan to the running window.
  Plausibility plausibility(const ScanSlot& newest, const std::optional<PoseResidual>& residual) {
    PlausibilityCheck::Scan scan;
    scan.scan = newest.scan;
    scan.points = newest.input.size();
    scan.judged = newest.split.count;
    scan.surfaces = decision_->surfaces();
    if (residual) scan.residual = residual->translation;
    scan.is_misfit =
        newest.began_epoch == EpochReason::kJump || newest.began_epoch == EpochReason::kMisfit;
    return plausibility_.add(scan);
  }

  // Removes all scans. The map and the capacity of buffers stay.
  void forget_scans() {
    instance_ids_.clear();
    frame_.forget();
    for (ObjectTracks* const objects : {newest_objects_.get(), final_objects_.get()}) {
      if (objects != nullptr) objects->clear();
    }
    unwritten_ = nullptr;
    scans_.clear();
    rate_ = {};
    plausibility_ = {};
    finished_.reset();
    finishing_error_ = nullptr;
  }

  Config config_;
  bool build_map_;
  std::unique_ptr<Background> other_;  // null: one thread
  LevelFrame frame_;
  JudgedRegion region_;
  Ingest ingest_;
  Ground ground_;
  ScanWindow window_;
  Clusterer clusterer_;
  std::unique_ptr<MotionStage> motion_;  // null: scans are compared by their pushed poses
  std::unique_ptr<ScanDecision> decision_;
  InstanceIds instance_ids_;
  bool finishes_later_;  // the next push finishes a scan, beside its first stages
  VerdictWriter newest_writer_;
  VerdictWriter final_writer_;
  std::unique_ptr<ObjectTracks> newest_objects_, final_objects_;  // null: not asked for
  ScanVerdict newest_;                                            // of the last push
  const ScanSlot* unwritten_ = nullptr;                           // its scan, until newest_ is made
  Map map_;
  ScanRing scans_;
  std::vector<std::uint32_t> split_input_;  // memory of GroundSplit::input, for one scan at a time
  ScanRate rate_;
  PlausibilityCheck plausibility_;
  // Outcome of finish_due() for push() or finish_oldest().
  std::optional<ScanVerdict> finished_;
  std::exception_ptr finishing_error_;
};

}  // namespace dynains::detail
