#include "verdict_files.hpp"

#include "dynains/errors.hpp"
#include "dynains/io/kitti.hpp"
#include "run/output/output_folder.hpp"

namespace dynains::run {

namespace fs = std::filesystem;

namespace {

constexpr const char* kLabels = "labels";

}  // namespace

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
