// A recorded clip, if the machine has it.
#include <vector>

#include "dynains/compiled_remover.hpp"
#include "dynains/evaluation/evaluate.hpp"
#include "dynains/io/recording.hpp"
#include "support/catch.hpp"
#include "support/recordings.hpp"

namespace dynains::test {
namespace {

TEST_CASE("the paper's configuration removes a recorded oncoming van: F1 of 0.96 and more") {
  const auto folder = recording_or_skip("kitti_van");
  if (!folder) return;
  const Recording recording(*folder);
  REQUIRE(recording.size() > 10);

  std::vector<std::vector<std::uint8_t>> in_map(recording.size());
  const auto keep = [&](const ScanVerdict& verdict) {
    std::vector<std::uint8_t>& flags = in_map.at(verdict.scan);
    for (const PointLabel label : verdict.labels) flags.push_back(is_static(label) ? 1 : 0);
  };
  DynaInsRemover remover(DynaInsRemover::Config::paper());
  for (std::size_t i = 0; i < recording.size(); ++i) {
    const std::vector<float> xyzi = recording.read_scan(i).xyzi;
    const FrameResult frame = remover.push(RawPoints{xyzi.data(), xyzi.size() / 4, std::size_t{4}},
                                           recording.T_world_sensor(i), recording.time(i));
    if (frame.finished) keep(*frame.finished);
  }
  remover.flush(keep);

  std::vector<float> xyzi;
  std::vector<std::uint32_t> truth;
  const auto source = [&](std::size_t i, evaluation::LabelledScan& scan) {
    if (i == recording.size()) return false;
    xyzi = recording.read_scan(i).xyzi;
    truth = recording.read_labels(i);
    scan.xyz = xyzi.data();
    scan.stride = 4;
    scan.T_world_sensor = recording.T_world_sensor(i);
    scan.time = recording.time(i);
    scan.truth = truth;
    scan.in_map = in_map[i];
    return true;
  };
  const evaluation::Evaluation result = evaluation::evaluate(source, {"paper"}, {});
  REQUIRE(result.rows.size() == 3);
  CHECK(result.rows[0].voxels.f1() < 0.01);
  CHECK(result.rows[1].voxels.f1() > 0.99);
  CHECK(result.rows[2].voxels.f1() >= 0.96);
}

}  // namespace
}  // namespace dynains::test
