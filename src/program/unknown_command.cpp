#include "unknown_command.hpp"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <vector>

namespace dynains::program {
namespace {

/// Letters to insert, remove or replace to get from one word to the other (Levenshtein).
std::size_t distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t k = 0; k < b.size(); ++k) {
      const std::size_t replaced = diagonal + (a[i] == b[k] ? 0 : 1);
      diagonal = row[k + 1];
      row[k + 1] = std::min({replaced, row[k] + 1, diagonal + 1});
    }
  }
  return row.back();
}

/// Empty if none is alike.
std::string nearest(const std::string& word, const std::vector<std::string>& names) {
  constexpr std::size_t kAlike = 2;  // letters
  std::string best;
  std::size_t least = std::min(kAlike + 1, word.size());
  for (const std::string& name : names) {
    const bool is_begun = name.compare(0, word.size(), word) == 0;
    const std::size_t letters = is_begun ? 0 : distance(word, name);
    if (letters >= least) continue;
    least = letters;
    best = name;
  }
  return best;
}

/// The innermost command that was understood.
const CLI::App& last_command(const CLI::App& app) {
  const CLI::App* last = &app;
  while (!last->get_subcommands().empty()) last = last->get_subcommands().front();
  return *last;
}

}  // namespace

std::optional<std::string> remark_on_unknown_command(const CLI::App& app) {
  const CLI::App& last = last_command(app);
  std::vector<std::string> names;
  for (const CLI::App* command : last.get_subcommands([](const CLI::App*) { return true; })) {
    names.push_back(command->get_name());
  }
  const std::vector<std::string> rest = app.remaining(true);
  if (names.empty() || rest.empty() || rest.front().substr(0, 1) == "-") return std::nullopt;

  std::string text = "\"" + rest.front() + "\" is no command";
  const std::string like = nearest(rest.front(), names);
  if (!like.empty()) text += "; did you mean " + like + "?";
  text += like.empty() ? "; expected one of " : " Expected one of ";
  for (std::size_t i = 0; i < names.size(); ++i) text += (i == 0 ? "" : ", ") + names[i];
  return text;
}

}  // namespace dynains::program
