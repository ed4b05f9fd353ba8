#include "point_spill.hpp"

#include <fstream>
#include <utility>

#include "dynains/errors.hpp"

namespace dynains::viewer {

PointSpill::PointSpill(const std::filesystem::path& target) : target_(target), file_(target) {}

void PointSpill::add(List& list, const TilePoint& point) {
  list.rest_.push_back(point);
  ++list.size_;
  if (list.rest_.size() < kBlock) return;
  std::size_t block = blocks_;
  if (free_blocks_.empty()) {
    ++blocks_;
  } else {
    block = free_blocks_.back();
    free_blocks_.pop_back();
  }
  std::ostream& stream = file_.stream();
  stream.seekp(static_cast<std::streamoff>(block * kBlock * sizeof(TilePoint)));
  stream.write(reinterpret_cast<const char*>(list.rest_.data()), kBlock * sizeof(TilePoint));
  if (!stream) file_.prepare(AtomicFile::Sync::kLater);  // throws the cause
  list.blocks_.push_back(block);
  list.rest_.clear();
}

std::vector<TilePoint> PointSpill::take(List& list) {
  std::vector<TilePoint> points(list.size_);
  file_.stream().flush();
  std::ifstream file(file_.temporary_path(), std::ios::binary);
  std::size_t done = 0;
  for (const std::size_t block : list.blocks_) {
    file.seekg(static_cast<std::streamoff>(block * kBlock * sizeof(TilePoint)));
    file.read(reinterpret_cast<char*>(points.data() + done), kBlock * sizeof(TilePoint));
    done += kBlock;
  }
  if (!file_.stream() || !file) {
    throw IoError(target_.string() + ": its temporary file cannot be read back");
  }
  std::copy(list.rest_.begin(), list.rest_.end(),
            points.begin() + static_cast<std::ptrdiff_t>(done));
  free_blocks_.insert(free_blocks_.end(), list.blocks_.begin(), list.blocks_.end());
  list = List();
  return points;
}

}  // namespace dynains::viewer
