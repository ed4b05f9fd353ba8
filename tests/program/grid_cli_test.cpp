#include "program/start.hpp"
#include "program/tiny_sequence.hpp"
#include "run/write_grid.hpp"
#include "support/catch.hpp"

using namespace dynains::test;

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
  check_refused(start({"grid", out, "-o", out + "/b.yaml"}), 1, "b.pgm: would be a part of");
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
  check_refused(start({"grid", folder / "nope", "-o", map}), 1, "nope: not found");
  check_refused(start({"grid", seq, "-o", map}), 1, "report.json: not found; expected a folder of");
  CHECK(!fs::exists(map));
  const Outcome one = succeed(start({"run", seq, "--out", out, "--grid", map, "--end", "0"}));
  CHECK_THAT(one.err, ContainsSubstring("warning: the grid is of one scan"));
  CHECK_THAT(one.err, !ContainsSubstring("of ground in one piece"));
  write_text(folder / "four.xyz", "0 0 0 1\n1 0 0 1\n0 1 0.5 1\n1 1 2 1\n");
  const Outcome four = succeed(start({"grid", folder / "four.xyz", "-o", folder / "four.yaml"}));
  CHECK_THAT(four.err, ContainsSubstring("warning: the grid has less than 10 m2 of ground"));
}

TEST_CASE("beams of a grid begin at the sensor of their point") {
  // The first sensor, high above, sees two patches of ground; the second one a point of the far
  // patch, past what lies between.
  const TemporaryFolder folder;
  write_text(folder / "poses.txt", pose_row());
  write_text(folder / "sensors.txt", "1 0 0 2 0 1 0 2 0 0 1 30\n1 0 0 2 0 1 0 3 0 0 1 0.8\n");
  std::ostringstream points("x,y,z\n", std::ios::ate);
  std::string sensors;
  for (int i = 0; i < 1600; ++i) {
    for (const double x : {0.0, 12.0})
      points << x + 0.1 * (i % 40) << ',' << 0.1 * (i / 40) << ",0\n";
    sensors.append(2, '\0');
  }
  points << "14,3,0\n";
  write_text(folder / "a1.csv", points.str());
  write_text(folder / "sensor/a1.id", sensors + '\1');

  const auto call_ground = [](std::size_t, const dynains::RecordedScan& scan,
                              std::vector<dynains::PointLabel>& labels) {
    labels.assign(scan.size(), dynains::PointLabel::kGround);
  };
  const dynains::run::PlacedGrid placed =
      dynains::run::grid_of_run(call_ground, dynains::Recording(folder.path()), {0}, {}, false,
                                [](std::size_t) { return true; });
  const auto state_at = [&](double x, double y) {
    const dynains::grid::Columns& columns = placed.grid.columns;
    return placed.grid.cells.at(columns.index(columns.along(0, x), columns.along(1, y)));
  };
  CHECK(state_at(8.01, 3.01) == dynains::grid::CellState::kFree);
  CHECK(state_at(8.01, 3.01 * 8.01 / 14.0) == dynains::grid::CellState::kUnknown);  // from the body
}
