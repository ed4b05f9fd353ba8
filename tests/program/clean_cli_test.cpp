#include "dynains/io/recording.hpp"
#include "program/run_folder.hpp"
#include "program/tiny_sequence.hpp"
#include "support/catch.hpp"

using namespace dynains;
using namespace dynains::test;

namespace {

constexpr std::size_t kScans = 12;

/// A finished run whose labels call the box of each scan moving, and a map of all points.
struct CleanFixture : RunFolder {
  CleanFixture() {
    write_tiny_sequence(seq, kScans, {100.0, 200.0, 3.0});
    succeed(run({"-q"}));
    const Recording recording(seq);
    for (std::size_t i = 0; i < recording.size(); ++i) {
      const RecordedScan scan = recording.read_scan(i);
      std::vector<std::uint32_t> labels;
      for (std::size_t k = 0; k < scan.size(); ++k) {
        std::ostringstream line;
        line << 100.0 + scan.xyzi[4 * k] << ' ' << 200.0 + scan.xyzi[4 * k + 1] << ' '
             << 3.0 + scan.xyzi[4 * k + 2] << ' ' << points << ' ' << i << '\n';
        all += line.str();
        // The box is the only thing at this distance above the floor.
        const bool is_box = scan.xyzi[4 * k] == 10.0F && scan.xyzi[4 * k + 2] > -1.5F;
        if (!is_box) standing += line.str();
        labels.push_back(is_box ? 251 : 9);
        ++points;
      }
      write_labels(out + "/labels/" + recording.name(i) + ".label", labels);
    }
    write_text(map, header(points) + all);
  }
  static std::string header(std::size_t count) {
    return "ply\nformat ascii 1.0\ncomment made by another program\nelement vertex " +
           std::to_string(count) +
           "\nproperty double x\nproperty double y\nproperty double z\nproperty int number\n"
           "property uchar day\nend_header\n";
  }
  Outcome clean(const Arguments& more = {}) const {
    return start(Arguments{"clean", map, out} + more);
  }

  std::string map = folder / "merged.ply";
  std::string cleaned = folder / "merged_static.ply";
  std::string all, standing;  // lines of points
  std::size_t points = 0;
};

}  // namespace

TEST_CASE("clean removes the trail of a mover from a map that another program has made") {
  const CleanFixture f;
  const Outcome outcome = succeed(f.clean());
  // A floor and a box do not tell where the map lies.
  CHECK_THAT(outcome.err, ContainsSubstring("the distance of the map and the scans is not known"));
  const std::size_t kept = count_lines(f.standing);
  CHECK(read_text(f.cleaned) == CleanFixture::header(kept) + f.standing);
  CHECK_THAT(outcome.out, ContainsSubstring(std::to_string(f.points) + " points, " +
                                            std::to_string(f.points - kept) + " left as moving"));
  CHECK(read_text(f.map) == CleanFixture::header(f.points) + f.all);
  check_refused(f.clean(), 1, "exists; choose another name, or replace it by --force");
}

TEST_CASE("clean finds where the scans lie in a map that was made with other poses") {
  const TemporaryFolder folder;
  const std::string seq = folder / "seq", out = folder / "out", map = folder / "map.ply";
  succeed(start({"simulate", seq, "--scans", "20", "--sensor", "vlp16", "-q"}));
  succeed(start({"run", seq, "--out", out, "-q"}));
  const Recording recording(seq);
  // The points that stay, of a map of all points that is displaced.
  const auto kept = [&](const Eigen::Vector3d& displacement, std::string& said) {
    std::ostringstream lines;
    std::size_t points = 0;
    for (std::size_t i = 0; i < recording.size(); ++i) {
      const RecordedScan scan = recording.read_scan(i);
      for (std::size_t k = 0; k < scan.size(); k += 3, ++points) {
        const float* const p = &scan.xyzi[4 * k];
        const Eigen::Vector3d at =
            recording.T_world_sensor(i) * Eigen::Vector3d(p[0], p[1], p[2]) + displacement;
        lines << at.transpose() << ' ' << points << " 0\n";
      }
    }
    write_text(map, CleanFixture::header(points) + lines.str());
    const Outcome outcome = succeed(start({"clean", map, out, "--force"}));
    said = outcome.err;
    return count_lines(read_text(folder / "map_static.ply"));
  };
  std::string said, said_of_displaced;
  const auto exact = static_cast<double>(kept(Eigen::Vector3d::Zero(), said));
  const auto displaced = static_cast<double>(kept({0.25, -0.15, 0.1}, said_of_displaced));
  CHECK(said.find("warning") == std::string::npos);
  CHECK_THAT(said_of_displaced, ContainsSubstring("the map lies up to 0.3"));
  const auto points = static_cast<double>(count_lines(read_text(map)));
  CHECK(exact < 0.99 * points);
  CHECK(std::abs(displaced - exact) < 0.1 * (points - exact));
}

TEST_CASE("clean refuses a map or a recording that does not belong to the run") {
  const CleanFixture f;
  SECTION("an edge that is no number") {
    for (const char* edge : {"nan", "0", "inf"}) {
      check_refused(f.clean({"--voxel", edge}), 2, "--voxel = " + std::string(edge));
    }
  }
  SECTION("a map in another frame") {
    write_text(f.map, CleanFixture::header(1) + "0 0 0 0 0\n");
    check_refused(f.clean(), 1,
                  "merged.ply: no point lies near a point of the "
                  "scans; expected a map in the frame of the poses");
  }
  SECTION("a map of which most lies elsewhere is cleaned with a warning") {
    const std::string first = f.standing.substr(0, f.standing.find('\n') + 1);
    write_text(f.map, CleanFixture::header(3) + first + "0 0 0 0 0\n0 0 1 0 0\n");
    check_warns(f.clean(), "lie near no point of the scans and stay");
    CHECK(read_text(f.cleaned) == read_text(f.map));
  }
  SECTION("scans that are gone") {
    fs::remove(f.seq + "/velodyne/000011.bin");
    const Outcome outcome = f.clean();
    CHECK(outcome.code != 0);
    CHECK_FALSE(fs::exists(f.cleaned));
  }
  SECTION("a folder without results, another format, and the map itself") {
    CHECK_THAT(start({"clean", f.map, f.seq}).err,
               ContainsSubstring("report.json: not found; expected a folder of `dynains run`"));
    CHECK_THAT(f.clean({"--map", f.folder / "map.pcd"}).err,
               ContainsSubstring("expected a name that ends in .ply"));
    CHECK_THAT(f.clean({"--map", f.map, "--force"}).err, ContainsSubstring("merged.ply"));
    CHECK(read_text(f.map) == CleanFixture::header(f.points) + f.all);
    CHECK_THAT(f.clean({"--map", f.out + "/static_map.ply", "--force"}).err,
               ContainsSubstring("which this command reads"));
    CHECK_THAT(f.clean({"--map", f.out + "/cleaned.ply"}).err,
               ContainsSubstring("cleaned.ply: would be a part of"));
  }
}
