// Points of recorded scans that a finished run labelled static.
#pragma once

#include <cstddef>
#include <deque>
#include <filesystem>
#include <future>
#include <vector>

#include "dynains/io/recording.hpp"
#include "dynains/points.hpp"

namespace dynains::program {

/// Reads scans and their labels ahead, in a few threads, and gives the static points scan by scan.
class KeptPoints {
 public:
  /// `scans`: indices in a recording that outlives this. `labels`: folder of the label files.
  KeptPoints(const Recording& recording, std::filesystem::path labels,
             std::vector<std::size_t> scans);

  /// The static points of the next scan, m, sensor frame, in the order of the file. To be called
  /// once for each scan; valid until the next call. Throws IoError for files that cannot be read,
  /// labels of other scans, and labels that no run writes.
  const PointBuffer& next();

 private:
  struct Slot {
    RecordedScan scan;
    PointBuffer kept;
  };
  void launch(Slot slot);
  void read(std::size_t i, Slot& slot) const;

  const Recording& recording_;
  std::filesystem::path labels_;
  std::vector<std::size_t> scans_;
  std::size_t launched_ = 0;  // scans
  std::deque<std::future<Slot>> pending_;
  Slot current_;
};

}  // namespace dynains::program
