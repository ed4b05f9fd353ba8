#include "dynains/recording/second_pass.hpp"

#include <string>

#include "dynains/errors.hpp"

namespace dynains {
namespace {

void check_sizes(PointsView points, std::size_t labels, std::size_t causes, std::size_t instances) {
  if (labels == points.size() && causes == points.size() && instances == points.size()) return;
  throw UsageError("SecondPass: a verdict of " + std::to_string(labels) + " labels, " +
                   std::to_string(causes) + " causes and " + std::to_string(instances) +
                   " instances on " + std::to_string(points.size()) + " points");
}

}  // namespace

SecondPass::SecondPass(ByteStore& store, const SecondPassConfig& config)
    : config_((config.evidence.validate(), config)),
      store_(store),
      returns_(store, config.evidence) {}

void SecondPass::add(PointsView points, const ScanVerdict& verdict,
                     Span<const std::uint8_t> sensor_of) {
  if (verdict.scan != scans_.size() || is_decided_) {
    throw UsageError(
        "SecondPass::add: scan " + std::to_string(verdict.scan) +
        (is_decided_ ? " comes after test()" : ", expected scan " + std::to_string(scans_.size())));
  }
  check_sizes(points, verdict.labels.size(), verdict.causes.size(), verdict.instances.size());
  const std::uint32_t visit = returns_.add(points, verdict.labels, verdict.compared);
  if (visit == visits_.size()) visits_.push_back(std::make_unique<Visit>(store_, config_));
  if (visit != latest_) visits_[latest_]->rest();
  latest_ = visit;
  scans_.push_back({visit, visits_[visit]->scans()});
  visits_[visit]->add(points, verdict, sensor_of);
}

void SecondPass::test(const std::function<bool()>& keep_going) {
  for (std::unique_ptr<Visit>& visit : visits_) {
    if (visit->length() <= returns_.compared() || visit->is_suspicious()) {
      visit.reset();
    } else if (!visit->test(keep_going)) {
      return;
    } else {
      visit->rest();
      places_ += visit->place_count();
    }
  }
  is_decided_ = true;
}

bool SecondPass::revise(PointsView points, std::uint32_t number, VerdictArrays& verdict) {
  check_sizes(points, verdict.labels.size(), verdict.causes.size(), verdict.instances.size());
  if (!is_decided_) return false;
  const ScanOfVisit scan = scans_[number];
  if (scan.visit != latest_ && visits_[latest_] != nullptr) visits_[latest_]->rest();
  latest_ = scan.visit;
  Visit* const visit = visits_[scan.visit].get();
  if (visit == nullptr) return false;
  const RevisedPoints points_of_scan = visit->revise(points, scan.number, verdict);
  revised_.removed += points_of_scan.removed;
  revised_.restored += points_of_scan.restored;
  return points_of_scan.removed + points_of_scan.restored > 0;
}

}  // namespace dynains
