// Scans without dynamic points, in the format of their recording.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "dynains/io/recording.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"

namespace dynains::program {

class CleanWriter {
 public:
  /// Creates the folder. The recording outlives this. Throws IoError.
  CleanWriter(std::filesystem::path folder, const Recording& recording, bool drop_not_judged);

  /// File name of scan i.
  static std::string name(const Recording& recording, std::size_t i);

  /// Writes scan i of the recording: all finite points that are not dynamic, or with
  /// `drop_not_judged` all static ones, in their order, in the frame they had, with all their
  /// columns but labels. Columns that a run does not read keep their bytes.
  void write(std::size_t i, const RecordedScan& scan, Span<const PointLabel> labels) const;

 private:
  void write_bin(const std::filesystem::path& file, std::size_t i, const RecordedScan& scan,
                 Span<const PointLabel> labels) const;
  Pose T_file_sensor(std::size_t i) const;
  bool is_kept(PointLabel label) const;

  std::filesystem::path folder_;
  const Recording& recording_;
  bool drop_not_judged_;
  bool has_others_;  ///< whether scans have columns that a run does not read
};

}  // namespace dynains::program
