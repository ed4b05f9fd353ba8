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

// Scans that the first pass compares with each other.
std::uint32_t compared_scans(const SecondPassConfig& config) {
  const int others = config.evidence.lookback_scans + config.evidence.lookahead_scans;
  return static_cast<std::uint32_t>(others) + 1;
}

}  // namespace

SecondPass::SecondPass(ByteStore& store, const SecondPassConfig& config)
    : config_((config.validate(), config)),
      store_(store),
      returns_(store, compared_scans(config)) {}

void SecondPass::add(PointsView points, const ScanVerdict& verdict, const ComparedPose& compared) {
  if (verdict.scan != scans_ || is_decided_) {
    throw UsageError(
        "SecondPass::add: scan " + std::to_string(verdict.scan) +
        (is_decided_ ? " comes after test()" : ", expected scan " + std::to_string(scans_)));
  }
  check_sizes(points, verdict.labels.size(), verdict.causes.size(), verdict.instances.size());
  const std::optional<ReturnToPlace> place = returns_.add(
      points, verdict.labels, compared.T_world_sensor, parts_.empty() ? 0 : parts_.back().first);
  if (place) places_.push_back(*place);
  if (parts_.empty() || compared.begins_epoch || (place && !fits(*place))) {
    end_visit();
    parts_.push_back({scans_, std::make_unique<Visit>(store_, config_)});
  }
  parts_.back().visit->add(points, verdict, compared.T_world_sensor);
  ++scans_;
}

// Whether the scans of the open visit fit where it comes back to one of its places.
bool SecondPass::fits(const ReturnToPlace& place) {
  constexpr double kLeastInliers = 0.6;
  constexpr double kMostMovement = 0.1;   // m, less than the margin of the evidence
  constexpr double kMostDeviation = 0.1;  // m
  return place.inliers >= kLeastInliers && place.movement <= kMostMovement &&
         place.deviation <= kMostDeviation;
}

void SecondPass::end_visit() {
  if (parts_.empty()) return;
  std::unique_ptr<Visit>& visit = parts_.back().visit;
  if (visit->scans() <= compared_scans(config_)) {
    visit.reset();
  } else {
    visit->rest();
  }
}

void SecondPass::test(const std::function<bool()>& keep_going) {
  end_visit();
  for (const Part& part : parts_) {
    if (part.visit == nullptr) continue;
    if (!part.visit->test(keep_going)) return;
    part.visit->rest();
  }
  is_decided_ = true;
}

bool SecondPass::revise(PointsView points, std::uint32_t number, VerdictArrays& verdict) {
  check_sizes(points, verdict.labels.size(), verdict.causes.size(), verdict.instances.size());
  if (!is_decided_) return false;
  if (number < parts_[revised_].first) revised_ = 0;
  while (revised_ + 1 < parts_.size() && parts_[revised_ + 1].first <= number) {
    if (parts_[revised_].visit != nullptr) parts_[revised_].visit->rest();
    ++revised_;
  }
  const Part& part = parts_[revised_];
  return part.visit != nullptr && part.visit->revise(points, number - part.first, verdict);
}

std::size_t SecondPass::place_count() const {
  std::size_t count = 0;
  for (const Part& part : parts_) count += part.visit == nullptr ? 0 : part.visit->place_count();
  return count;
}

std::vector<SecondPass::Object> SecondPass::objects() const {
  std::vector<Object> objects;
  for (const Part& part : parts_) {
    if (part.visit == nullptr) continue;
    for (Object object : part.visit->objects()) {
      for (std::uint32_t* scan : {&object.first_measured, &object.last_measured,
                                  &object.first_passed, &object.last_passed}) {
        *scan += part.first;
      }
      objects.push_back(object);
    }
  }
  return objects;
}

std::uint64_t SecondPass::removed() const {
  std::uint64_t points = 0;
  for (const Part& part : parts_) points += part.visit == nullptr ? 0 : part.visit->removed();
  return points;
}

std::uint64_t SecondPass::restored() const {
  std::uint64_t points = 0;
  for (const Part& part : parts_) points += part.visit == nullptr ? 0 : part.visit->restored();
  return points;
}

}  // namespace dynains
