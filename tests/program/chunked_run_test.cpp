// Runs in chunks whose input fails while they last.
#include <cstddef>
#include <filesystem>
#include <string>

#include "dynains/errors.hpp"
#include "io/files.hpp"
#include "program/tiny_sequence.hpp"
#include "run/run.hpp"
#include "support/catch.hpp"

using namespace dynains;
using namespace dynains::program;
using namespace dynains::test;
namespace fs = std::filesystem;

namespace {

RunSettings settings_for(const TemporaryFolder& folder) {
  RunSettings settings;
  settings.recording = folder / "seq";
  settings.out = folder / "out";
  settings.config.evidence.lookahead_scans = 3;
  settings.chunk = 5;
  settings.lookback = 2;
  settings.jobs = 2;
  return settings;
}

}  // namespace

TEST_CASE("a scan that vanishes ends a run in chunks with its name; finished chunks stay") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "seq", 40);
  const fs::path vanishing = folder / "seq/velodyne/000033.bin";
  const fs::path aside = folder / "seq/aside.bin";
  RunSettings settings = settings_for(folder);
  RunListener listener;
  listener.progress = [&](std::size_t done, std::size_t) {
    if (done == 0 && fs::exists(vanishing)) fs::rename(vanishing, aside);
  };
  CHECK_THAT(message_of<IoError>([&] { run(settings, Recording(settings.recording), listener); }),
             ContainsSubstring("000033.bin"));
  CHECK(fs::exists(folder / "out/chunks/000000.chunk"));
  CHECK_FALSE(fs::exists(folder / "out/chunks/000030.chunk"));

  fs::rename(aside, vanishing);
  settings.resume = true;
  listener.progress = nullptr;
  const RunOutcome outcome = run(settings, Recording(settings.recording), listener);
  CHECK(outcome.complete);
  CHECK(outcome.scans == 40);
  CHECK_FALSE(fs::exists(folder / "out/chunks"));
  CHECK(count_entries(folder / "out/labels") == 40);
}

TEST_CASE("a caller's exception ends a run in chunks") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "seq", 20);
  const RunSettings settings = settings_for(folder);
  RunListener listener;
  listener.progress = [](std::size_t done, std::size_t) {
    if (done > 0) throw UsageError("stop");
  };
  CHECK(message_of<UsageError>([&] { run(settings, Recording(settings.recording), listener); }) ==
        "stop");
}
