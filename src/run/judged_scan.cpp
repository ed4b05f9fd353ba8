#include "judged_scan.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "dynains/simd/pack_loops.hpp"

namespace dynains::run {
namespace {

using Id = std::uint16_t;  // of an instance in a file; ids beyond start again at 1

/// Inverse of mos_class(). `point`: x y z.
PointLabel point_label(std::uint32_t mos, Cause cause, const float* point) {
  if (mos == kRunMoving) return PointLabel::kDynamic;
  if (mos == kRunStatic) return cause == Cause::kGround ? PointLabel::kGround : PointLabel::kStatic;
  const auto is_finite = [](float value) { return std::isfinite(value); };
  const bool is_measured = std::all_of(point, point + 3, is_finite) &&
                           std::any_of(point, point + 3, [](float v) { return v < 0 || v > 0; });
  return is_measured ? PointLabel::kOutOfRange : PointLabel::kInvalid;
}

}  // namespace

std::uint32_t mos_label(PointLabel label, std::uint32_t instance) {
  const std::uint32_t id =
      instance == kNoInstance ? 0 : (instance - 1) % std::numeric_limits<Id>::max() + 1;
  return mos_class(label) | id << 16U;
}

void PackedVerdict::pack_labels(const ScanVerdict& verdict) {
  const std::size_t count = verdict.labels.size();
  labels.resize(count);
  std::uint32_t all_ids = 0;
  detail::with_packs([&all_ids, count, from = verdict.labels.data(),
                      instance = verdict.instances.data(), to = labels.data()](auto) {
    std::uint32_t ids = 0;
    for (std::size_t i = 0; i < count; ++i) {
      ids |= instance[i];
      to[i] = mos_class(from[i]) | instance[i] << 16U;
    }
    all_ids = ids;
  });
  if (all_ids <= std::numeric_limits<Id>::max()) return;
  for (std::size_t i = 0; i < count; ++i) {
    labels[i] = mos_label(verdict.labels[i], verdict.instances[i]);
  }
}

void PackedVerdict::pack(const ScanVerdict& verdict, bool with_beliefs) {
  pack_labels(verdict);
  causes.resize(verdict.causes.size());
  std::transform(verdict.causes.begin(), verdict.causes.end(), causes.begin(),
                 [](Cause cause) { return static_cast<std::uint8_t>(cause); });
  if (!with_beliefs) return;
  beliefs.resize(verdict.beliefs.size());
  std::transform(verdict.beliefs.begin(), verdict.beliefs.end(), beliefs.begin(), [](float belief) {
    return static_cast<std::uint8_t>(std::lround(255.0F * belief));
  });
}

void PackedVerdict::unpack(const RecordedScan& scan, VerdictArrays& verdict) const {
  const std::size_t count = labels.size();
  verdict.labels.resize(count);
  verdict.causes.resize(count);
  verdict.instances.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    verdict.causes[i] = causes.empty() ? Cause::kUnknown : static_cast<Cause>(causes[i]);
    verdict.instances[i] = instance_of(labels[i]);
    verdict.labels[i] = point_label(class_of(labels[i]), verdict.causes[i], &scan.xyzi[4 * i]);
  }
  verdict.beliefs.clear();
  for (const std::uint8_t belief : beliefs) {
    verdict.beliefs.push_back(static_cast<float>(belief) / 255.0F);
  }
}

}  // namespace dynains::run
