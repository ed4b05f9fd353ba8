#include "progress.hpp"

#include <unistd.h>

#include <cmath>
#include <iomanip>
#include <iostream>
#include <locale>
#include <sstream>
#include <utility>

namespace dynains::program {

void print_warning(const std::string& text) {
  std::cerr << "dynains: warning: " << text << std::endl;
}

std::string describe_rate(std::size_t done, std::size_t total, double seconds,
                          const std::string& unit) {
  if (done == 0 || !(seconds > 0.0)) return {};
  const double rate = static_cast<double>(done) / seconds;
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text << std::fixed << std::setprecision(rate < 100.0 ? 1 : 0) << " (" << rate << ' ' << unit
       << "/s";
  if (done < total) {
    const auto left = std::llround(static_cast<double>(total - done) / rate);
    text << ", ";
    if (left >= 3600) text << left / 3600 << ':' << std::setw(2) << std::setfill('0');
    text << left / 60 % 60 << ':' << std::setw(2) << std::setfill('0') << left % 60 << " left";
  }
  return text.str() + ')';
}

Progress::Progress(std::size_t total, std::string unit, bool quiet)
    : total_(total),
      unit_(std::move(unit)),
      is_quiet_(quiet),
      is_terminal_(::isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() {
  if (is_terminal_ && is_shown_) std::clog << std::endl;
}

void Progress::update(std::size_t done) {
  if (is_quiet_ || total_ == 0) return;
  const std::size_t part = done * (is_terminal_ ? 1000 : 10) / total_;
  if (part == part_) return;
  part_ = part;
  is_shown_ = true;
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - begin_;
  const std::string state = std::to_string(done) + " of " + std::to_string(total_) + ' ' + unit_ +
                            describe_rate(done, total_, elapsed.count(), unit_);
  if (is_terminal_) {
    // Clears the line: the text may be shorter than the one before.
    // The filter of std::cerr escapes carriage returns.
    std::clog << '\r' << state << "\x1b[K" << std::flush;
  } else {
    std::cerr << state << std::endl;
  }
}

}  // namespace dynains::program
