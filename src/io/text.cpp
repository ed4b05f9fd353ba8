#include "text.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iomanip>
#include <sstream>

namespace dynains::text {

std::string lower_case(std::string text) {
  for (char& c : text) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return text;
}

std::string to_text(double value) {
  std::ostringstream text;
  exact(text);
  text.precision(15);
  text << value;
  return text.str();
}

std::string fixed(double value, int decimals, std::string_view unit) {
  if (!std::isfinite(value)) return "-";
  std::ostringstream text;
  exact(text) << std::fixed << std::setprecision(decimals) << value << unit;
  return text.str();
}

std::string rounded(double value, int decimals) {
  const double scale = std::pow(10.0, decimals);
  return to_text(std::round(scale * value) / scale);
}

std::string in_seconds(double time) { return to_text(time) + " s"; }

std::optional<std::vector<double>> numbers_in(std::string text, std::string_view separators) {
  const auto is_separator = [&](char c) { return separators.find(c) != std::string_view::npos; };
  std::replace_if(text.begin(), text.end(), is_separator, ' ');
  std::vector<double> numbers;
  for (const std::string_view token : tokens(text)) {
    const auto number = parse_number(token);
    if (!number) return std::nullopt;
    numbers.push_back(*number);
  }
  return numbers;
}

std::vector<std::string> names_in(std::string text) {
  std::replace(text.begin(), text.end(), ',', ' ');
  const std::vector<std::string_view> names = tokens(text);
  return {names.begin(), names.end()};
}

std::string listed(const std::vector<std::string>& names) {
  constexpr std::size_t kShown = 50;
  std::string text;
  for (std::size_t i = 0; i < std::min(names.size(), kShown); ++i) {
    text += (i > 0 ? ", " : "") + names[i];
  }
  if (names.size() > kShown) text += " and " + std::to_string(names.size() - kShown) + " more";
  return text.empty() ? "none" : text;
}

std::string_view without_utf8_mark(std::string_view text) {
  constexpr std::string_view kMark = "\xEF\xBB\xBF";
  if (text.substr(0, kMark.size()) == kMark) text.remove_prefix(kMark.size());
  return text;
}

std::optional<double> parse_number(std::string_view token) {
  if (token.size() > 1 && token[0] == '+' && token[1] != '-') token.remove_prefix(1);
  double value = 0.0;
  const char* end = token.data() + token.size();
  const auto [stop, error] = std::from_chars(token.data(), end, value);
  if (token.empty() || error != std::errc{} || stop != end) return std::nullopt;
  return value;
}

std::string_view trimmed(std::string_view text, std::string_view characters) {
  text.remove_prefix(std::min(text.find_first_not_of(characters), text.size()));
  return text.substr(0, text.find_last_not_of(characters) + 1);
}

std::vector<std::string_view> tokens(std::string_view line) {
  std::vector<std::string_view> all;
  for (auto token = next_token(line); !token.empty(); token = next_token(line)) {
    all.push_back(token);
  }
  return all;
}

std::string_view next_token(std::string_view& line) {
  const std::size_t begin = line.find_first_not_of(kBlanks);
  if (begin == std::string_view::npos) {
    line = {};
    return {};
  }
  const std::size_t end = line.find_first_of(kBlanks, begin);
  const std::string_view token = line.substr(begin, end - begin);
  line.remove_prefix(end == std::string_view::npos ? line.size() : end);
  return token;
}

}  // namespace dynains::text
