#include "label_writer.hpp"

#include <utility>

#include "dynains/io/atomic_file.hpp"
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

void write_causes(const std::filesystem::path& path, const std::vector<Cause>& causes) {
  AtomicFile file(path);
  file.stream().write(reinterpret_cast<const char*>(causes.data()),
                      static_cast<std::streamsize>(causes.size()));
  file.commit(AtomicFile::Sync::kLater);
}

}  // namespace

std::uint32_t mos_label(PointLabel label, std::uint32_t instance) {
  constexpr std::uint32_t kMostIds = 65535;
  const std::uint32_t id = instance == kNoInstance ? 0 : (instance - 1) % kMostIds + 1;
  return mos_class(label) | id << 16;
}

LabelWriter::LabelWriter(std::filesystem::path folder, std::filesystem::path causes)
    : folder_(std::move(folder)), cause_folder_(std::move(causes)) {
  create_folder(folder_);
  if (!cause_folder_.empty()) create_folder(cause_folder_);
}

void LabelWriter::write(const std::string& name, const ScanVerdict& verdict) {
  finish();
  labels_.resize(verdict.labels.size());
  for (std::size_t i = 0; i < labels_.size(); ++i) {
    labels_[i] = mos_label(verdict.labels[i], verdict.instances[i]);
  }
  if (!cause_folder_.empty()) causes_.assign(verdict.causes.begin(), verdict.causes.end());
  pending_ = std::async(std::launch::async, [this, name] {
    write_labels(folder_ / (name + ".label"), labels_);
    if (!cause_folder_.empty()) write_causes(cause_folder_ / (name + ".cause"), causes_);
  });
}

void LabelWriter::finish() {
  if (pending_.valid()) pending_.get();
}

}  // namespace dynains::program
