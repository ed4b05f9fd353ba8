// The next scan is read while the pipeline works on this one.
#pragma once

#include <cstddef>
#include <future>
#include <vector>

#include "dynains/io/kitti.hpp"

namespace dynains::program {

class ReadAhead {
 public:
  /// Scans `first` to `last`, both inclusive, of a sequence that outlives this.
  ReadAhead(const KittiSequence& sequence, std::size_t first, std::size_t last);

  /// To be called once for each scan. The next one, x y z intensity interleaved; throws IoError if
  /// it could not be read. `recycled` gives its memory to the scan after it.
  std::vector<float> next(std::vector<float> recycled);

 private:
  void launch(std::vector<float> buffer);

  const KittiSequence& sequence_;
  std::size_t next_;
  std::size_t last_;
  std::future<std::vector<float>> pending_;
};

}  // namespace dynains::program
