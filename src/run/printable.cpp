#include "printable.hpp"

#include <array>
#include <cstdio>
#include <utility>

namespace dynains::run {
namespace {

constexpr unsigned char kLeadOfControls = 0xC2;  // first byte of U+0080 to U+00BF

std::string escaped(unsigned char c) {
  std::array<char, 5> code{};
  std::snprintf(code.data(), code.size(), "\\x%02X", static_cast<unsigned>(c));
  return code.data();
}

bool is_control(unsigned char c) { return (c < 0x20 && c != '\n' && c != '\t') || c == 0x7F; }

}  // namespace

PrintableStream::PrintableStream(std::ostream& stream)
    : stream_(stream), target_(stream.rdbuf(this)) {}

PrintableStream::~PrintableStream() { stream_.rdbuf(target_); }

PrintableStream::int_type PrintableStream::overflow(int_type value) {
  if (traits_type::eq_int_type(value, traits_type::eof())) return traits_type::not_eof(value);
  const auto c = static_cast<unsigned char>(value);
  const bool is_second = std::exchange(has_lead_, c == kLeadOfControls);
  const bool ends_control = is_second && c >= 0x80 && c < 0xA0;
  std::string shown;
  if (is_second) shown += ends_control ? escaped(kLeadOfControls) : std::string(1, '\xC2');
  if (ends_control || is_control(c)) {
    shown += escaped(c);
  } else if (!has_lead_) {
    shown += static_cast<char>(c);
  }
  const auto size = static_cast<std::streamsize>(shown.size());
  return target_->sputn(shown.data(), size) == size ? value : traits_type::eof();
}

std::string on_one_line(const std::string& text) {
  std::string line;
  for (const char c : text) {
    if (c == '\n') {
      line += "\\n";
    } else if (c == '\t') {
      line += "\\t";
    } else {
      line += c;
    }
  }
  return line;
}

}  // namespace dynains::run
