// `dynains completion`: from the definition of commands and options.
#include <iostream>
#include <string>
#include <vector>

#include "command.hpp"

namespace dynains::program {
namespace {

std::vector<const CLI::App*> commands_of(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App* command) { return !command->get_group().empty(); });
}

std::string option_words(const CLI::App& command) {
  std::string words;
  const auto is_shown = [](const CLI::Option* option) { return !option->get_group().empty(); };
  for (const CLI::Option* option : command.get_options(is_shown)) {
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

void add_completion_command(CLI::App& app) {
  app.add_subcommand("completion", "Print the completion for bash: source <(dynains completion)")
      ->callback([&app] { write_completion(std::cout, app); });
}

}  // namespace dynains::program
