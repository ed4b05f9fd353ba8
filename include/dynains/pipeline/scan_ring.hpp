// Ring buffer of the scans without a final verdict, with the votes of windows on their points.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "dynains/clusters/cluster_set.hpp"
#include "dynains/config.hpp"
#include "dynains/errors.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/simd/short_numbers.hpp"
#include "dynains/verdict.hpp"

namespace dynains::detail {

/// Step of the decision by windows that determined the verdict on a cluster (Eq. 11-19), in order.
enum class DecisionStage : std::uint8_t {
  kNoCluster,    ///< the point belongs to no cluster
  kTooFewScans,  ///< the cluster has no points in the oldest or in the newest scan
  kSimilar,      ///< similarity not below tau_s (Eq. 12)
  kProposed,     ///< proposed as dynamic; belief and votes decide
};

/// Verdict of one window on a cluster, or the sum of the verdicts of all windows so far on a point.
struct WindowVerdict {
  float belief = 0.0F;     ///< proposed clusters: highest posterior of all windows
  std::uint8_t votes = 0;  ///< proposed clusters: number of windows with verdict dynamic
  DecisionStage stage = DecisionStage::kNoCluster;  ///< latest stage reached in any window

  void add(const WindowVerdict& other) {
    belief = std::max(belief, other.belief);
    votes = static_cast<std::uint8_t>(votes + other.votes);
    stage = std::max(stage, other.stage);
  }
  friend bool operator==(const WindowVerdict& a, const WindowVerdict& b) {
    return a.belief == b.belief && a.votes == b.votes && a.stage == b.stage;
  }
};

/// Calls `visit(begin, end, a, b)` for the parts into which two lists of runs cut the same points.
template <class Runs, class Others, class Visitor>
void for_each_common_run(const Runs& runs, const Others& others, Visitor&& visit) {
  std::uint32_t begin = 0;
  auto other = others.begin();
  for (const auto& run : runs) {
    while (begin < run.end) {
      const std::uint32_t end = std::min(run.end, other->end);
      visit(begin, end, run, *other);
      begin = end;
      if (other->end == end) ++other;
    }
  }
}

/// Accumulated verdicts of all windows so far on the non-ground points of one scan, in the order of
/// its split. Neighbours mostly share them.
struct WindowVotes {
  /// The points from the end of the run before on.
  struct Run {
    std::uint32_t end;
    WindowVerdict verdict;
  };
  std::vector<Run> runs;
  std::vector<ClusterSet::PointRun> point_runs;  ///< in the window that ends with the scan

  /// Begins with no votes, for a scan with these point runs.
  void begin(Span<const ClusterSet::PointRun> of_scan) {
    ensure_capacity(point_runs, of_scan.size());
    point_runs.assign(of_scan.begin(), of_scan.end());
    runs.clear();
    if (!of_scan.empty()) runs.push_back({point_runs.back().end, {}});
  }

  /// Adds the verdicts of one window, by cluster. `in_window`: point runs of the scan in that
  /// window. `merged`: working memory.
  void record(Span<const ClusterSet::PointRun> in_window, Span<const WindowVerdict> verdicts,
              std::vector<Run>& merged) {
    merged.clear();
    for_each_common_run(
        runs, in_window,
        [&](std::uint32_t, std::uint32_t end, const Run& run, const ClusterSet::PointRun& other) {
          WindowVerdict verdict = run.verdict;
          if (other.cluster != kNoCluster) verdict.add(verdicts[other.cluster]);
          if (!merged.empty() && merged.back().verdict == verdict) {
            merged.back().end = end;
          } else {
            merged.push_back({end, verdict});
          }
        });
    ensure_capacity(runs, merged.size());
    runs.assign(merged.begin(), merged.end());
  }
};

/// Verdict on a point: dynamic if it has at least `votes_needed` votes.
inline EvidenceVerdict::Group point_verdict(const WindowVerdict& windows, int votes_needed) {
  constexpr std::array<Cause, 4> kStatic = {Cause::kNotJudged, Cause::kTooFewScans, Cause::kSimilar,
                                            Cause::kReverted};
  const bool is_dynamic =
      windows.stage == DecisionStage::kProposed && windows.votes >= votes_needed;
  return {is_dynamic ? Cause::kProposed : kStatic[static_cast<std::size_t>(windows.stage)],
          windows.belief};
}

/// One scan and the evidence of the windows on it. Slots are reused.
struct ScanSlot {
  std::uint64_t scan = 0;  ///< number of the push, from 0
  double time = 0.0;       ///< s
  std::optional<EpochReason> began_epoch;
  Pose T_world_sensor = Pose::Identity();
  Pose T_world_level = Pose::Identity();     ///< frame of split.points, as pushed
  Pose T_world_compared = Pose::Identity();  ///< the same, by the motion stage
  ComparedPose compared;                     ///< T_world_compared, of the pushed cloud

