#include "remover_options.hpp"

#include <utility>

#include "parameter_flags.hpp"
#include "run/run_settings.hpp"

namespace dynains::program {

using namespace run;

RemoverOptions::RemoverOptions(CLI::App& command, std::string default_preset)
    : preset_(std::move(default_preset)) {
  command
      .add_option(
          "--preset", preset_,
          "parameters to start from; offline: for recordings, verdicts wait for 100 later scans")
      ->check(CLI::IsMember(preset_names()))
      ->capture_default_str();
  command.add_option("--config", config_file_, "config file, see dynains config");
  const auto defaults = DynaInsRemover::Config::preset(preset_);
  DynaInsRemover::Config::visit_sections(defaults, [&](const char* group, const auto& section) {
    add_parameter_flags(command, section, group, flags_);
  });
}

DynaInsRemover::Config RemoverOptions::config() const {
  DynaInsRemover::Config config = DynaInsRemover::Config::preset(preset_);
  if (!config_file_.empty()) read_config_file(config_file_).apply(config);
  flags_.apply(config);
  config.validate();
  return config;
}

bool RemoverOptions::sets(const std::string& flag_name) const {
  return flags_.has(flag_name) ||
         (!config_file_.empty() && read_config_file(config_file_).has(flag_name));
}

}  // namespace dynains::program
