// The stage that finds the pose by which a scan is compared with earlier scans.
#pragma once

#include <cstdint>
#include <optional>

#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/verdict.hpp"

namespace dynains::detail {

/// Registers each scan with the static surfaces of earlier scans of its epoch.
class MotionStage {
 public:
  virtual ~MotionStage() = default;

  /// Forgets all scans and the motion. `T_world_level`: pose of the first scan of the next epoch.
  virtual void begin_epoch(const Pose& T_world_level) = 0;

  /// Pose of a scan for comparisons with other scans. `T_world_level`, `split`: pushed pose and
  /// points, m. `time`: s, if known. Updates residual() and misfit(). After a misfit the scan is
  /// the first one of an epoch, and its pose stays.
  virtual Pose correct(const Pose& T_world_level, const GroundSplit& split,
                       const std::optional<double>& time) = 0;

  /// The pose `T_world_frame` with the correction of the last correct().
  virtual Pose corrected(const Pose& T_world_frame) const = 0;

  /// Adds the static points of a scan to the surfaces. `T_world_level`: result of correct().
  /// `moving`: by non-ground point, 0 for a point that does not move; empty if no point does.
  virtual void insert(const Pose& T_world_level, const GroundSplit& split,
                      Span<const std::uint8_t> moving) = 0;

  /// Result of the last correct(), in the frame of its pose; empty without enough common surfaces.
  virtual const std::optional<PoseResidual>& residual() const = 0;

  /// Why the static surfaces of the last scan do not fit to the scans before, so that motion cannot
  /// be distinguished from errors of poses; empty if they fit.
  virtual const std::optional<EpochReason>& misfit() const = 0;
};

}  // namespace dynains::detail
