// How far a long command is.
#pragma once

#include <chrono>
#include <cstddef>
#include <string>

namespace dynains::program {

/// On standard error: a bar if it is a terminal, else a plain line for each tenth of the work.
class Progress {
 public:
  /// `unit`: name of the counted items, for example "scans".
  Progress(std::size_t total, std::string unit, bool quiet);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void update(std::size_t done);

 private:
  enum class Style { kNone, kBar, kLines };
  void draw_bar(std::size_t done);

  std::size_t total_;
  std::string unit_;
  Style style_;
  std::size_t tenths_ = 0;
  bool drawn_ = false;
  std::chrono::steady_clock::time_point last_;
};

}  // namespace dynains::program
