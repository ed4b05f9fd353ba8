// The loop of `dynains run`, with a remover that gives predefined answers.
#include "run/run_sequence.hpp"

#include <algorithm>
#include <optional>
#include <vector>

#include "dynains/errors.hpp"
#include "io/files.hpp"
#include "program/tiny_sequence.hpp"
#include "run/verdict_files.hpp"
#include "support/catch.hpp"

using namespace dynains;
using namespace dynains::run;
using namespace dynains::test;
namespace fs = std::filesystem;

namespace {

/// Verdicts are final after two more scans. Final labels: point 0 dynamic, 1 invalid, 2 out of
/// range, 3 ground, others static. Newest verdicts: all static.
class FakeRemover {
 public:
  struct Map {
    template <class Visitor>
    void for_each(Visitor&& visitor) const {
      visitor(Eigen::Vector3d(1.0, 2.0, 3.0));
    }
  };

  FrameResult push(const RawPoints<float>& cloud, const Eigen::Isometry3d& T_world_sensor,
                   double time) {
    if (pushed_.size() == fail_at) throw PoseError("the pose jumps");
    Scan scan;
    scan.T_world_sensor = T_world_sensor;
    scan.time = time;
    scan.labels.assign(cloud.count, PointLabel::kStatic);
    scan.instances.assign(cloud.count, 0);
    scan.beliefs.assign(cloud.count, 0.0F);
    scan.causes.assign(cloud.count, Cause::kOccupied);
    pushed_.push_back(scan);
    newest_ = pushed_.back();
    FrameResult result;
    result.newest = newest_.verdict(pushed_.size() - 1);
    if (pushed_.size() > 2) result.finished = finish();
    result.times.map = 0.5;
    return result;
  }
  template <class Sink>
  void flush(Sink&& sink) {
    while (finished_ < pushed_.size()) sink(finish());
  }
  Map map() const { return {}; }
  std::size_t latency() const { return announced_latency; }

  std::size_t fail_at = 1000;
  std::size_t announced_latency = 2;  // of more than a few scans: they are read again

 private:
  struct Scan {
    Eigen::Isometry3d T_world_sensor;
    double time = 0.0;
    std::vector<PointLabel> labels;
    std::vector<std::uint32_t> instances;
    std::vector<float> beliefs;
    std::vector<Cause> causes;

    ScanVerdict verdict(std::size_t i) const {
      return {i, time, T_world_sensor, labels, instances, beliefs, causes};
    }
  };

  ScanVerdict finish() {
    Scan& scan = pushed_[finished_];
    const PointLabel first[] = {PointLabel::kDynamic, PointLabel::kInvalid, PointLabel::kOutOfRange,
                                PointLabel::kGround};
    std::copy_n(first, std::min<std::size_t>(4, scan.labels.size()), scan.labels.begin());
    if (!scan.instances.empty()) scan.instances[0] = 70000;
    return scan.verdict(finished_++);
  }

  std::vector<Scan> pushed_;
  Scan newest_;
  std::size_t finished_ = 0;
};

struct Fixture {
  explicit Fixture(std::size_t scans) {
    write_tiny_sequence(folder / "seq", scans, {100.0, 200.0, 300.0});
    sequence.emplace(folder / "seq");
    fs::create_directory(folder / "out");
  }
  RunOutputs outputs() const {
    RunOutputs outputs;
    outputs.folder = folder / "out";
    outputs.map = folder / "out/map.ply";
    outputs.write_online = true;
    return outputs;
  }

  TemporaryFolder folder;
  std::optional<Recording> sequence;
  FakeRemover remover;
};

constexpr auto kAlways = [](std::size_t) { return true; };

}  // namespace

