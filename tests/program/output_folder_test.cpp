#include "output_folder.hpp"

#include "dynains/errors.hpp"
#include "io/files.hpp"
#include "support/catch.hpp"

using namespace dynains;
using namespace dynains::program;
using namespace dynains::test;
namespace fs = std::filesystem;

namespace {

const OutputFiles kOurs{"marker", {"a.txt"}, {"labels"}, {".label"}};

std::string refusal(const TemporaryFolder& folder, bool force) {
  return message_of<IoError>([&] { check_output_folder(folder.path(), kOurs, force); });
}

}  // namespace

TEST_CASE("An empty folder is taken") {
  TemporaryFolder folder;
  CHECK(refusal(folder, false) == "(nothing was thrown)");
}

TEST_CASE("Earlier results are replaced only by force") {
  TemporaryFolder folder;
  write_text(folder / "marker", "");
  CHECK_THAT(refusal(folder, false), ContainsSubstring("holds earlier results"));
  CHECK(refusal(folder, true) == "(nothing was thrown)");
}

TEST_CASE("Somebody's folder is refused by force as well") {
  TemporaryFolder folder;
  write_text(folder / "labels/000000.label", "precious");
  CHECK_THAT(refusal(folder, false), ContainsSubstring("no earlier results (no marker)"));
  CHECK_THAT(refusal(folder, true), ContainsSubstring("no earlier results (no marker)"));
  CHECK(read_text(folder / "labels/000000.label") == "precious");
}

TEST_CASE("Clearing removes results and nothing else") {
  TemporaryFolder folder;
  for (const char* name :
       {"marker", "a.txt", "mine.txt", "labels/000000.label", "labels/mine.txt"}) {
    write_text(folder / name, "old");
  }
  clear_output_folder(folder.path(), kOurs, "new");
  CHECK(read_text(folder / "marker") == "new");
  CHECK_FALSE(fs::exists(folder / "a.txt"));
  CHECK_FALSE(fs::exists(folder / "labels/000000.label"));
  CHECK(read_text(folder / "mine.txt") == "old");
  CHECK(read_text(folder / "labels/mine.txt") == "old");
}

TEST_CASE("A folder below a file cannot be created") {
  TemporaryFolder folder;
  write_text(folder / "file", "");
  CHECK_THAT(message_of<IoError>([&] { create_folder(folder / "file/below"); }),
             ContainsSubstring("file/below: cannot be created: Not a directory"));
}
