#include "label_writer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "dynains/io/kitti.hpp"
#include "dynains/io/point_bytes.hpp"
#include "dynains/simd/pack_loops.hpp"
#include "labelled_sequence.hpp"
#include "run/output/output_folder.hpp"

namespace dynains::run {
namespace {

using Id = std::uint16_t;  // of an instance in a file; ids beyond start again at 1

constexpr std::uint32_t mos_class(PointLabel label) {  // without branches, for vectors
  static_assert(kRunNotJudged == 0);
  return kRunMoving * std::uint32_t{label == PointLabel::kDynamic} +
         kRunStatic * std::uint32_t{is_static(label)};
}

/// Inverse of mos_class(). `point`: x y z.
PointLabel point_label(std::uint32_t mos, Cause cause, const float* point) {
  if (mos == kRunMoving) return PointLabel::kDynamic;
  if (mos == kRunStatic) return cause == Cause::kGround ? PointLabel::kGround : PointLabel::kStatic;
  const auto is_finite = [](float value) { return std::isfinite(value); };
  const bool is_measured = std::all_of(point, point + 3, is_finite) &&
                           std::any_of(point, point + 3, [](float v) { return v < 0 || v > 0; });
  return is_measured ? PointLabel::kOutOfRange : PointLabel::kInvalid;
}

/// mos_label() of all points of a scan.
void fill_mos_labels(const ScanVerdict& verdict, std::vector<std::uint32_t>& labels) {
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

}  // namespace

std::uint32_t mos_label(PointLabel label, std::uint32_t instance) {
  const std::uint32_t id =
      instance == kNoInstance ? 0 : (instance - 1) % std::numeric_limits<Id>::max() + 1;
  return mos_class(label) | id << 16U;
}

LabelFiles::LabelFiles(std::filesystem::path labels, std::filesystem::path causes,
                       std::filesystem::path beliefs)
    : folder_(std::move(labels)),
      cause_folder_(std::move(causes)),
      belief_folder_(std::move(beliefs)) {}

void LabelFiles::create_folders() const {
  for (const std::filesystem::path& folder : {folder_, cause_folder_, belief_folder_}) {
    if (!folder.empty()) create_folder(folder);
  }
}

void LabelFiles::take(const ScanVerdict& verdict) {
  fill_mos_labels(verdict, labels_);
  if (!cause_folder_.empty()) {
    causes_.resize(verdict.causes.size());
    std::transform(verdict.causes.begin(), verdict.causes.end(), causes_.begin(),
                   [](Cause cause) { return static_cast<std::uint8_t>(cause); });
  }
  take_beliefs(verdict.beliefs);
}

void LabelFiles::take_beliefs(Span<const float> beliefs) {
  if (belief_folder_.empty()) return;
  beliefs_.resize(beliefs.size());
  std::transform(beliefs.begin(), beliefs.end(), beliefs_.begin(), [](float belief) {
    return static_cast<std::uint8_t>(std::lround(255.0F * belief));
  });
}

void LabelFiles::write(const std::string& name) const {
  write_labels(folder_ / (name + ".label"), labels_);
  if (!cause_folder_.empty()) write_point_bytes(cause_folder_ / (name + ".cause"), causes_);
  if (!belief_folder_.empty()) write_point_bytes(belief_folder_ / (name + ".belief"), beliefs_);
}

void LabelFiles::read(const std::string& name, const RecordedScan& scan,
                      VerdictArrays& verdict) const {
  const std::size_t count = scan.size();
  const auto labels = read_run_labels(folder_ / (name + ".label"), count);
  auto causes = read_point_bytes(cause_folder_ / (name + ".cause"), count);
  causes.resize(count);  // without the file: unknown
  verdict.labels.resize(count);
  verdict.causes.resize(count);
  verdict.instances.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    verdict.causes[i] = static_cast<Cause>(causes[i]);
    verdict.instances[i] = labels[i] >> 16U;
    verdict.labels[i] = point_label(class_of(labels[i]), verdict.causes[i], &scan.xyzi[4 * i]);
  }
  verdict.beliefs.clear();
  if (belief_folder_.empty()) return;
  for (const std::uint8_t belief : read_point_bytes(belief_folder_ / (name + ".belief"), count)) {
    verdict.beliefs.push_back(static_cast<float>(belief) / 255.0F);
  }
}

}  // namespace dynains::run
