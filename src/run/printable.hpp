// Text without control characters, so that file names in it cannot steer a terminal.
#pragma once

#include <ostream>
#include <streambuf>
#include <string>

namespace dynains::run {

/// Replaces control characters by \xNN, so that file names cannot steer a terminal. Line feeds and
/// tabs stay; UTF-8 stays, except its control characters (U+0080 to U+009F).
class PrintableStream : std::streambuf {
 public:
  /// Filters `stream` as long as this object lives.
  explicit PrintableStream(std::ostream& stream);
  ~PrintableStream() override;
  PrintableStream(const PrintableStream&) = delete;
  PrintableStream& operator=(const PrintableStream&) = delete;

 private:
  int_type overflow(int_type value) override;
  int sync() override { return target_->pubsync(); }

  std::ostream& stream_;
  std::streambuf* target_;
  bool has_lead_ = false;  ///< the first byte of U+0080 to U+00BF waits for the second
};

/// The text on one line: line feeds and tabs become \n and \t.
std::string on_one_line(const std::string& text);

}  // namespace dynains::run
