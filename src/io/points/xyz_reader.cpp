#include <string>
#include <string_view>
#include <vector>

#include "../byte_reader.hpp"
#include "../text.hpp"
#include "point_sink.hpp"

namespace dynains {
namespace {

/// Commas and semicolons separate like blanks.
void use_blanks(std::string& line) {
  for (char& c : line) {
    if (c == ',' || c == ';') c = ' ';
  }
}

std::string_view without_marks(std::string_view token) {
  while (!token.empty() && (token.front() == '#' || token.front() == '/' || token.front() == '"')) {
    token.remove_prefix(1);
  }
  while (!token.empty() && token.back() == '"') token.remove_suffix(1);
  return token;
}

bool is_comment(const std::string& line) { return line[0] == '#' || line.rfind("//", 0) == 0; }

/// The columns of a text: those of a line of names, else x y z intensity.
class XyzColumns {
 public:
  XyzColumns(const ByteReader& reader, PointSink& sink) : reader_(reader), sink_(sink) {}

  bool are_known() const { return !roles_.empty(); }

  /// True if `tokens` are names, which the first line may have, also behind a mark of a comment.
  bool take_names(const std::vector<std::string_view>& tokens) {
    std::vector<Role> roles;
    bool has_x = false;
    for (const std::string_view token : tokens) {
      const std::string_view name = without_marks(token);
      if (name.empty()) continue;
      roles.push_back(role_of(name));
      has_x = has_x || roles.back() == Role::kX;
    }
    if (!has_x) return false;
    for (Role& role : roles) {
      if (role != Role::kNone && !sink_.claim(role)) role = Role::kNone;
    }
    if (const auto name = sink_.missing()) {
      reader_.fail_on_line("expected columns x, y and z, found no " + *name);
    }
    roles_ = std::move(roles);
    return true;
  }

  void take_default(std::size_t count) {
    if (count < 3) reader_.fail_on_line("expected at least 3 numbers: x y z");
    roles_.assign(count, Role::kNone);
    for (std::size_t i = 0; i < count && i < std::size(kUsualRoles); ++i) {
      roles_[i] = kUsualRoles[i];
      sink_.claim(kUsualRoles[i]);
    }
  }

  void store(const std::vector<std::string_view>& tokens, std::size_t row) {
    if (tokens.size() != roles_.size()) {
      reader_.fail_on_line("expected " + std::to_string(roles_.size()) + " columns, found " +
                           std::to_string(tokens.size()));
    }
    for (std::size_t i = 0; i < tokens.size(); ++i) {
      if (roles_[i] == Role::kNone) continue;
      const auto value = text::parse_number(tokens[i]);
      if (!value || !sink_.set(row, roles_[i], *value)) {
        reader_.fail_on_line("expected a number that the column can have, found \"" +
                             std::string(tokens[i].substr(0, 40)) + '"');
      }
    }
  }

 private:
  const ByteReader& reader_;
  PointSink& sink_;
  std::vector<Role> roles_;
};

}  // namespace

std::uint64_t read_xyz(const std::filesystem::path& path, PointSink& sink, bool with_points) {
  ByteReader reader(path);
  XyzColumns columns(reader, sink);
  std::string line;
  std::size_t count = 0;
  bool is_first = true;
  while (reader.read_line(line)) {
    use_blanks(line);
    const std::vector<std::string_view> tokens = text::tokens(line);
    if (tokens.empty()) continue;
    const bool may_be_names = is_first && !text::parse_number(tokens.front());
    is_first = false;
    if (may_be_names && columns.take_names(tokens)) continue;
    if (is_comment(line)) continue;
    if (!columns.are_known()) columns.take_default(tokens.size());
    ++count;
    if (!with_points) continue;
    sink.resize(count);
    columns.store(tokens, count - 1);
  }
  if (!columns.are_known()) reader.fail_on_line("file ends, expected at least one point");
  return count;
}

}  // namespace dynains
