#include "printable.hpp"

namespace dynains::program {
namespace {

constexpr unsigned char kLeadOfControls = 0xC2;  // first byte of U+0080 to U+00BF

std::string escaped(unsigned char c) {
  constexpr const char* kDigits = "0123456789ABCDEF";
  return {'\\', 'x', kDigits[c / 16], kDigits[c % 16]};
}

bool is_control(unsigned char c) { return (c < 0x20 && c != '\n' && c != '\t') || c == 0x7F; }

}  // namespace

PrintableStream::PrintableStream(std::ostream& stream)
    : stream_(stream), target_(stream.rdbuf()), filter_(target_) {
  stream_.rdbuf(&filter_);
}

PrintableStream::~PrintableStream() { stream_.rdbuf(target_); }

PrintableStream::Filter::int_type PrintableStream::Filter::overflow(int_type c) {
  if (traits_type::eq_int_type(c, traits_type::eof())) return traits_type::not_eof(c);
  const char character = traits_type::to_char_type(c);
  return xsputn(&character, 1) == 1 ? c : traits_type::eof();
}

std::streamsize PrintableStream::Filter::xsputn(const char* text, std::streamsize size) {
  std::string shown;
  for (std::streamsize i = 0; i < size; ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    if (after_c2_) {
      const bool control = c >= 0x80 && c < 0xA0;
      shown += control ? escaped(kLeadOfControls) : std::string(1, '\xC2');
      shown += control ? escaped(c) : std::string();
      after_c2_ = false;
      if (control) continue;
    }
    if (c == kLeadOfControls) {
      after_c2_ = true;
    } else {
      shown += is_control(c) ? escaped(c) : std::string(1, static_cast<char>(c));
    }
  }
  const auto length = static_cast<std::streamsize>(shown.size());
  return target_->sputn(shown.data(), length) == length ? size : 0;
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

}  // namespace dynains::program
