// How far a long command is.
#pragma once

#include <chrono>
#include <cstddef>
#include <string>

namespace dynains::program {

/// On standard error, as a line "dynains: warning: TEXT".
void print_warning(const std::string& text);

/// " (24.5 scans/s, 1:02 left)": the rate of `done` items in `seconds`, and the time for the rest
/// of `total`. Empty if nothing is known yet.
std::string describe_rate(std::size_t done, std::size_t total, double seconds,
                          const std::string& unit);

/// On standard error: a line that is written again and again if it is a terminal, else one for each
/// tenth of the work; with the rate since the start, and the remaining time at that rate.
class Progress {
 public:
  /// `unit`: name of the counted items, for example "scans".
  Progress(std::size_t total, std::string unit, bool quiet);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void update(std::size_t done);

 private:
  std::size_t total_;
  std::string unit_;
  bool is_quiet_;
  bool is_terminal_;
  bool is_shown_ = false;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  std::size_t part_ = 0;
};

}  // namespace dynains::program
