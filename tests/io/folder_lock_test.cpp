#include "dynains/io/folder_lock.hpp"

#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <optional>
#include <string>
#include <utility>

#include "dynains/errors.hpp"
#include "io/files.hpp"
#include "support/catch.hpp"

using namespace dynains;
using namespace dynains::test;
namespace fs = std::filesystem;

namespace {

std::string refusal(const fs::path& folder) {
  return message_of<UsageError>([&] { FolderLock{folder}; });
}

}  // namespace

TEST_CASE("a folder has one lock at a time for all its paths, and no lock file") {
  const TemporaryFolder folder;
  fs::create_directory(folder / "a");
  fs::create_directory_symlink(folder / "a", folder / "link");
  std::optional<FolderLock> lock(folder / "a");
  CHECK(refusal(folder / "a") ==
        (folder / "a").string() +
            ": is in use; expected a folder that nobody else writes to at the same time");
  CHECK_THAT(refusal(folder / "link"), ContainsSubstring("link: is in use"));
  CHECK(refusal(folder.path()) == "(nothing was thrown)");
  CHECK(fs::is_empty(folder / "a"));
  lock.reset();
  CHECK(refusal(folder / "a") == "(nothing was thrown)");
}

TEST_CASE("a moved lock stays held") {
  const TemporaryFolder folder;
  fs::create_directory(folder / "a");
  std::optional<FolderLock> lock;
  {
    FolderLock first(folder / "a");
    lock.emplace(std::move(first));
  }
  CHECK_THAT(refusal(folder / "a"), ContainsSubstring("is in use"));
  lock = FolderLock(folder.path());
  CHECK(refusal(folder / "a") == "(nothing was thrown)");
  CHECK_THAT(refusal(folder.path()), ContainsSubstring("is in use"));
}

TEST_CASE("shared locks exclude an exclusive one, not each other") {
  const TemporaryFolder folder;
  std::optional<FolderLock> first(std::in_place, folder.path(), FolderLock::Mode::kShared);
  std::optional<FolderLock> second(std::in_place, folder.path(), FolderLock::Mode::kShared);
  first.reset();
  CHECK_THAT(refusal(folder.path()), ContainsSubstring("is in use"));
  second.reset();
  const FolderLock exclusive(folder.path());
  CHECK_THAT(message_of<UsageError>([&] {
               FolderLock{folder.path(), FolderLock::Mode::kShared};
             }),
             ContainsSubstring("is in use"));
}

TEST_CASE("a lock ends with its process, also by kill -9") {
  const TemporaryFolder folder;
  int locked[2];
  REQUIRE(::pipe(locked) == 0);
  const pid_t child = ::fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    const FolderLock lock(folder.path());
    if (::write(locked[1], "+", 1) == 1) ::pause();
    ::_exit(0);
  }
  char byte = 0;
  REQUIRE(::read(locked[0], &byte, 1) == 1);
  CHECK_THAT(refusal(folder.path()), ContainsSubstring("is in use"));
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  CHECK(refusal(folder.path()) == "(nothing was thrown)");
  ::close(locked[0]);
  ::close(locked[1]);
}

TEST_CASE("only a folder can be locked") {
  const TemporaryFolder folder;
  write_text(folder / "file", "");
  for (const char* name : {"file", "nothing"}) {
    CHECK_THAT(message_of<IoError>([&] { FolderLock{folder / name}; }),
               StartsWith((folder / name).string() + ": cannot be opened: "));
  }
}
