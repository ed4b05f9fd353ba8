// Text without control characters, so that file names in it cannot steer a terminal.
#pragma once

#include <ostream>
#include <streambuf>
#include <string>

namespace dynains::program {

/// Replaces control characters by \xNN, so that file names cannot steer a terminal. Line feeds and
/// tabs stay; UTF-8 stays, except its control characters (U+0080 to U+009F).
class PrintableStream {
 public:
  /// Filters `stream` as long as this object lives.
  explicit PrintableStream(std::ostream& stream);
  ~PrintableStream();
  PrintableStream(const PrintableStream&) = delete;
  PrintableStream& operator=(const PrintableStream&) = delete;

 private:
  class Filter : public std::streambuf {
   public:
    explicit Filter(std::streambuf* target) : target_(target) {}

   protected:
    int_type overflow(int_type c) override;
    std::streamsize xsputn(const char* text, std::streamsize size) override;
    int sync() override { return target_->pubsync(); }

   private:
    std::streambuf* target_;
    bool after_c2_ = false;  ///< the first byte of U+0080 to U+00BF waits for the second
  };

  std::ostream& stream_;
  std::streambuf* target_;
  Filter filter_;
};

/// The text on one line: line feeds and tabs become \n and \t.
std::string on_one_line(const std::string& text);

}  // namespace dynains::program
