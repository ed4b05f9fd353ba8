#include "dynains/io/atomic_file.hpp"

#include <iostream>

#include "dynains/errors.hpp"
#include "io/files.hpp"
#include "support/catch.hpp"

namespace fs = std::filesystem;
using namespace dynains;
using namespace dynains::test;

TEST_CASE("AtomicFile replaces the target at commit and not before") {
  TemporaryFolder folder;
  const fs::path target = folder / "a.txt";
  write_text(target, "old");
  {
    AtomicFile file(target);
    file.stream() << "new";
    file.stream().flush();
    CHECK(read_text(target) == "old");
    file.commit();
    CHECK(read_text(target) == "new");
  }
  CHECK(read_text(target) == "new");
  CHECK(count_entries(folder.path()) == 1);
}

TEST_CASE("Files can be brought to the disk later, all at once") {
  TemporaryFolder folder;
  AtomicFile file(folder / "a.txt");
  file.stream() << "new";
  file.commit(AtomicFile::Sync::kLater);
  CHECK(read_text(folder / "a.txt") == "new");
  sync_files(folder.path());
  CHECK_THAT(message_of<IoError>([&] { sync_files(folder / "none"); }),
             ContainsSubstring("none: cannot be written to the disk: No such file"));
}

TEST_CASE("AtomicFile without commit leaves no trace") {
  TemporaryFolder folder;
  {
    AtomicFile file(folder / "a.txt");
    file.stream() << "half";
    file.stream().flush();
    CHECK(count_entries(folder.path()) == 1);
  }
  CHECK(count_entries(folder.path()) == 0);
}

TEST_CASE("AtomicFile follows a symbolic link") {
  TemporaryFolder folder;
  write_text(folder / "real/a.txt", "old");
  fs::create_symlink(folder / "real/a.txt", folder / "link.txt");
  AtomicFile file(folder / "link.txt");
  file.stream() << "new";
  file.commit();
  CHECK(fs::is_symlink(folder / "link.txt"));
  CHECK(read_text(folder / "real/a.txt") == "new");
}

TEST_CASE("AtomicFile refuses targets that it cannot replace, and names them") {
  TemporaryFolder folder;
  const std::string missing =
      message_of<IoError>([&] { AtomicFile file(folder / "no/such/folder.txt"); });
  CHECK_THAT(missing, ContainsSubstring("no/such/folder.txt") &&
                          ContainsSubstring("No such file or directory"));

  const std::string is_folder = message_of<IoError>([&] { AtomicFile file(folder.path()); });
  CHECK_THAT(is_folder,
             ContainsSubstring(folder.path().string()) && ContainsSubstring("regular file"));

  // Renaming over a device would destroy it.
  const std::string device = message_of<IoError>([] { AtomicFile file("/dev/null"); });
  CHECK_THAT(device, ContainsSubstring("/dev/null") && ContainsSubstring("regular file"));
}

TEST_CASE("AtomicFile reports a full disk and keeps the target") {
  // Every write to /dev/full fails; a link in the place of the temporary leads there.
  if (!fs::exists("/dev/full")) {
    std::cout << "SKIPPED: no /dev/full here" << std::endl;
    return;
  }
  TemporaryFolder folder;
  const fs::path target = folder / "a.txt";
  write_text(target, "old");
  const fs::path temporary = folder / (".a.txt." + std::to_string(::getpid()) + ".tmp");
  fs::create_symlink("/dev/full", temporary);
  const std::string text = message_of<IoError>([&] {
    AtomicFile file(target);
    file.stream() << std::string(100000, 'x');
    file.commit();
  });
  CHECK_THAT(text, ContainsSubstring("a.txt") && ContainsSubstring("No space left on device"));
  CHECK(read_text(target) == "old");
  CHECK(count_entries(folder.path()) == 1);
}
