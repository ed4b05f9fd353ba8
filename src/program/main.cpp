#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <exception>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>

#include "command.hpp"
#include "dynains/errors.hpp"
#include "dynains/version.hpp"
#include "odometry_command.hpp"
#include "run/interrupt.hpp"
#include "run/printable.hpp"

namespace {

/// Help in two lengths: --help with the options that matter, --help-all with the rest, grouped.
class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_help(const CLI::App* app, std::string name,
                        CLI::AppFormatMode mode) const override {
    if (mode != CLI::AppFormatMode::Normal) return CLI::Formatter::make_help(app, name, mode);
    const auto main_options = app->get_options([](const CLI::Option* option) {
      return option->get_group() == kMainGroup && option->nonpositional();
    });
    std::string text = make_description(app) + make_usage(app, name) + make_positionals(app) +
                       make_group(kMainGroup, false, main_options) + make_subcommands(app, mode);
    const std::string more = other_groups(*app);
    if (!more.empty()) text += "\nMore options by --help-all: " + more + '\n';
    return text + '\n' + make_footer(app);
  }

 private:
  static constexpr const char* kMainGroup = "Options";  // of options without another one

  static std::string other_groups(const CLI::App& app) {
    std::string names;
    for (const std::string& group : app.get_groups()) {
      if (group.empty() || group == kMainGroup) continue;
      names += (names.empty() ? "" : ", ") + group;
    }
    return names;
  }
};

using namespace dynains::program;

// A file that is opened later must never get the number of a standard stream: printed text would go
// into the file.
void open_standard_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    // The lowest free number, which is that of the stream.
    if (::fcntl(stream, F_GETFD) < 0 && ::open("/dev/null", O_RDWR) != stream)
      ::_exit(kExitFailure);
  }
}

// Whether standard output is a pipe whose reader has ended, such as `head`. This is no failure.
bool reader_has_left() {
  pollfd output{STDOUT_FILENO, POLLOUT, 0};
  return ::poll(&output, 1, 0) > 0 && (output.revents & POLLERR) != 0;
}

/// Throws IoError if standard output cannot take all that was printed.
void flush_output() {
  if (!std::cout.flush() && !reader_has_left()) {
    throw dynains::IoError("standard output: cannot be written");
  }
}

int fail(int code, const std::string& what) {
  std::cerr << "dynains: error: " << on_one_line(what) << '\n';
  return code;
}

int print_help(const CLI::App& app, const CLI::Success& success) {
  const int code = app.exit(success);
  try {
    flush_output();
  } catch (const dynains::IoError& error) {
    return fail(kExitFailure, error.what());
  }
  return code;
}

/// The first path of the command line, for errors that do not know it.
std::string place_of(const CLI::App& app) {
  for (const CLI::App* const command : app.get_subcommands()) {
    for (const CLI::Option* const option : command->get_options()) {
      if (option->get_positional() && option->count() > 0) return option->results().front() + ": ";
    }
  }
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  open_standard_streams();
  // A closed pipe must not stop a run that writes files.
  std::signal(SIGPIPE, SIG_IGN);
  const PrintableStream printable_output(std::cout);
  const PrintableStream printable_errors(std::cerr);

  CLI::App app("Removes moving objects from LiDAR scans and maps, scan by scan.", "dynains");
  app.set_version_flag("--version", std::string("dynains ") + dynains::kVersionString);
  app.require_subcommand(0, 1);
  app.formatter(std::make_shared<HelpFormatter>());
  app.get_formatter()->column_width(36);
  app.set_help_all_flag("--help-all", "print the help with all options and exit");
  add_run_command(app);
  add_remap_command(app);
  add_clean_command(app);
  add_map_command(app);
  add_fleet_command(app);
  add_check_command(app);
  add_odometry_command(app);
  add_config_command(app);
  add_simulate_command(app);
  add_eval_command(app);
  add_experiment_command(app);
  add_view_command(app);

  try {
    app.parse(argc, argv);
    flush_output();
    if (app.get_subcommands().empty()) {
      return fail(kExitUsage, "expected a command, for example run (see dynains --help)");
    }
  } catch (const CLI::Success& success) {
    return print_help(app, success);
  } catch (const CLI::ParseError& error) {
    return fail(kExitUsage, error.what() + std::string(" (see dynains --help)"));
  } catch (const dynains::ConfigError& error) {
    return fail(kExitUsage, error.what());
  } catch (const dynains::UsageError& error) {
    return fail(kExitUsage, error.what());
  } catch (const LostTrack& lost) {
    return fail(kExitLostTrack, lost.what());
  } catch (const Finding&) {
    return kExitFailure;
  } catch (const Interrupted& interrupted) {
    return 128 + interrupted.signal;
  } catch (const std::filesystem::filesystem_error& error) {
    const std::string path = error.path1().empty() ? "\"\"" : error.path1().string();
    return fail(kExitFailure, path + ": " + error.code().message());
  } catch (const std::bad_alloc&) {
    return fail(kExitFailure, place_of(app) + "out of memory");
  } catch (const std::exception& error) {
    return fail(kExitFailure, error.what());
  }
  return 0;
}
