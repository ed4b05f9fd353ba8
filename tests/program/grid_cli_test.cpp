#include <filesystem>
#include <string>

#include "io/files.hpp"
#include "program/start.hpp"
#include "program/tiny_sequence.hpp"
#include "support/catch.hpp"

using namespace dynains::test;
namespace fs = std::filesystem;

TEST_CASE("a run, its results and its map give grids, whole or not at all") {
  const TemporaryFolder folder;
  const std::string seq = folder / "seq", out = folder / "out";
  write_tiny_sequence(seq, 24);  // the box comes to each place in three scans
  const Outcome run = succeed(start({"run", seq, "--out", out, "--grid", folder / "a.yaml"}));
  CHECK_THAT(run.out, ContainsSubstring("grid: " + (folder / "a.yaml").string() + " ("));
  succeed(start({"grid", out, "-o", folder / "b.yaml", "-q"}));
  CHECK((read_text(folder / "a.pgm") == read_text(folder / "b.pgm")));
  CHECK_THAT(read_text(folder / "b.yaml"), ContainsSubstring("image: \"b.pgm\""));
  succeed(start({"grid", out + "/static_map.ply", "-o", folder / "c.yaml"}));
  CHECK(fs::exists(folder / "c.pgm"));

  check_refused(start({"grid", out, "-o", folder / "b.yaml"}), 1, "exists");
  succeed(start({"grid", out, "-o", folder / "b.yaml", "--force", "--keep-moving"}));
  CHECK((read_text(folder / "a.pgm") != read_text(folder / "b.pgm")));
  // The results that are replaced have written that grid.
  succeed(start({"run", seq, "--out", out, "--grid", folder / "a.yaml", "--force"}));
  fs::create_directory(folder / "d.pgm");
  check_refused(start({"grid", out, "-o", folder / "d.yaml"}), 1, "d.pgm: is a link or a folder");
  CHECK(!fs::exists(folder / "d.yaml"));
}

TEST_CASE("a grid of what has none is refused by one line") {
  const TemporaryFolder folder;
  const std::string seq = folder / "seq", out = folder / "out", map = folder / "map.yaml";
  write_tiny_sequence(seq, 4);
  check_refused(start({"run", seq, "--out", out, "--grid", folder / "a.png"}), 2, "ends in .yaml");
  check_refused(start({"run", seq, "--out", out, "--grid", out + "/map.yaml"}), 2, "outside of");
  CHECK(!fs::exists(out));
  write_text(folder / "none.xyz", "nan nan nan 1\n");
  check_refused(start({"grid", folder / "none.xyz", "-o", map}), 1, "none.xyz: has no points");
  check_refused(start({"grid", folder / "none.xyz", "-o", map, "--keep-moving"}), 2,
                "a map has nothing that moves");
  check_refused(
      start({"grid", folder / "none.xyz", "-o", map, "--min-height", "0.9", "--max-height", "0.5"}),
      2, "min_height");
  CHECK(!fs::exists(map));
  const Outcome one = succeed(start({"run", seq, "--out", out, "--grid", map, "--end", "0"}));
  CHECK_THAT(one.err, ContainsSubstring("warning: the grid is of one scan"));
}
