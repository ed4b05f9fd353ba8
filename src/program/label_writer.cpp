#include "label_writer.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "dynains/io/kitti.hpp"
#include "dynains/io/point_bytes.hpp"
#include "labelled_sequence.hpp"
#include "output_folder.hpp"

namespace dynains::program {
namespace {

std::uint32_t mos_class(PointLabel label) {
  switch (label) {
    case PointLabel::kDynamic:
      return kRunMoving;
    case PointLabel::kGround:
    case PointLabel::kStatic:
      return kRunStatic;
    case PointLabel::kInvalid:
    case PointLabel::kOutOfRange:
      return kRunNotJudged;
  }
  return kRunNotJudged;
}

}  // namespace

std::uint32_t mos_label(PointLabel label, std::uint32_t instance) {
  constexpr std::uint32_t kMostIds = 65535;
  const std::uint32_t id = instance == kNoInstance ? 0 : (instance - 1) % kMostIds + 1;
  return mos_class(label) | id << 16;
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
  labels_.resize(verdict.labels.size());
  for (std::size_t i = 0; i < labels_.size(); ++i) {
    labels_[i] = mos_label(verdict.labels[i], verdict.instances[i]);
  }
  if (!cause_folder_.empty()) {
    causes_.resize(verdict.causes.size());
    std::transform(verdict.causes.begin(), verdict.causes.end(), causes_.begin(),
                   [](Cause cause) { return static_cast<std::uint8_t>(cause); });
  }
  if (!belief_folder_.empty()) {
    beliefs_.resize(verdict.beliefs.size());
    std::transform(
        verdict.beliefs.begin(), verdict.beliefs.end(), beliefs_.begin(),
        [](float belief) { return static_cast<std::uint8_t>(std::lround(255.0F * belief)); });
  }
}

void LabelFiles::write(const std::string& name) const {
  write_labels(folder_ / (name + ".label"), labels_);
  if (!cause_folder_.empty()) write_point_bytes(cause_folder_ / (name + ".cause"), causes_);
  if (!belief_folder_.empty()) write_point_bytes(belief_folder_ / (name + ".belief"), beliefs_);
}

LabelWriter::LabelWriter(std::filesystem::path folder, std::filesystem::path causes,
                         std::filesystem::path beliefs)
    : files_(std::move(folder), std::move(causes), std::move(beliefs)) {
  files_.create_folders();
}

void LabelWriter::write(const std::string& name, const ScanVerdict& verdict) {
  finish();
  files_.take(verdict);
  pending_ = std::async(std::launch::async, [this, name] { files_.write(name); });
}

void LabelWriter::finish() {
  if (pending_.valid()) pending_.get();
}

}  // namespace dynains::program
