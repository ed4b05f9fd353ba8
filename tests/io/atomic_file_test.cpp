#include "dynains/io/atomic_file.hpp"

#include <sys/resource.h>

#include <csignal>

#include "io/files.hpp"
#include "support/catch.hpp"

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

TEST_CASE("Small and large writes come in their order") {
  TemporaryFolder folder;
  const std::string small = "small", large(100000, 'l'), buffer(std::size_t{1} << 16, 'b');
  AtomicFile file(folder / "a.txt");
  file.stream() << small << large << small << buffer << buffer << small;
  file.commit();
  CHECK(read_text(folder / "a.txt") == small + large + small + buffer + buffer + small);
}

TEST_CASE("Files can be synced to the disk later, all at once") {
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

  // Renaming over a device would remove it.
  const std::string device = message_of<IoError>([] { AtomicFile file("/dev/null"); });
  CHECK_THAT(device, ContainsSubstring("/dev/null") && ContainsSubstring("regular file"));
}

TEST_CASE("AtomicFile reports why a file could not be written, and keeps the target") {
  TemporaryFolder folder;
  const fs::path target = folder / "a.txt";
  write_text(target, "old");
  rlimit before{};
  REQUIRE(::getrlimit(RLIMIT_FSIZE, &before) == 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{1000, before.rlim_max};
  REQUIRE(::setrlimit(RLIMIT_FSIZE, &small) == 0);
  const std::string text = message_of<IoError>([&] {
    AtomicFile file(target);
    file.stream() << std::string(100000, 'x');
    file.commit();
  });
  ::setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  CHECK_THAT(text, ContainsSubstring("a.txt: cannot be written to the end: File too large"));
  CHECK(read_text(target) == "old");
  CHECK(count_entries(folder.path()) == 1);
}

TEST_CASE("Two writers of one file use different temporary files and never follow links") {
  TemporaryFolder folder;
  const fs::path victim = folder / "victim";
  write_text(victim, "precious");
  fs::create_symlink(victim, folder / (".a.txt." + std::to_string(::getpid()) + ".tmp"));
  auto first = std::make_unique<AtomicFile>(folder / "a.txt");
  {
    AtomicFile second(folder / "a.txt");
    first->stream() << "first";
    second.stream() << "second";
    second.commit();
  }
  CHECK(read_text(folder / "a.txt") == "second");
  first->commit();
  CHECK(read_text(folder / "a.txt") == "first");
  CHECK(read_text(victim) == "precious");
  CHECK(count_entries(folder.path()) == 3);
}

TEST_CASE("Names of temporary files give the name of the file, and other names do not") {
  CHECK(target_of_temporary(".a.txt.0123456789abcdef.tmp") == "a.txt");
  CHECK(target_of_temporary("..x.0123456789abcdef.tmp") == ".x");
  for (const char* other :
       {".notes.2024.tmp", "a.txt.0123456789abcdef.tmp", ".a.txt.0123456789abcdeg.tmp",
        ".a.txt.0123456789abcde.tmp", ".a.txt.0123456789abcdef.temp", ".0123456789abcdef.tmp",
        "..0123456789abcdef.tmp", "", ".tmp", "."}) {
    CAPTURE(other);
    CHECK(target_of_temporary(other).empty());
  }
}
