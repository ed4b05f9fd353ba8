// Named configurations.
#pragma once

#include <string>
#include <vector>

#include "dynains/compiled_remover.hpp"

namespace dynains::program {

inline const std::vector<std::string>& preset_names() {
  static const std::vector<std::string> names = {"default", "offline", "paper"};
  return names;
}

inline DynaInsRemover::Config preset(const std::string& name) {
  using Config = DynaInsRemover::Config;
  if (name == "offline") return Config::offline();
  return name == "paper" ? Config::paper() : Config();
}

}  // namespace dynains::program
