#include "unknown_command.hpp"

#include <algorithm>
#include <vector>

#include "run/nearest_name.hpp"

namespace dynains::program {
namespace {

/// The innermost command that was understood.
const CLI::App& last_command(const CLI::App& app) {
  const CLI::App* last = &app;
  while (!last->get_subcommands().empty()) last = last->get_subcommands().front();
  return *last;
}

std::optional<std::string> remark_on_word(const CLI::App& command, const std::string& word) {
  std::vector<std::string> names;
  for (const CLI::App* one : command.get_subcommands([](const CLI::App*) { return true; })) {
    names.push_back(one->get_name());
  }
  if (names.empty()) return std::nullopt;
  std::string text = "\"" + word + "\" is no command";
  const std::string like = nearest_name(word, names);
  if (!like.empty()) text += "; did you mean " + like + "?";
  text += like.empty() ? "; expected one of " : " Expected one of ";
  for (std::size_t i = 0; i < names.size(); ++i) text += (i == 0 ? "" : ", ") + names[i];
  return text;
}

std::string remark_on_option(const CLI::App& command, const std::string& word) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options()) {
    if (option->get_group().empty()) continue;  // former names
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  const std::string given = word.substr(0, word.find('='));
  const std::string like = nearest_name(given, names);
  std::string text = given + " is no option";
  if (command.get_parent() != nullptr) text += " of " + command.get_name();
  return like.empty() ? text : text + "; did you mean " + like + "?";
}

}  // namespace

std::optional<std::string> remark_on_unknown_word(const CLI::App& app) {
  const CLI::App& command = last_command(app);
  const std::vector<std::string> rest = app.remaining(true);
  if (rest.empty()) return std::nullopt;
  if (rest.front().substr(0, 1) != "-") {
    if (auto remark = remark_on_word(command, rest.front())) return remark;
  }
  const auto option = std::find_if(rest.begin(), rest.end(), [](const std::string& word) {
    return word.size() > 2 && word.compare(0, 2, "--") == 0;
  });
  if (option == rest.end()) return std::nullopt;
  return remark_on_option(command, *option);
}

}  // namespace dynains::program
