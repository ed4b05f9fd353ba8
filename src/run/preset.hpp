// Names of the presets of a run.
#pragma once

#include <string>
#include <vector>

namespace dynains::run {

/// The names that a run accepts, a part of those of DynaInsRemover::Config::preset().
inline const std::vector<std::string>& preset_names() {
  static const std::vector<std::string> names = {"default", "offline", "paper", "published"};
  return names;
}

/// Whether the preset holds the ranges of the paper.
inline bool has_ranges_of_paper(const std::string& name) {
  return name == "paper" || name == "published";
}

}  // namespace dynains::run
