// Columns of raw scans (.bin).
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "dynains/io/recording.hpp"

namespace dynains {

inline std::size_t value_size(const BinLayout& layout) {
  return layout.is_double ? sizeof(double) : sizeof(float);
}
inline std::size_t point_size(const BinLayout& layout) {
  const std::size_t columns = static_cast<std::size_t>(layout.columns) * value_size(layout);
  return layout.bytes > 0 ? static_cast<std::size_t>(layout.bytes) : columns;
}
/// Whether scans are float32 x y z intensity.
inline bool is_usual(const BinLayout& layout) {
  return layout.columns == 4 && !layout.is_double && layout.bytes == 0;
}

/// "float32 x y z intensity", "5 columns of float32".
std::string to_text(const BinLayout& layout);

/// Number of points by the size of the file. Throws IoError unless that is a multiple of the size of
/// a point.
std::uint64_t count_bin_points(const std::filesystem::path& file, const BinLayout& layout);

/// Reads x y z intensity of each point, interleaved; without a fourth column, intensities are 0.
/// `ring`: the fifth column, if it is one.
void read_bin_points(const std::filesystem::path& file, const BinLayout& layout,
                     std::vector<float>& xyzi, std::vector<std::uint16_t>* ring = nullptr);

/// Throws IoError if the content of the file does not look like float32 x y z intensity, and for
/// another layout: numbers are as points have them only as float64 or in points of another size, or
/// values of one column are clearly more alike with another number of columns. The order of points
/// does not matter.
void check_bin_content(const std::filesystem::path& file);

}  // namespace dynains
