// A recording and the results of runs over it, as tests of the program use them.
#pragma once

#include <nlohmann/json.hpp>

#include "dynains/io/kitti.hpp"
#include "program/start.hpp"

namespace dynains::test {

inline nlohmann::json report_in(const std::filesystem::path& out) {
  return nlohmann::json::parse(read_text(out / "report.json"));
}

/// The labels of one scan in a folder of results.
inline std::vector<std::uint32_t> labels_in(const std::filesystem::path& out,
                                            const std::string& scan) {
  const std::filesystem::path file = out / "labels" / (scan + ".label");
  return read_labels(file, std::filesystem::file_size(file) / sizeof(std::uint32_t));
}

/// By the label of a verdict.
inline bool is_removed(std::uint32_t label) { return (label & 0xFFFFU) == 251; }

/// Places for a recording and for results, which do not exist yet. Their names contain a blank.
struct RunFolder {
  Outcome run(const Arguments& more = {}) const {
    return start(Arguments{"run", seq, "--out", out} + more);
  }
  nlohmann::json report() const { return report_in(out); }

  TemporaryFolder folder;
  std::string seq = folder / "a seq";
  std::string out = folder / "an out";
};

}  // namespace dynains::test
