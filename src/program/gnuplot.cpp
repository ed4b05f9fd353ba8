#include "gnuplot.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>

#include "dynains/errors.hpp"
#include "dynains/io/atomic_file.hpp"

extern char** environ;

namespace dynains::program {
namespace {

namespace fs = std::filesystem;

/// File actions of posix_spawn(): standard input, standard output and working folder.
class SpawnActions {
 public:
  SpawnActions(const fs::path& folder, const fs::path& input, const fs::path& output) {
    posix_spawn_file_actions_init(&actions_);
    posix_spawn_file_actions_addopen(&actions_, STDIN_FILENO, input.c_str(), O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions_, STDOUT_FILENO, output.c_str(), O_WRONLY | O_TRUNC,
                                     0);
    posix_spawn_file_actions_addchdir_np(&actions_, folder.c_str());
  }
  ~SpawnActions() { posix_spawn_file_actions_destroy(&actions_); }
  SpawnActions(const SpawnActions&) = delete;
  SpawnActions& operator=(const SpawnActions&) = delete;

  const posix_spawn_file_actions_t* get() const { return &actions_; }

 private:
  posix_spawn_file_actions_t actions_{};
};

}  // namespace

void draw_by_gnuplot(const fs::path& script, const fs::path& picture) {
  const fs::path whole = fs::absolute(script);
  AtomicFile file(picture);
  // From standard input, so that messages of gnuplot have no path.
  const SpawnActions actions(whole.parent_path(), whole, fs::absolute(file.temporary_path()));
  std::string words[] = {"gnuplot", "-d"};  // without settings of the user
  char* const arguments[] = {words[0].data(), words[1].data(), nullptr};
  pid_t process = 0;
  const int error = posix_spawnp(&process, "gnuplot", actions.get(), nullptr, arguments, environ);
  if (error == ENOENT) {
    throw IoError(picture.string() +
                  ": gnuplot, which draws it, is not installed (Debian: gnuplot-nox); " +
                  script.string() + " and its data are written");
  }
  if (error != 0) throw IoError(picture.string() + ": gnuplot cannot be started");
  int status = 0;
  while (::waitpid(process, &status, 0) < 0 && errno == EINTR) {
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    throw IoError(script.string() + ": gnuplot does not draw this script");
  }
  file.commit();
}

std::string gnuplot_text(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    const bool is_plain = byte > 0x1F && byte != 0x7F && c != '"' && c != '\\' && c != '`';
    quoted += is_plain ? c : '?';
  }
  return quoted + '"';
}

}  // namespace dynains::program
