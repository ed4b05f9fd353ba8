#include "start_check.hpp"

#include <optional>

#include "cloud_remarks.hpp"
#include "lone_scans.hpp"
#include "pose_advice.hpp"

namespace dynains::program {
namespace {

/// Judges the poses as `dynains check` does.
void check_poses(const Recording& recording, bool accepts_poses, StartCheck& result) {
  const Diagnosis d = diagnose(recording);
  result.agreement = d.as_given;
  if (d.verdict == PoseVerdict::kAgree || d.verdict == PoseVerdict::kNoMotion) return;
  const std::string text = advice(recording, d);
  const bool may_run = accepts_poses || d.sound() || d.verdict == PoseVerdict::kUnknown;
  if (may_run) {
    result.warnings.push_back(text);
  } else {
    result.refusal = text;
  }
}

}  // namespace

StartCheck check_start(const Recording& recording, const ScanRange& range,
                       const RemoverConfig& config, bool accepts_poses) {
  constexpr std::size_t kFewestScans = 8;
  StartCheck result;
  const bool has_given_poses = !recording.options().without_poses;
  if (has_given_poses && range.size() >= kFewestScans)
    check_poses(recording, accepts_poses, result);
  if (!result.refusal.empty()) return result;
  const auto warn_if = [&](const std::optional<std::string>& remark) {
    if (remark) result.warnings.push_back(*remark);
  };
  warn_if(remark_on_lone_scans(recording, range.first, range.last, config));
  warn_if(remark_on_stripes(recording));
  warn_if(remark_on_copies(recording, range));
  if (config.level && config.mounting_pitch == 0.0 && config.mounting_roll == 0.0) {
    warn_if(remark_on_tilted_scans(recording, range));
  }
  return result;
}

}  // namespace dynains::program
