// Which decision a configuration asks for.
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>

#include "dynains/cause.hpp"
#include "dynains/config.hpp"
#include "dynains/pipeline/free_space_decision.hpp"
#include "dynains/pipeline/scan_decision.hpp"
#include "dynains/pipeline/window_decision.hpp"

namespace dynains::detail {

/// Dynamic if either verdict is, the first one's cause before the second one's; the higher belief.
inline PointVerdict stronger(const PointVerdict& first, const PointVerdict& second) {
  const bool takes_second = !is_dynamic(first.cause) && is_dynamic(second.cause);
  return {takes_second ? second.cause : first.cause, std::max(first.belief, second.belief)};
}

/// Adds what windows proposed so far to the verdict by free space that was written last.
inline void add_proposals(ScanSlot& scan, const EvidenceVerdict& by_free_space, int votes_needed,
                          VerdictWriter& writer) {
  const VerdictWriter::Points points = writer.points(scan);
  const std::size_t first = scan.split.ground_count;
  for (std::size_t i = 0; i < scan.non_ground_count(); ++i) {
    if (scan.windows.stage[i] != DecisionStage::kProposed) continue;
    const PointVerdict& group = by_free_space.groups[by_free_space.group_of[i]];
    points.write(first + i, stronger(group, point_verdict(scan.windows, i, votes_needed)));
  }
}

/// Free space decides on all points; windows add what they propose. Clusters, and with them ids,
/// are those of the windows.
template <class Stages>
class BothDecisions final : public ScanDecision<typename Stages::Map> {
 public:
  explicit BothDecisions(const PipelineConfig<Stages>& config)
      : window_(config), free_space_(config) {
    free_space_.keep(latency());
  }

  std::size_t window_length() const override { return window_.window_length(); }
  std::size_t latency() const override {
    return std::max(window_.latency(), free_space_.latency());
  }
  bool needs_sensor() const override { return free_space_.needs_sensor(); }
  void adapt(const SensorModel& sensor) override { free_space_.adapt(sensor); }
  void reserve(std::size_t scans) override { free_space_.reserve(scans); }
  void clear() override {
    window_.clear();
    free_space_.clear();
  }

  void observe(ScanRing& scans, const ScanWindow& window, StageTimer& timer) override {
    window_.observe(scans, window, timer);
    timer.measure(&StageTimes::evidence,
                  [&] { free_space_.observe_instances(scans.newest(), window); });
  }
  void judge_newest(ScanSlot& newest, VerdictWriter& writer, StageTimer& timer) override {
    const EvidenceVerdict by_free_space = free_space_.write_newest(newest, writer, timer);
    timer.measure(&StageTimes::verdict, [&] { add_proposals(newest, by_free_space, 1, writer); });
  }
  void judge_final(ScanSlot& scan, VerdictWriter& writer, StageTimer& timer) override {
    const EvidenceVerdict by_free_space = free_space_.write_final(scan, writer, timer);
    timer.measure(&StageTimes::verdict,
                  [&] { add_proposals(scan, by_free_space, window_.votes_needed(), writer); });
  }
  void revise(typename Stages::Map& map, const ScanSlot& newest) override {
    free_space_.revise(map, newest);
  }

 private:
  WindowDecision<Stages> window_;
  FreeSpaceDecision<Stages> free_space_;
};

/// The decision that `config.decision` names.
template <class Stages>
std::unique_ptr<ScanDecision<typename Stages::Map>> make_decision(
    const PipelineConfig<Stages>& config) {
  switch (config.decision) {
    case Decision::kWindow:
      return std::make_unique<WindowDecision<Stages>>(config);
    case Decision::kBoth:
      return std::make_unique<BothDecisions<Stages>>(config);
    case Decision::kFreeSpace:
      break;
  }
  return std::make_unique<FreeSpaceDecision<Stages>>(config);
}

}  // namespace dynains::detail
