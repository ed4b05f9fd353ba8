// Preset, config file and flags of the remover, in this order of precedence from low to high.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "dynains/compiled_remover.hpp"
#include "run/settings/parameter_values.hpp"

namespace dynains::program {

class RemoverOptions {
 public:
  /// This is not moved afterwards: flags refer to it.
  RemoverOptions(CLI::App& command, std::string default_preset);
  RemoverOptions(const RemoverOptions&) = delete;
  RemoverOptions& operator=(const RemoverOptions&) = delete;

  const std::string& preset_name() const { return preset_; }

  /// Empty if none was named.
  const std::string& config_file() const { return config_file_; }

  /// Whether anything but the preset was named.
  bool given() const { return !config_file_.empty() || !flags_.empty(); }

  /// Throws ConfigError.
  DynaInsRemover::Config config() const;
  /// Whether the flag, or a line of that name in the config file, sets a parameter.
  bool sets(const std::string& flag_name) const;

 private:
  std::string preset_;
  std::string config_file_;
  run::ParameterValues flags_;  // that were given
};

}  // namespace dynains::program