  GroundSplit split;
  /// Indices in the input: of the points of the split, then of those with the label kOutOfRange,
  /// then of those with kInvalid.
  ShortNumbers input;
  std::size_t valid = 0;           ///< number of points without the label kInvalid
  std::vector<std::uint32_t> ids;  ///< by cluster of the window that ends with this scan
  WindowVotes windows;

  std::size_t non_ground_count() const { return split.count - split.ground_count; }
};

/// Ring of scans, numbered from 0. Scans become final in the order of their pushes.
class ScanRing {
 public:
  explicit ScanRing(std::size_t capacity) : slots_(capacity) {}

  std::size_t capacity() const { return slots_.size(); }
  std::uint64_t pushed() const { return pushed_; }
  /// Number of scans without a final verdict.
  std::uint64_t open() const { return pushed_ - finished_; }
  /// Default time of the next scan, s: 0.1 s after the previous scan.
  double next_time() const {
    const double after = std::nextafter(last_time_, std::numeric_limits<double>::infinity());
    return pushed_ == 0 ? 0.0 : std::max(last_time_ + 0.1, after);
  }

  ScanSlot& operator[](std::uint64_t scan) { return slots_[scan % slots_.size()]; }
  ScanSlot& newest() { return (*this)[pushed_ - 1]; }

  /// Initializes the slot of the next scan. A PushTransaction adds the scan to the ring. Throws
  /// PoseError for an invalid pose or a time (s) not greater than the previous one.
  /// `origin`: of the level frame, in that of the cloud, m.
  ScanSlot& prepare(const Pose& T_world_sensor, double time, const Eigen::Vector3d& origin,
                    const RemoverConfig& config) {
    validate_pose("T_world_sensor", T_world_sensor);
    validate_time(time);
    ScanSlot& next = (*this)[pushed_];
    next.scan = pushed_;
    next.time = time;
    next.compared.epoch = is_start_ ? 0 : newest().compared.epoch;
    next.began_epoch = reason_to_begin(T_world_sensor, time, config);
    if (next.began_epoch) begin_epoch(next, *next.began_epoch);
    next.T_world_sensor = orthonormalized(T_world_sensor);
    next.T_world_level = next.T_world_sensor;
    next.T_world_level.translation() = next.T_world_sensor * origin;
    return next;
  }

  /// Marks the oldest open scan as final and returns its slot. A scan must be open.
  ScanSlot& finish_oldest() { return (*this)[finished_++]; }

  /// Begins an epoch with a scan that is prepared or the newest one.
  void begin_epoch(ScanSlot& scan, EpochReason reason) {
    scan.compared.epoch = ++epoch_;
    scan.began_epoch = reason;
  }

  /// The next scan begins an epoch.
  void start_epoch() { is_start_ = true; }

  void clear() {
    pushed_ = 0;
    finished_ = 0;
    start_epoch();
  }

 private:
  friend class PushTransaction;

  std::optional<EpochReason> reason_to_begin(const Pose& T_world_sensor, double time,
                                             const RemoverConfig& config) {
    if (is_start_) return EpochReason::kStart;
    const double pause = time - last_time_;
    if (!config.starts_epoch(pause, distance(T_world_sensor, newest().T_world_sensor))) return {};
    return pause > config.max_gap ? EpochReason::kPause : EpochReason::kJump;
  }

  void validate_time(double time) const {
    if (std::isfinite(time) && (pushed_ == 0 || time > last_time_)) return;
    throw PoseError("time = " + std::to_string(time) + " s must be finite and greater than " +
                    (pushed_ > 0 ? std::to_string(last_time_) : std::string("-inf")) +
                    ", the time of the scan before");
  }

  std::vector<ScanSlot> slots_;
  std::uint64_t pushed_ = 0;
  std::uint64_t finished_ = 0;
  std::uint64_t epoch_ = 0;  // number of the begun epochs
  bool is_start_ = true;     // of an epoch: the next scan
  double last_time_ = 0.0;   // s, of the newest scan
};

/// Adds a prepared scan to the ring. Without commit(), the destructor removes it again and begins
/// an epoch with the next scan, because stages may hold data of the removed one.
class PushTransaction {
 public:
  PushTransaction(ScanRing& ring, const ScanSlot& prepared)
      : ring_(ring), time_before_(ring.last_time_) {
    ++ring_.pushed_;
    ring_.is_start_ = false;
    ring_.last_time_ = prepared.time;
  }
  PushTransaction(const PushTransaction&) = delete;
  PushTransaction& operator=(const PushTransaction&) = delete;
  ~PushTransaction() {
    if (committed_) return;
    --ring_.pushed_;
    ring_.start_epoch();
    ring_.last_time_ = time_before_;
  }
  void commit() { committed_ = true; }

 private:
  ScanRing& ring_;
  double time_before_;
  bool committed_ = false;
};

}  // namespace dynains::detail
