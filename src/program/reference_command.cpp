// `dynains man` and `dynains completion`: texts from the definition of commands and options.
#include <algorithm>
#include <iostream>
#include <string>
#include <vector>

#include "command.hpp"
#include "dynains/version.hpp"

namespace dynains::program {
namespace {

std::vector<const CLI::App*> commands_of(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App* command) { return !command->get_group().empty(); });
}

std::vector<const CLI::Option*> options_of(const CLI::App& app) {
  return app.get_options([](const CLI::Option* option) { return !option->get_group().empty(); });
}

/// All names of an option: "-o, --out".
std::string names_of(const CLI::Option& option) {
  std::string text;
  const auto add = [&](const std::string& name) { text += (text.empty() ? "" : ", ") + name; };
  for (const std::string& name : option.get_snames()) add("-" + name);
  for (const std::string& name : option.get_lnames()) add("--" + name);
  return text.empty() ? option.get_name() : text;
}

/// Text for roff: backslashes, hyphens and leading dots have a meaning there.
std::string roff(const std::string& text) {
  std::string result;
  bool begins_line = true;
  for (const char c : text) {
    if (begins_line && (c == '.' || c == '\'')) result += "\\&";
    if (c == '\\') {
      result += "\\e";
    } else if (c == '-') {
      result += "\\-";
    } else {
      result += c;
    }
    begins_line = c == '\n';
  }
  return result;
}

void write_man_options(std::ostream& out, const CLI::App& command) {
  std::vector<std::string> groups = command.get_groups();
  for (const std::string& group : groups) {
    const auto options = command.get_options(
        [&](const CLI::Option* option) { return option->get_group() == group; });
    if (group.empty() || options.empty()) continue;
    out << ".PP\n" << roff(group) << ":\n";
    for (const CLI::Option* option : options) {
      out << ".TP\n\\fB" << roff(names_of(*option)) << "\\fR";
      if (!option->get_type_name().empty())
        out << " \\fI" << roff(option->get_type_name()) << "\\fR";
      out << '\n' << roff(option->get_description()) << '\n';
    }
  }
}

void write_man_command(std::ostream& out, const CLI::App& command, const std::string& name) {
  out << ".SS " << roff(name) << '\n' << roff(command.get_description()) << '\n';
  write_man_options(out, command);
  if (!command.get_footer().empty()) out << ".PP\n" << roff(command.get_footer()) << '\n';
  for (const CLI::App* part : commands_of(command)) {
    write_man_command(out, *part, name + ' ' + part->get_name());
  }
}

void write_man_page(std::ostream& out, const CLI::App& app) {
  out << ".TH DYNAINS 1 \"\" \"dynains " << kVersionString << "\" \"User commands\"\n"
      << ".SH NAME\ndynains \\- remove moving objects from LiDAR scans and maps\n"
      << ".SH SYNOPSIS\n.B dynains\n\\fICOMMAND\\fR [\\fIOPTIONS\\fR]\n"
      << ".SH DESCRIPTION\n"
      << roff(app.get_description()) << "\n.SH COMMANDS\n";
  for (const CLI::App* command : commands_of(app)) {
    write_man_command(out, *command, command->get_name());
  }
}

std::string option_words(const CLI::App& command) {
  std::string words;
  for (const CLI::Option* option : options_of(command)) {
    for (const std::string& name : option->get_lnames()) words += " --" + name;
  }
  return words;
}

void write_completion_cases(std::ostream& out, const CLI::App& command, const std::string& name) {
  const std::vector<const CLI::App*> parts = commands_of(command);
  out << "    \"" << name << "\") options=\"" << option_words(command) << "\"; commands=\"";
  for (const CLI::App* part : parts) out << ' ' << part->get_name();
  out << "\" ;;\n";
  for (const CLI::App* part : parts) {
    write_completion_cases(out, *part, name + (name.empty() ? "" : " ") + part->get_name());
  }
}

/// A function for bash: options behind a hyphen, commands where one is expected, else files.
void write_completion(std::ostream& out, const CLI::App& app) {
  out << R"(_dynains() {
  local current=${COMP_WORDS[COMP_CWORD]} command="" options="" commands="" i
  for ((i = 1; i < COMP_CWORD; ++i)); do
    _dynains_words "${command:+$command }${COMP_WORDS[i]}" && command="${command:+$command }${COMP_WORDS[i]}"
  done
  _dynains_words "$command"
  COMPREPLY=()
  if [[ $current == -* ]]; then
    COMPREPLY=($(compgen -W "$options" -- "$current"))
  elif [[ -n $commands ]]; then
    COMPREPLY=($(compgen -W "$commands" -- "$current"))
  fi
}
_dynains_words() {
  case $1 in
)";
  write_completion_cases(out, app, "");
  out << R"(    *) return 1 ;;
  esac
}
complete -o default -F _dynains dynains
)";
}

}  // namespace

void add_reference_commands(CLI::App& app) {
  app.add_subcommand("man", "Print the manual page: dynains man | man -l -")->callback([&app] {
    write_man_page(std::cout, app);
  });
  app.add_subcommand("completion", "Print the completion for bash: source <(dynains completion)")
      ->callback([&app] { write_completion(std::cout, app); });
}

}  // namespace dynains::program
