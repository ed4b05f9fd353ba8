#include "progress.hpp"

#include <unistd.h>

#include <iostream>
#include <utility>

namespace dynains::program {

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
  std::cerr << done << " of " << total_ << ' ' << unit_ << std::endl;
}

void Progress::draw_bar(std::size_t done) {
  using std::chrono::steady_clock;
  constexpr auto kPeriod = std::chrono::milliseconds(100);
  const auto now = steady_clock::now();
  if (drawn_ && done != total_ && now - last_ < kPeriod) return;
  last_ = now;
  drawn_ = true;
  constexpr std::size_t kWidth = 40;
  const std::size_t filled = total_ == 0 ? kWidth : done * kWidth / total_;
  // The bar needs carriage returns, which the filter of std::cerr escapes.
  std::clog << "\r[" << std::string(filled, '#') << std::string(kWidth - filled, ' ') << "] "
            << done << " of " << total_ << ' ' << unit_ << std::flush;
}

}  // namespace dynains::program
