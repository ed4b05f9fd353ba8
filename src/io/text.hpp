// Text and numbers in files, independent of the locale of the process.
#pragma once

#include <limits>
#include <locale>
#include <optional>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

namespace dynains::text {

/// The number that `token` consists of, "nan" and "inf" included.
std::optional<double> parse_number(std::string_view token);

/// Removes the next token, separated by blanks, from the front of `line`; empty at the end.
std::string_view next_token(std::string_view& line);

/// All tokens of a line.
std::vector<std::string_view> tokens(std::string_view line);

inline constexpr std::string_view kBlanks = " \t\r\n\v\f";

/// Without these characters at its ends.
std::string_view trimmed(std::string_view text, std::string_view characters = kBlanks);

/// The text with its ASCII letters in lower case.
std::string lower_case(std::string text);

/// The shortest form with at most 15 digits, independent of the locale.
std::string to_text(double value);
/// With a number of decimals, and a unit behind it; "-" if it is not finite.
std::string fixed(double value, int decimals, std::string_view unit = {});
/// Rounded to a number of decimals, without zeros behind them.
std::string rounded(double value, int decimals);
/// "12.5 s".
std::string in_seconds(double time);

/// The numbers that the text consists of. Blanks and `separators` stand between them. Empty if the
/// text has other words.
std::optional<std::vector<double>> numbers_in(std::string text, std::string_view separators);

/// The names of a list such as "a, b".
std::vector<std::string> names_in(std::string text);

/// "a, b, c", at most 50 names and the number of others; "none" without names.
std::string listed(const std::vector<std::string>& names);

/// The text without a mark of UTF-8 at its begin.
std::string_view without_utf8_mark(std::string_view text);

/// Makes a stream write doubles that read back exactly, independent of the locale.
inline std::ostream& exact(std::ostream& stream) {
  stream.imbue(std::locale::classic());
  stream.precision(std::numeric_limits<double>::max_digits10);
  return stream;
}

}  // namespace dynains::text
