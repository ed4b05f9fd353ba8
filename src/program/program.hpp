// The base of all programs: help, version, standard streams, exit codes.
#pragma once

#include <CLI/CLI.hpp>
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

}  // namespace dynains::program
