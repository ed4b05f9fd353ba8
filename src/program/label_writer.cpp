#include "label_writer.hpp"

#include <utility>

#include "dynains/io/kitti.hpp"
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

LabelWriter::LabelWriter(std::filesystem::path folder) : folder_(std::move(folder)) {
  create_folder(folder_);
}

void LabelWriter::write(const std::string& name, const ScanVerdict& verdict) {
  finish();
  labels_.resize(verdict.labels.size());
  for (std::size_t i = 0; i < labels_.size(); ++i) {
    labels_[i] = mos_label(verdict.labels[i], verdict.instances[i]);
  }
  pending_ = std::async(std::launch::async, [this, path = folder_ / (name + ".label")] {
    write_labels(path, labels_);
  });
}

void LabelWriter::finish() {
  if (pending_.valid()) pending_.get();
}

}  // namespace dynains::program
