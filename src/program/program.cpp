#include "program.hpp"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <locale>
#include <memory>
#include <sstream>
#include <streambuf>
#include <utility>

#include "command.hpp"
#include "dynains/errors.hpp"
#include "dynains/version.hpp"
#include "run/interrupt.hpp"

namespace dynains::program {
namespace {

constexpr unsigned char kLeadOfControls = 0xC2;  // first byte of U+0080 to U+00BF

std::string escaped(unsigned char c) {
  std::array<char, 5> code{};
  std::snprintf(code.data(), code.size(), "\\x%02X", static_cast<unsigned>(c));
  return code.data();
}

bool is_control(unsigned char c) { return (c < 0x20 && c != '\n' && c != '\t') || c == 0x7F; }

/// Replaces control characters by \xNN, so that file names cannot steer a terminal. Line feeds and
/// tabs stay; UTF-8 stays, except its control characters (U+0080 to U+009F).
class PrintableStream : std::streambuf {
 public:
  /// Filters `stream` as long as this object lives.
  explicit PrintableStream(std::ostream& stream) : stream_(stream), target_(stream.rdbuf(this)) {}
  ~PrintableStream() override { stream_.rdbuf(target_); }
  PrintableStream(const PrintableStream&) = delete;
  PrintableStream& operator=(const PrintableStream&) = delete;

 private:
  int_type overflow(int_type value) override {
    if (traits_type::eq_int_type(value, traits_type::eof())) return traits_type::not_eof(value);
    const auto c = static_cast<unsigned char>(value);
    const bool is_second = std::exchange(has_lead_, c == kLeadOfControls);
    const bool ends_control = is_second && c >= 0x80 && c < 0xA0;
    std::string shown;
    if (is_second) shown += ends_control ? escaped(kLeadOfControls) : std::string(1, '\xC2');
    if (ends_control || is_control(c)) {
      shown += escaped(c);
    } else if (!has_lead_) {
      shown += static_cast<char>(c);
    }
    const auto size = static_cast<std::streamsize>(shown.size());
    return target_->sputn(shown.data(), size) == size ? value : traits_type::eof();
  }
  int sync() override { return target_->pubsync(); }

  std::ostream& stream_;
  std::streambuf* target_;
  bool has_lead_ = false;  ///< the first byte of U+0080 to U+00BF waits for the second
};

/// The text on one line: line feeds and tabs become \n and \t.
std::string on_one_line(const std::string& text) {
  std::string line;
  for (const char c : text) {
    if (c == '\n') {
      line += "\\n";
    } else if (c == '\t') {
      line += "\\t";
    } else {
      line += c;
    }
  }
  return line;
}

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
  /// A command within another one comes behind what that one takes.
  std::string make_usage(const CLI::App* app, std::string name) const override {
    std::string before;
    if (const CLI::App* const outer = app->get_parent()) {
      for (const CLI::Option* const option : outer->get_options()) {
        if (option->get_positional()) before += make_option_usage(option) + ' ';
      }
    }
    name.insert(name.size() - app->get_name().size(), before);
    return CLI::Formatter::make_usage(app, name);
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
    throw IoError("standard output: cannot be written");
  }
}

/// The first path of the command line, for errors that do not know it.
std::string place_of(const CLI::App& app) {
  for (const CLI::Option* const option : app.get_options()) {
    if (option->get_positional() && option->count() > 0) return option->results().front() + ": ";
  }
  for (const CLI::App* const command : app.get_subcommands()) return place_of(*command);
  return {};
}

/// The command that was given, whose help has its arguments: for example `dynains map CITY at`.
std::string command_of(const CLI::App& app) {
  std::string text = app.get_name();
  for (const CLI::App* const command : app.get_subcommands()) {
    for (const CLI::Option* const option : app.get_options()) {
      if (option->get_positional() && option->count() > 0) text += ' ' + option->results().front();
    }
    return text + ' ' + command_of(*command);
  }
  return text;
}

}  // namespace

Program::Program(const std::string& description, const std::string& name)
    : CLI::App(description, name) {
  set_version_flag("--version", name + ' ' + kVersionString);
  formatter(std::make_shared<HelpFormatter>());
  get_formatter()->column_width(36);
  set_help_all_flag("--help-all", "print the help with all options and exit");
}

int Program::fail(int code, const std::string& what) const {
  std::cerr << get_name() << ": error: " << on_one_line(what) << '\n';
  return code;
}

int Program::print_help(const CLI::Success& success) const {
  const int code = CLI::App::exit(success);
  try {
    flush_output();
  } catch (const IoError& error) {
    return fail(kExitFailure, error.what());
  }
  return code;
}

int Program::run(int argc, char** argv) {
  open_standard_streams();
  // A closed pipe must not stop a run that writes files.
  std::signal(SIGPIPE, SIG_IGN);
  const PrintableStream printable_output(std::cout);
  const PrintableStream printable_errors(std::cerr);
  try {
    parse(argc, argv);
    flush_output();
  } catch (const CLI::Success& success) {
    return print_help(success);
  } catch (const CLI::ExtrasError&) {  // whose own text has them in reverse order
    return fail(kExitUsage, "not known here: " + CLI::detail::join(remaining(true), " ") +
                                " (see " + command_of(*this) + " --help-all)");
  } catch (const CLI::ParseError& error) {
    return fail(kExitUsage, error.what() + std::string(" (see ") + command_of(*this) + " --help)");
  } catch (const ConfigError& error) {
    return fail(kExitUsage, error.what());
  } catch (const UsageError& error) {
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
    return fail(kExitFailure, place_of(*this) + "out of memory");
  } catch (const std::exception& error) {
    return fail(kExitFailure, error.what());
  }
  return 0;
}

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
