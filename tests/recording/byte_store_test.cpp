#include "dynains/recording/byte_store.hpp"

#include "dynains/errors.hpp"
#include "io/files.hpp"
#include "support/catch.hpp"

using namespace dynains;
using namespace dynains::test;

TEST_CASE("a byte store gives its bytes back, and no folder lists it") {
  const TemporaryFolder folder;
  ByteStore file(folder.path());
  const std::vector<std::uint8_t> first = {1, 2, 3}, second(100000, 7);
  CHECK(file.append(first) == 0);
  CHECK(file.append(second) == 3);
  CHECK(count_entries(folder.path()) == 0);  // nothing is left when the process is killed
  std::vector<std::uint8_t> bytes;
  file.read(3, second.size(), bytes);
  CHECK(bytes == second);
  file.read(0, 3, bytes);
  CHECK(bytes == first);
  CHECK_THROWS_AS(file.read(99999, 100, bytes), IoError);
}
