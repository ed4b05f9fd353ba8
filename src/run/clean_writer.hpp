// Scans without dynamic points.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "dynains/io/recording.hpp"
#include "dynains/points.hpp"
#include "judged_scan.hpp"

namespace dynains::run {

class CleanWriter {
 public:
  /// Creates the folder. The recording outlives this. Throws IoError.
  CleanWriter(std::filesystem::path folder, const Recording& recording, bool drop_not_judged);

  /// File name of scan i.
  static std::string name(const Recording& recording, std::size_t i);

  /// Writes the scan: all finite points that are not dynamic, or with
  /// `drop_not_judged` all static ones, in their order and frame. Files of .bin, .pcd and .ply are
  /// copied without the other points, so that all columns stay as they are. Scans of other formats
  /// become .pcd with the columns of `scan`, m.
  void write(const JudgedScan& judged) const;

 private:
  bool is_kept(PointLabel label) const;

  std::filesystem::path folder_;
  const Recording& recording_;
  bool drop_not_judged_;
};

}  // namespace dynains::run
