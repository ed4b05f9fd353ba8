// Starts the dynains program and sees what comes back.
#pragma once

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <stdexcept>
#include <string>
#include <vector>

#include "io/files.hpp"

namespace dynains::test {

struct Outcome {
  int code;         ///< exit code; 128 + signal if a signal killed it
  std::string out;  ///< standard output
  std::string err;  ///< standard error
};

/// A running `dynains ARGUMENTS`, both outputs piped into files.
class Process {
 public:
  explicit Process(std::vector<std::string> arguments) {
    std::vector<char*> argv;
    arguments.insert(arguments.begin(), DYNAINS_PROGRAM);
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    const std::string out = folder_ / "out";
    const std::string err = folder_ / "err";
    id_ = ::fork();
    if (id_ < 0) throw std::runtime_error("fork failed");
    if (id_ > 0) return;
    redirect(out, STDOUT_FILENO);
    redirect(err, STDERR_FILENO);
    ::execv(DYNAINS_PROGRAM, argv.data());
    ::_exit(127);
  }
  ~Process() {
    if (id_ > 0) wait();
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  pid_t id() const { return id_; }

  Outcome wait() {
    int status = 0;
    ::waitpid(id_, &status, 0);
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
};

inline Outcome start(const std::vector<std::string>& arguments) {
  return Process(arguments).wait();
}

}  // namespace dynains::test
