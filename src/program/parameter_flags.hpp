// Parameters and settings as flags, from the list of fields of a struct.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <functional>
#include <string>
#include <type_traits>

#include "dynains/parameters.hpp"
#include "run/settings/parameter_values.hpp"

namespace dynains::program {

/// Adds a flag for each parameter of a configuration, which notes its text in `values`. These
/// outlive the command. `defaults` are shown in --help.
template <class Config>
void add_parameter_flags(CLI::App& command, const Config& defaults, const std::string& group,
                         run::ParameterValues& values) {
  Config::visit(defaults, [&](const auto& parameter) {
    const std::string name = run::flag_name(parameter.name), flag = "--" + name;
    const auto note = [&values, name, flag](const std::string& text) {
      values.set(name, text, flag);
    };
    const std::string help =
        std::string(parameter.help) + " [" + run::format_value(parameter.value) + ']';
    command.add_option_function<std::string>(flag, note, help)
        ->type_name(run::describe_range(parameter))
        ->group(group);
  });
}

/// Help of a setting, with its default unless that is a text.
template <class T>
std::string help_of(const Parameter<T>& parameter) {
  const bool is_flag = std::is_same_v<std::remove_const_t<T>, bool>;
  return is_flag ? parameter.help
                 : std::string(parameter.help) + " [" + run::format_value(parameter.value) + ']';
}
template <class T, class Read>
std::string help_of(const TextParameter<T, Read>& parameter) {
  return parameter.help;
}

/// Visitor that adds a flag for each setting, which is set while the command line is read. Flags of
/// booleans take no value. The settings outlive the command.
struct SettingFlags {
  CLI::App& command;
  const char* group = "";  ///< empty: that of other options
  /// Called with flag and text of each setting that is set.
  std::function<void(const std::string&, const std::string&)> note = [](const std::string&,
                                                                        const std::string&) {};

  template <class Setting>
  void operator()(const Setting& setting) const {
    const std::string flag = "--" + run::flag_name(setting.name);
    using Value = std::remove_reference_t<decltype(setting.value)>;
    CLI::Option* option = nullptr;
    const auto assign = [setting, flag, note = note](const std::string& text) {
      run::assign_parameter(setting, text, flag);
      note(flag, text);
    };
    if constexpr (std::is_same_v<Value, bool>) {
      const auto set = [assign](std::int64_t count) { assign(count > 0 ? "true" : "false"); };
      option = command.add_flag_function(flag, set, setting.help);
    } else {
      option = command.add_option_function<std::string>(flag, assign, help_of(setting));
      option->type_name(run::describe_range(setting));
    }
    if (*group != '\0') option->group(group);
  }
};

}  // namespace dynains::program
