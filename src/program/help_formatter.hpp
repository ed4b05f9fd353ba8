// Help in two lengths: --help with the options that matter, --help-all with the rest, grouped.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace dynains::program {

class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_help(const CLI::App* app, std::string name,
                        CLI::AppFormatMode mode) const override {
    if (mode != CLI::AppFormatMode::Normal) return CLI::Formatter::make_help(app, name, mode);
    const auto main_options = app->get_options([](const CLI::Option* option) {
      return option->get_group() == kMainGroup && option->nonpositional();
    });
    std::string text = make_description(app) + make_usage(app, name) + make_positionals(app) +
                       make_group(kMainGroup, false, main_options) + make_subcommands(app, mode);
    const std::string more = other_groups(*app);
    if (!more.empty()) text += "\nMore options by --help-all: " + more + '\n';
    return text + '\n' + make_footer(app);
  }

 private:
  static constexpr const char* kMainGroup = "Options";  // of options without another one

  static std::string other_groups(const CLI::App& app) {
    std::string names;
    for (const std::string& group : app.get_groups()) {
      if (group.empty() || group == kMainGroup) continue;
      names += (names.empty() ? "" : ", ") + group;
    }
    return names;
  }
};

}  // namespace dynains::program
