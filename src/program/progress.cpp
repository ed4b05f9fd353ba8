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
      style_(quiet                          ? Style::kNone
             : ::isatty(STDERR_FILENO) == 1 ? Style::kBar
                                            : Style::kLines) {}

Progress::~Progress() {
  if (drawn_) std::clog << std::endl;
}

void Progress::update(std::size_t done) {
  if (style_ == Style::kBar) draw_bar(done);
  if (style_ != Style::kLines || total_ == 0) return;
  const std::size_t tenths = done * 10 / total_;
  if (tenths == tenths_) return;
  tenths_ = tenths;
  std::cerr << state(done) << std::endl;
}

void Progress::draw_bar(std::size_t done) {
  using std::chrono::steady_clock;
  constexpr auto kPeriod = std::chrono::milliseconds(100);
  const auto now = steady_clock::now();
  if (drawn_ && done != total_ && now - last_ < kPeriod) return;
  last_ = now;
  drawn_ = true;
  constexpr std::size_t kBarWidth = 30;
  constexpr const char* kClearLine = "\x1b[K";  // the text may be shorter than the one before
  const std::size_t filled = total_ == 0 ? kBarWidth : done * kBarWidth / total_;
  // The bar needs carriage returns, which the filter of std::cerr escapes.
  std::clog << "\r[" << std::string(filled, '#') << std::string(kBarWidth - filled, ' ') << "] "
            << state(done) << kClearLine << std::flush;
}

std::string Progress::state(std::size_t done) const {
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - begin_;
  return std::to_string(done) + " of " + std::to_string(total_) + ' ' + unit_ +
         describe_rate(done, total_, elapsed.count(), unit_);
}

}  // namespace dynains::program
