// A recorded clip, if the machine has it.

#include "dynains/io/recording.hpp"
#include "support/catch.hpp"
#include "support/recordings.hpp"
#include "support/simulated_runs.hpp"

namespace dynains::test {
namespace {

TEST_CASE("the paper's configuration removes a recorded oncoming van: F1 of 0.96 and more") {
  const auto folder = recording_or_skip("kitti_van");
  if (!folder) return;
  const Recording recording(*folder);
  REQUIRE(recording.size() > 10);

  std::vector<simulation::SimulatedScan> scans(recording.size());
  for (std::size_t i = 0; i < recording.size(); ++i) {
    scans[i].xyzi = recording.read_scan(i).xyzi;
    scans[i].labels = recording.read_labels(i);
    scans[i].T_world_sensor = recording.T_world_sensor(i);
    scans[i].time = recording.time(i);
  }
  const StaticPoints in_map = static_points(scans, DynaInsRemover::Config::paper()).final;
  const evaluation::Evaluation result = evaluate(scans, in_map, {"paper"}, {});
  REQUIRE(result.rows.size() == 3);
  CHECK(result.rows[0].voxels.f1() < 0.01);
  CHECK(result.rows[1].voxels.f1() > 0.99);
  CHECK(result.rows[2].voxels.f1() >= 0.96);
}

}  // namespace
}  // namespace dynains::test
