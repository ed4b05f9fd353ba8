// Decision by free space, one of the implementations of Config::decision, and its motion stage.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "dynains/evidence/free_space_evidence.hpp"
#include "dynains/pipeline/decisions.hpp"
#include "dynains/pipeline/scan_ring.hpp"
#include "dynains/points.hpp"
#include "dynains/registration/motion_stage.hpp"
#include "dynains/registration/pose_correction.hpp"
#include "dynains/sensor/sensor_model.hpp"
#include "dynains/threads/background.hpp"
#include "dynains/verdict.hpp"

namespace dynains::detail {

/// Decision by free space. Each scan is clustered alone.
class FreeSpaceDecision final : public ScanDecision {
 public:
  FreeSpaceDecision(const FreeSpaceConfig& config, Background* other) : evidence_(config) {
    evidence_.share_work(other);
  }

  std::size_t window_length() const override { return 1; }
  std::size_t latency() const override { return evidence_.lookahead_scans(); }
  bool needs_sensor() const override { return true; }
  void adapt(const SensorModel& all, Span<const SensorModel> sensors) override {
    evidence_.adapt(all, sensors);
  }

  Span<const std::uint32_t> observe(ScanRing& scans, const ScanWindow& window) override {
    const ScanSlot& newest = scans.newest();
    evidence_.observe(newest.scan, newest.compared.epoch, newest.T_world_compared, newest.split,
                      window.newest_cluster_of(), window.cluster_count());
    return evidence_.predecessors();
  }

  void judge(const ScanSlot& scan, bool is_final) override { evidence_.judge(scan.scan, is_final); }
  std::optional<Span<const std::uint8_t>> may_move() override {
    if (!evidence_.is_reference()) return std::nullopt;
    return evidence_.may_move();
  }
  void make_reference(const ScanSlot& newest) override { evidence_.make_reference(newest.split); }
  EvidenceVerdict verdict(const ScanSlot& scan, bool is_final) override {
    return evidence_.verdict(is_final, scan.split);
  }

  SurfaceCounts surfaces() const override { return evidence_.surfaces(); }

 private:
  FreeSpaceEvidence evidence_;
};

template <class Config>
std::unique_ptr<ScanDecision> make_free_space_decision(const Config& config, Background* other) {
  return std::make_unique<FreeSpaceDecision>(config, other);
}

template <class Config>
std::unique_ptr<MotionStage> make_pose_correction(const Config& config) {
  return std::make_unique<PoseCorrection>(config.pose_tolerance);
}

}  // namespace dynains::detail
