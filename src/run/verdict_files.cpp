#include "verdict_files.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "dynains/errors.hpp"
#include "dynains/io/kitti.hpp"
#include "dynains/simd/pack_loops.hpp"
#include "io/folder.hpp"
#include "io/points/finite_points.hpp"

namespace dynains::run {

namespace fs = std::filesystem;

namespace {

using Id = std::uint16_t;  // of an instance in a file; ids beyond start again at 1

/// Inverse of mos_class(). `point`: x y z.
PointLabel point_label(std::uint32_t mos, Cause cause, const float* point) {
  if (mos == kRunMoving) return PointLabel::kDynamic;
  if (mos == kRunStatic) return cause == Cause::kGround ? PointLabel::kGround : PointLabel::kStatic;
  return is_measured(point) ? PointLabel::kOutOfRange : PointLabel::kInvalid;
}

constexpr const char* kLabels = "labels";

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

void VerdictFiles::create_folders() const {
  create_folder(folder());
  if (kind_ == kLabels) create_folder(run_ / "causes");
  if (has_beliefs_) create_folder(run_ / "beliefs");
}

void VerdictFiles::write(const std::string& name, const PackedVerdict& verdict) const {
  write_labels(file(name), verdict.labels);
  if (kind_ == kLabels) write_point_bytes(run_ / "causes" / (name + ".cause"), verdict.causes);
  if (has_beliefs_) write_point_bytes(run_ / "beliefs" / (name + ".belief"), verdict.beliefs);
}

std::vector<std::uint32_t> VerdictFiles::labels(const std::string& name, std::size_t count) const {
  std::vector<std::uint32_t> labels = read_labels(file(name), count);
  for (std::size_t p = 0; p < count; ++p) {
    const std::uint32_t id = class_of(labels[p]);
    if (id == kRunStatic || id == kRunMoving || id == kRunNotJudged) continue;
    throw IoError(file(name).string() + ": point " + std::to_string(p) + " has class " +
                  std::to_string(id) + "; expected 9 (static), 251 (moving) or 0 (not judged)");
  }
  return labels;
}

PackedVerdict VerdictFiles::read(const std::string& name, std::size_t count) const {
  PackedVerdict verdict{labels(name, count), {}, {}};
  if (kind_ == kLabels) {
    verdict.causes = read_point_bytes(run_ / "causes" / (name + ".cause"), count);
  }
  if (has_beliefs_) {
    verdict.beliefs = read_point_bytes(run_ / "beliefs" / (name + ".belief"), count);
  }
  return verdict;
}

}  // namespace dynains::run
