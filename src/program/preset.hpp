// Named configurations.
#pragma once

#include <string>
#include <vector>

#include "dynains/remover.hpp"

namespace dynains::program {

inline const std::vector<std::string>& preset_names() {
  static const std::vector<std::string> names = {"default", "paper"};
  return names;
}

inline DynaInsRemover::Config preset(const std::string& name) {
  return name == "paper" ? DynaInsRemover::Config::paper() : DynaInsRemover::Config();
}

}  // namespace dynains::program
