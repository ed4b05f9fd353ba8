#include "start_check.hpp"

#include <cmath>
#include <optional>
#include <utility>

#include "cloud_remarks.hpp"
#include "lone_scans.hpp"

namespace dynains::program {
namespace {

/// Whether poses that are shifted by some scans fit so little better that the map hardly suffers.
bool is_small_shift(const Diagnosis& d, const PoseConvention& given) {
  constexpr double kTranslation = 0.05;  // m, from one scan to the next
  constexpr double kRotation = 0.0045;   // rad
  return d.verdict == PoseVerdict::kOtherwise && d.convention.shift != given.shift &&
         d.translation_error < kTranslation && d.rotation_error < kRotation;
}

class Checker {
 public:
  Checker(const Recording& recording, const ScanRange& range, bool accepts_poses,
          const std::string& recording_as_given)
      : recording_(recording), range_(range), see_("dynains check " + recording_as_given) {
    constexpr std::size_t kFewestScans = 8;
    are_judged_ = !accepts_poses && range.size() >= kFewestScans;
    result_.agreement = pose_agreement(recording, range.first, range.last);
    if (are_judged_ && !confirms_poses(recording, range.first, range.last)) {
      diagnosis_ = diagnose(recording);
    }
  }

  void check_poses() {
    const std::string share =
        "only " + std::to_string(std::lround(100.0 * result_.agreement.as_given.share)) +
        " % of the points of neighbouring scans agree under these poses";
    const bool is_doubtful = result_.agreement.doubtful();
    if (diagnosis_) {
      if (diagnosis_->verdict == PoseVerdict::kInexact) warn(advice(*diagnosis_));
      if (diagnosis_->sound() || diagnosis_->verdict == PoseVerdict::kRayOrigin) return;
      if (is_only_doubtful()) {
        warn(advice(*diagnosis_));
      } else {
        result_.refusal = (is_doubtful ? share + ". " : std::string()) + advice(*diagnosis_);
        return;
      }
    }
    const bool is_confirmed = !diagnosis_ && are_judged_;
    if (is_doubtful && !is_confirmed) warn(share + "; see: " + see_);
  }

  /// Refuses clouds whose rays begin elsewhere than at their origin; warns if only shadows tell it.
  void check_ray_origin() {
    if (!are_judged_) return;
    const bool was_searched = diagnosis_ && (diagnosis_->sound() || diagnosis_->ray_origin);
    const auto origin = was_searched ? diagnosis_->ray_origin
                                     : find_ray_origin(recording_, range_.first, range_.last);
    if (!origin) return;
    if (origin->known == RayOrigin::Known::kHorizontal) {
      warn(advice(*origin) + " See: " + see_);
    } else {
      result_.refusal = advice(*origin);
    }
  }

  void warn_if(const std::optional<std::string>& remark) {
    if (remark) warn(*remark);
  }

  bool is_refused() const { return !result_.refusal.empty(); }
  StartCheck take() { return std::move(result_); }

 private:
  // Other times of points are told apart by a few per cent of the gap between scans.
  bool is_only_doubtful() const {
    return diagnosis_->verdict == PoseVerdict::kUnknown ||
           diagnosis_->verdict == PoseVerdict::kPointTimes ||
           is_small_shift(*diagnosis_, recording_.convention());
  }
  void warn(std::string text) { result_.warnings.push_back(std::move(text)); }

  const Recording& recording_;
  const ScanRange& range_;
  std::string see_;
  bool are_judged_ = false;
  std::optional<Diagnosis> diagnosis_;  // empty: the poses are proved, or not judged
  StartCheck result_;
};

}  // namespace

StartCheck check_start(const Recording& recording, const ScanRange& range,
                       const RemoverConfig& config, bool accepts_poses,
                       const std::string& recording_as_given) {
  Checker checker(recording, range, accepts_poses, recording_as_given);
  checker.check_poses();
  if (!checker.is_refused()) checker.check_ray_origin();
  if (checker.is_refused()) return checker.take();
  checker.warn_if(remark_on_lone_scans(recording, range.first, range.last, config));
  checker.warn_if(remark_on_stripes(recording));
  checker.warn_if(remark_on_copies(recording, range));
  if (config.level && config.mounting_pitch == 0.0 && config.mounting_roll == 0.0) {
    checker.warn_if(remark_on_tilted_scans(recording, range));
  }
  return checker.take();
}

}  // namespace dynains::program
