// A recording that the program processes in milliseconds.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "dynains/io/kitti.hpp"
#include "program/tiny_sequence.hpp"

namespace dynains::test {

/// Every twelfth point of the tiny sequence, about 440 per scan, with ground truth for the box.
/// Times differ from the defaults of a recording without times.
inline void write_small_recording(const std::filesystem::path& folder, std::size_t scans) {
  write_tiny_sequence(folder, scans);
  std::filesystem::create_directories(folder / "labels");
  std::vector<double> times;
  for (std::size_t i = 0; i < scans; ++i) {
    const std::vector<float> all = tiny_scan(i);
    std::vector<float> scan;
    std::vector<std::uint32_t> labels;
    const std::size_t box = all.size() / 4 - 192;
    for (std::size_t k = i; k < all.size() / 4; k += 12) {
      scan.insert(scan.end(), all.data() + 4 * k, all.data() + 4 * k + 4);
      labels.push_back(k < box ? 9 : 251);
    }
    write_scan(folder / "velodyne" / (scan_name(i) + ".bin"), scan);
    write_labels(folder / "labels" / (scan_name(i) + ".label"), labels);
    times.push_back(0.2 * static_cast<double>(i));
  }
  write_times(folder / "times.txt", times);
}

}  // namespace dynains::test
