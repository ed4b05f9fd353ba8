// The base of all programs: help, version, standard streams, exit codes, and how far they are.
#pragma once

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstddef>
#include <string>

namespace dynains::program {

/// A command line with the flags --version, --help (the options that matter) and --help-all (the
/// rest, grouped). Subcommands take them over.
class Program : public CLI::App {
 public:
  Program(const std::string& description, const std::string& name);

  /// Runs the callbacks of the command line, and prints errors. Returns the exit code.
  int run(int argc, char** argv);

 private:
  int fail(int code, const std::string& what) const;
  int print_help(const CLI::Success& success) const;
};

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