TEST_CASE("Labels: 251 moving, 9 static, 0 not judged; instances wrap but never to 0") {
  CHECK(mos_label(PointLabel::kDynamic, 0) == 251);
  CHECK(mos_label(PointLabel::kGround, 0) == 9);
  CHECK(mos_label(PointLabel::kStatic, 3) == (9 | 3U << 16));
  CHECK(mos_label(PointLabel::kInvalid, 0) == 0);
  CHECK(mos_label(PointLabel::kOutOfRange, 0) == 0);
  CHECK(mos_label(PointLabel::kDynamic, 65535) == (251 | 65535U << 16));
  CHECK(mos_label(PointLabel::kDynamic, 65536) == (251 | 1U << 16));
  CHECK(mos_label(PointLabel::kDynamic, 70000) == (251 | 4465U << 16));
  CHECK(mos_label(PointLabel::kDynamic, 2 * 65535) == (251 | 65535U << 16));
  CHECK(mos_label(PointLabel::kDynamic, 0xFFFFFFFF) == (251 | 65535U << 16));
}

TEST_CASE("Every scan gets its final labels, every dynamic point its place in the world") {
  Fixture fixture(5);
  const ScanRange range{1, 4};
  RunOutputs outputs = fixture.outputs();
  outputs.one_thread = GENERATE(false, true);
  fixture.remover.announced_latency = GENERATE(2, 30);
  RunResults results(*fixture.sequence, range, outputs);
  const RunTiming timing =
      run_sequence(fixture.remover, *fixture.sequence, range, results, kAlways);
  results.commit();

  CHECK(results.finished() == 4);
  const std::size_t count = fixture.sequence->read_scan(1).size();
  CHECK(results.tally().points == 4 * count);
  CHECK(results.tally()[PointLabel::kDynamic] == 4);
  CHECK(results.tally()[PointLabel::kInvalid] == 4);
  CHECK(results.tally()[PointLabel::kStatic] == 4 * (count - 4));

  CHECK_FALSE(fs::exists(fixture.folder / "out/labels/000000.label"));
  for (std::size_t i = 1; i <= 4; ++i) {
    std::vector<std::uint32_t> expected(count, 9);
    CHECK(read_labels(fixture.folder / ("out/online/" + scan_name(i) + ".label"), count) ==
          expected);
    expected[0] = 251 | 4465U << 16;
    expected[1] = 0;
    expected[2] = 0;
    CHECK(read_labels(fixture.folder / ("out/labels/" + scan_name(i) + ".label"), count) ==
          expected);
    CHECK(test::read_text(fixture.folder / ("out/causes/" + scan_name(i) + ".cause")) ==
          std::string(count, '\16'));
  }

  const PointFile moving = read_points(fixture.folder / "out/dynamic_points.ply");
  REQUIRE(moving.positions.size() == 4);
  // The first point of each scan is (4, 0, -1.7) in the frame of a sensor at (100, 200, 300).
  CHECK(moving.positions[3].isApprox(Eigen::Vector3d(104.0, 200.0, 298.3), 1e-6));
  CHECK(moving.intensity[3] == 0.5F);
  CHECK(moving.label[3] == (251 | 4465U << 16));
  CHECK(read_points(fixture.folder / "out/map.ply").positions.size() == 1);

  REQUIRE(timing.rows.size() == 4);
  CHECK(timing.rows[0].scan == "000001");
  CHECK(timing.rows[0].points == count);
  CHECK(timing.rows[0].stages.map == 0.5);
}

TEST_CASE("A refused pose is named, and final results stay") {
  Fixture fixture(6);
  fixture.remover.fail_at = 4;
  const ScanRange range{0, 5};
  {
    RunResults results(*fixture.sequence, range, fixture.outputs());
    CHECK_THAT(message_of<PoseError>([&] {
                 run_sequence(fixture.remover, *fixture.sequence, range, results, kAlways);
               }),
               ContainsSubstring("scan 000004: the pose jumps"));
  }
  CHECK(count_entries(fixture.folder / "out/labels") == 2);
  // Labels, causes and online labels, but no map, no moving points and no temporary files.
  CHECK(count_entries(fixture.folder / "out") == 3);
}
