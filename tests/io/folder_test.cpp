#include "io/folder.hpp"

#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

#include "io/files.hpp"
#include "support/catch.hpp"

using namespace dynains;
using namespace dynains::test;

namespace {

Folder locked(const fs::path& path, Folder::Lock how = Folder::Lock::kExclusive) {
  Folder folder(path);
  folder.lock(how);
  return folder;
}

std::string refusal(const fs::path& folder, Folder::Lock how = Folder::Lock::kExclusive) {
  return message_of<UsageError>([&] { locked(folder, how); });
}

}  // namespace

TEST_CASE("a folder has one lock at a time for all its paths, and no lock file") {
  const TemporaryFolder folder;
  fs::create_directory(folder / "a");
  fs::create_directory_symlink(folder / "a", folder / "link");
  std::optional<Folder> lock(locked(folder / "a"));
  CHECK(refusal(folder / "a") ==
        (folder / "a").string() +
            ": is in use; expected a folder that nobody else writes to at the same time");
  CHECK_THAT(refusal(folder / "link"), ContainsSubstring("link: is in use"));
  CHECK(refusal(folder.path()) == "(nothing was thrown)");
  CHECK(fs::is_empty(folder / "a"));
  lock.reset();
  CHECK(refusal(folder / "a") == "(nothing was thrown)");
}

TEST_CASE("shared locks exclude an exclusive one, not each other") {
  const TemporaryFolder folder;
  std::optional<Folder> first(locked(folder.path(), Folder::Lock::kShared));
  std::optional<Folder> second(locked(folder.path(), Folder::Lock::kShared));
  first.reset();
  CHECK_THAT(refusal(folder.path()), ContainsSubstring("is in use"));
  second.reset();
  const Folder exclusive = locked(folder.path());
  CHECK_THAT(refusal(folder.path(), Folder::Lock::kShared), ContainsSubstring("is in use"));
}

TEST_CASE("a lock ends with its process, also by kill -9") {
  const TemporaryFolder folder;
  int ends[2];
  REQUIRE(::pipe(ends) == 0);
  const pid_t child = ::fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    const Folder lock = locked(folder.path());
    if (::write(ends[1], "+", 1) == 1) ::pause();
    ::_exit(0);
  }
  char byte = 0;
  REQUIRE(::read(ends[0], &byte, 1) == 1);
  CHECK_THAT(refusal(folder.path()), ContainsSubstring("is in use"));
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  CHECK(refusal(folder.path()) == "(nothing was thrown)");
  ::close(ends[0]);
  ::close(ends[1]);
}
