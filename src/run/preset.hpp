// Named configurations.
#pragma once

#include <string>
#include <vector>

#include "dynains/compiled_remover.hpp"

namespace dynains::program {

inline const std::vector<std::string>& preset_names() {
  static const std::vector<std::string> names = {"default", "offline", "paper", "published"};
  return names;
}

/// Whether the preset holds the ranges of the paper.
inline bool has_ranges_of_paper(const std::string& name) {
  return name == "paper" || name == "published";
}

inline DynaInsRemover::Config preset(const std::string& name) {
  using Config = DynaInsRemover::Config;
  if (name == "offline") return Config::offline();
  if (name == "published") return Config::published();
  return name == "paper" ? Config::paper() : Config();
}

}  // namespace dynains::program
