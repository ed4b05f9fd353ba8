#include <algorithm>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include "../byte_reader.hpp"
#include "../text.hpp"
#include "point_sink.hpp"

namespace dynains {
namespace {

bool is_comment(const std::string& line) { return line[0] == '#' || line.rfind("//", 0) == 0; }

/// Meanings of the columns by their names, which the first line may have, also behind a mark of a
/// comment. Empty if `tokens` are no names.
std::vector<Role> roles_of_names(const ByteReader& reader,
                                 const std::vector<std::string_view>& tokens, PointSink& sink) {
  std::vector<Role> roles;
  for (const std::string_view token : tokens) {
    const std::string_view name = text::trimmed(token, "#/\"");
    if (!name.empty()) roles.push_back(role_of(name));
  }
  if (std::find(roles.begin(), roles.end(), Role::kX) == roles.end()) return {};
  for (Role& role : roles) {
    if (role != Role::kNone && !sink.claim(role)) role = Role::kNone;
  }
  if (const auto name = sink.missing()) {
    reader.fail_on_line("expected columns x, y and z, found no " + *name);
  }
  return roles;
}

/// x y z, intensity if there is a fourth column, others.
std::vector<Role> usual_roles(const ByteReader& reader, std::size_t count, PointSink& sink) {
  if (count < 3) reader.fail_on_line("expected at least 3 numbers: x y z");
  std::vector<Role> roles(count, Role::kNone);
  for (std::size_t i = 0; i < count && i < std::size(kUsualRoles); ++i) {
    roles[i] = kUsualRoles[i];
    sink.claim(roles[i]);
  }
  return roles;
}

/// Stores the values of a row.
void store(const ByteReader& reader, const std::vector<std::string_view>& tokens,
           const std::vector<Role>& roles, std::size_t row, PointSink& sink) {
  if (tokens.size() != roles.size()) {
    reader.fail_on_line("expected " + std::to_string(roles.size()) + " columns, found " +
                        std::to_string(tokens.size()));
  }
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    if (roles[i] == Role::kNone) continue;
    const auto value = text::parse_number(tokens[i]);
    if (value && sink.set(row, roles[i], *value)) continue;
    reader.fail_on_line("expected a number that the column can have, found \"" +
                        std::string(tokens[i].substr(0, 40)) + '"');
  }
}

}  // namespace

std::uint64_t read_xyz(const std::filesystem::path& path, PointSink& sink, bool with_points) {
  ByteReader reader(path);
  std::vector<Role> roles;
  std::string line;
  std::size_t count = 0;
  bool is_first = true;
  while (reader.read_line(line)) {
    const auto is_separator = [](char c) { return c == ',' || c == ';'; };
    std::replace_if(line.begin(), line.end(), is_separator, ' ');
    const std::vector<std::string_view> tokens = text::tokens(line);
    if (tokens.empty()) continue;
    const bool may_be_names = is_first && !text::parse_number(tokens.front());
    is_first = false;
    if (may_be_names) roles = roles_of_names(reader, tokens, sink);
    if ((may_be_names && !roles.empty()) || is_comment(line)) continue;
    if (roles.empty()) roles = usual_roles(reader, tokens.size(), sink);
    ++count;
    if (!with_points) continue;
    sink.resize(count);
    store(reader, tokens, roles, count - 1, sink);
  }
  if (roles.empty()) reader.fail_on_line("file ends, expected at least one point");
  return count;
}

}  // namespace dynains
