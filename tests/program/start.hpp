// Starts dynains or dynains_simulate and returns its exit code and output.
#pragma once

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

#include "io/files.hpp"
#include "support/catch.hpp"

namespace dynains::test {

using Arguments = std::vector<std::string>;

inline Arguments operator+(Arguments left, const Arguments& right) {
  left.insert(left.end(), right.begin(), right.end());
  return left;
}

struct Outcome {
  int code;         ///< exit code; 128 + signal if a signal killed it
  std::string out;  ///< standard output
  std::string err;  ///< standard error
};

/// A running `dynains ARGUMENTS`, or `dynains_simulate` with the arguments that follow "simulate",
/// with both outputs redirected to files. `prepare` is called in the new process, before the
/// program starts.
class Process {
 public:
  explicit Process(
      Arguments arguments, const std::function<void()>& prepare = [] {}) {
    std::vector<char*> argv;
    if (!arguments.empty() && arguments[0] == "simulate") {
      arguments[0] = DYNAINS_PROGRAM "_simulate";
    } else {
      arguments.insert(arguments.begin(), DYNAINS_PROGRAM);
    }
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    const std::string out = folder_ / "out";
    const std::string err = folder_ / "err";
    id_ = ::fork();
    if (id_ < 0) throw std::runtime_error("fork failed");
    if (id_ > 0) return;
    redirect(out, STDOUT_FILENO);
    redirect(err, STDERR_FILENO);
    // A script that starts tests with `&` makes them ignore SIGINT.
    for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, SIG_DFL);
    prepare();
    ::execv(argv[0], argv.data());
    ::_exit(127);
  }
  ~Process() {
    if (id_ > 0) wait();
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  pid_t id() const { return id_; }
  /// Bytes in memory at most; known after wait().
  std::size_t peak_memory() const { return peak_memory_; }

  Outcome wait() {
    int status = 0;
    rusage usage{};
    ::wait4(id_, &status, 0, &usage);
    peak_memory_ = 1024 * static_cast<std::size_t>(usage.ru_maxrss);
    id_ = 0;
    const int code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    return {code, read_text(folder_ / "out"), read_text(folder_ / "err")};
  }

 private:
  static void redirect(const std::string& file, int descriptor) {
    const int to = ::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    ::dup2(to, descriptor);
    ::close(to);
  }

  TemporaryFolder folder_;
  pid_t id_ = 0;
  std::size_t peak_memory_ = 0;
};

inline Outcome start(
    const Arguments& arguments, const std::function<void()>& prepare = [] {}) {
  return Process(arguments, prepare).wait();
}

/// Requires exit code 0.
inline Outcome succeed(Outcome outcome) {
  INFO(outcome.err);
  REQUIRE(outcome.code == 0);
  return outcome;
}

/// Checks the exit code of a command that failed, and that its message has these words.
inline void check_refused(const Outcome& outcome, int code, const std::string& words) {
  CHECK(outcome.code == code);
  CHECK_THAT(outcome.err, ContainsSubstring(words));
}

/// Checks the exit code of a command, and that its standard output has these words.
inline void check_says(const Outcome& outcome, int code, const std::string& words) {
  INFO(outcome.err);
  CHECK(outcome.code == code);
  CHECK_THAT(outcome.out, ContainsSubstring(words));
}

/// Checks that a command succeeded, with these words on standard error.
inline void check_warns(const Outcome& outcome, const std::string& words) {
  check_refused(outcome, 0, words);
}

/// Checks that a command failed with one line of error, which has these words, and no output.
inline void check_one_error(const Outcome& outcome, int code, const std::string& words) {
  check_refused(outcome, code, words);
  CHECK_THAT(outcome.err, StartsWith("dynains: error: "));
  CHECK(count_lines(outcome.err) == 1);
  CHECK(outcome.out.empty());
}

/// Output of `dynains ARGUMENTS` on a pseudo-terminal. Throws unless the exit code is 0.
inline std::string show_on_terminal(const Arguments& arguments) {
  const int screen = ::posix_openpt(O_RDWR | O_NOCTTY);
  if (screen < 0 || ::grantpt(screen) != 0 || ::unlockpt(screen) != 0) {
    throw std::runtime_error("no pseudo terminal");
  }
  const std::string terminal = ::ptsname(screen);
  Process process(arguments, [&] {
    const int to = ::open(terminal.c_str(), O_RDWR | O_NOCTTY);
    for (const int stream : {STDOUT_FILENO, STDERR_FILENO}) ::dup2(to, stream);
    for (const int descriptor : {to, screen}) ::close(descriptor);
  });
  // read() fails if no process has the other end open: after the child has ended, and also before
  // it has opened the terminal.
  std::string shown;
  siginfo_t end{};
  while (true) {
    char part[256];
    const ssize_t count = ::read(screen, part, sizeof(part));
    if (count > 0) {
      shown.append(part, static_cast<std::size_t>(count));
    } else if (end.si_pid != 0) {
      break;
    } else {
      ::waitid(P_PID, static_cast<id_t>(process.id()), &end, WEXITED | WNOHANG | WNOWAIT);
      ::usleep(1000);
    }
  }
  ::close(screen);
  if (process.wait().code != 0) throw std::runtime_error(shown);
  return shown;
}

}  // namespace dynains::test
