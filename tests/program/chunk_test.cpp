// Chunks of a recording: their grid, their files, and the ids of instances across their borders.
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "dynains/errors.hpp"
#include "io/files.hpp"
#include "run/chunk_file.hpp"
#include "run/chunk_grid.hpp"
#include "run/chunk_recorder.hpp"
#include "run/instance_numbers.hpp"
#include "support/catch.hpp"
#include "support/random.hpp"

using namespace dynains;
using namespace dynains::program;
using namespace dynains::test;

namespace {

using Ids = std::vector<std::uint32_t>;

ChunkScan scan_of(std::size_t points, std::uint32_t id) {
  ChunkScan scan;
  scan.labels.assign(points, PointLabel::kStatic);
  scan.causes.assign(points, Cause::kOccupied);
  scan.instances.assign(points, id);
  scan.moving.assign(3, static_cast<char>(id));
  return scan;
}

ChunkSummary example_summary() {
  ChunkSummary summary;
  summary.points = 12;
  summary.labels = {0, 1, 2, 3, 6};
  summary.instances.shared_before = {1, 0, 2};
  summary.instances.shared_behind = {7, 8};
  summary.instances.last = 9;
  summary.instances.still_before = {1, 2};
  summary.instances.moving_behind = {8};
  summary.overview = {{5, 1.5F, 70, 1}, {9, -2.0F, 210, 0}};
  summary.timing.stages = stage_names();
  TimingRow row{"", 7, std::vector<double>(summary.timing.stages.size(), 0.25), 3.5, {}};
  summary.timing.rows = {row, row};
  summary.timing.rows[1].pose_residual.emplace();
  summary.timing.rows[1].pose_residual->translation = 0.01;
  summary.timing.pipeline = 42.0;
  return summary;
}

StaticMapAccumulator example_map() {
  StaticMapAccumulator map;
  PointBuffer points;
  points.x = {0.1F, 5.3F, 0.15F, -7.9F};
  points.y = {0.1F, 1.1F, 0.15F, 2.0F};
  points.z = {0.1F, 0.3F, 0.15F, -1.1F};
  map.insert(points, {}, Eigen::Isometry3d::Identity());
  return map;
}

std::vector<Eigen::Vector3d> points_of_map(const StaticMapAccumulator& map) {
  std::vector<Eigen::Vector3d> points;
  map.for_each([&](const Eigen::Vector3d& point) { points.push_back(point); });
  return points;
}

constexpr ChunkKey kKey = {77, 4, 2};

void write_example(const std::string& file) {
  ChunkFileWriter writer(file, kKey);
  writer.add(scan_of(5, 3));
  writer.add(scan_of(0, 4));
  writer.finish(example_summary(), example_map());
}

void flip_byte(const std::string& file, std::size_t at) {
  std::string bytes = read_text(file);
  bytes.at(at) = static_cast<char>(bytes.at(at) ^ 1);
  write_text(file, bytes);
}

}  // namespace

TEST_CASE("chunks cover a range, with scans before and behind as far as there are any") {
  const auto chunks = chunk_grid({10, 29}, {8, 3}, 2);
  REQUIRE(chunks.size() == 3);
  CHECK(chunks[0].first == 10);
  CHECK(chunks[0].own.first == 10);
  CHECK(chunks[0].own.last == 17);
  CHECK(chunks[0].last == 19);
  CHECK(chunks[1].first == 15);
  CHECK(chunks[1].own.first == 18);
  CHECK(chunks[1].own.last == 25);
  CHECK(chunks[1].last == 27);
  CHECK(chunks[2].first == 23);
  CHECK(chunks[2].own.first == 26);
  CHECK(chunks[2].own.last == 29);
  CHECK(chunks[2].last == 29);
}

TEST_CASE("chunks of one scan, a chunk larger than the range, and the largest numbers") {
  CHECK(chunk_grid({0, 2}, {1, 0}, 0).size() == 3);
  constexpr std::size_t kMost = ~std::size_t{0};
  const auto chunks = chunk_grid({5, 9}, {kMost, kMost}, kMost);
  REQUIRE(chunks.size() == 1);
  CHECK(chunks[0].first == 5);
  CHECK(chunks[0].last == 9);
  CHECK(chunks[0].own.size() == 5);
}

TEST_CASE("the default chunk: a stream for short recordings, else chunks that take equally long") {
  CHECK(default_chunk(1, 100, 30) == 0);
  CHECK(default_chunk(999, 100, 30) == 0);
  const std::size_t chunk = default_chunk(1000, 100, 30);
  const auto chunks = chunk_grid({0, 999}, {chunk, 100}, 30);
  REQUIRE(chunks.size() == 2);
  const auto pushes = [&](std::size_t i) { return chunks[i].last - chunks[i].first + 1; };
  CHECK(pushes(0) == pushes(1));
  CHECK(chunk_grid({0, 99999}, {default_chunk(100000, 100, 30), 100}, 30).size() == 200);
}

TEST_CASE("neighbouring chunks share a scan, if their warm-up or lookahead overlap") {
  const auto with_warm_up = chunk_grid({0, 9}, {5, 1}, 0);
  CHECK(shared_scan(with_warm_up[0], with_warm_up[1]) == 4);
  const auto with_lookahead = chunk_grid({0, 9}, {5, 0}, 1);
  CHECK(shared_scan(with_lookahead[0], with_lookahead[1]) == 5);
  const auto without = chunk_grid({0, 9}, {5, 0}, 0);
  CHECK_FALSE(shared_scan(without[0], without[1]));
}

TEST_CASE("an instance keeps its id across the border, others get the next ones") {
  ChunkInstances first;
  first.shared_behind = {0, 12, 12, 12, 17, 17, 15, 15};
  first.last = 20;
  ChunkInstances second;
  // 4 was 12, 6 was 17, 2 was nothing, 9 has no point in common with an instance.
  second.shared_before = {9, 4, 4, 4, 6, 6, 0, 0};
  second.last = 30;
  const InstanceNumbers numbers(InstanceNumbers(first), first, second);
  CHECK(numbers(kNoInstance) == kNoInstance);
  CHECK(numbers(4) == 12);
  CHECK(numbers(6) == 17);
  CHECK(numbers(9) == 21);
  CHECK(numbers(10) == 22);
  CHECK(numbers(30) == 42);
  CHECK(numbers.last() == 42);
}

TEST_CASE("an instance that moved up to the border is told to the next chunk") {
  ChunkInstances first;
  first.shared_behind = {3, 3, 4, 4, 5};
  first.moving_behind = {3, 5, 9};
  first.last = 9;
  ChunkInstances second;
  second.shared_before = {1, 1, 2, 2, 6};
  second.last = 9;
  const InstanceNumbers numbers(InstanceNumbers(first), first, second);
  CHECK(numbers.moved_before(1));
  CHECK_FALSE(numbers.moved_before(2));
  CHECK(numbers.moved_before(6));
  // 9 is another instance in this chunk, and 0 is none.
  CHECK_FALSE(numbers.moved_before(9));
  CHECK_FALSE(numbers.moved_before(kNoInstance));
  CHECK_FALSE(InstanceNumbers(first).moved_before(3));
}

TEST_CASE("an instance is dynamic with more than half of its points, scan by scan") {
  InstancePoints points;
  const auto found = [&] {
    std::vector<std::pair<std::uint32_t, bool>> result;
    points.for_each(
        [&](std::uint32_t id, bool is_dynamic) { result.emplace_back(id, is_dynamic); });
    return result;
  };
  constexpr PointLabel kMoves = PointLabel::kDynamic, kStays = PointLabel::kStatic;
  const std::vector<PointLabel> labels = {kMoves, kMoves, kStays, kMoves, kStays, kMoves};
  const Ids ids = {7, 7, 7, 0, 2, 2};
  points.count(labels, ids);
  CHECK(found() == std::vector<std::pair<std::uint32_t, bool>>{{7, true}, {2, false}});
  const std::vector<PointLabel> next_labels = {kStays};
  const Ids next_ids = {7};
  points.count(next_labels, next_ids);
  CHECK(found() == std::vector<std::pair<std::uint32_t, bool>>{{7, false}});
}

TEST_CASE("of two instances that were one, the larger one keeps the id; of equal ones, the first") {
  ChunkInstances first;
  first.shared_behind = {5, 5, 5, 5, 5, 6, 6, 6, 6};
  first.last = 6;
  ChunkInstances second;
  second.shared_before = {1, 1, 2, 2, 2, 4, 4, 3, 3};
  second.last = 4;
  const InstanceNumbers numbers(InstanceNumbers(first), first, second);
  CHECK(numbers(2) == 5);
  CHECK(numbers(1) == 7);
  CHECK(numbers(3) == 6);
  CHECK(numbers(4) == 8);
  CHECK(numbers.last() == 8);
}

TEST_CASE("without a shared scan all instances are new ones") {
  ChunkInstances first;
  first.last = 20;
  ChunkInstances second;
  second.last = 3;
  const InstanceNumbers numbers(InstanceNumbers(first), first, second);
  CHECK(numbers(kNoInstance) == kNoInstance);
  CHECK(numbers(1) == 21);
  CHECK(numbers(3) == 23);
  CHECK(numbers.last() == 23);
}

TEST_CASE("runs of points with one verdict expand to the verdicts of all points") {
  Random random(5);
  for (const std::size_t points : {0U, 1U, 2U, 500U}) {
    ChunkScan scan;
    for (std::size_t i = 0; i < points; ++i) {
      const bool continues = i > 0 && random.index(4) != 0;
      scan.labels.push_back(continues ? scan.labels.back()
                                      : static_cast<PointLabel>(random.index(5)));
      scan.causes.push_back(continues ? scan.causes.back()
                                      : static_cast<Cause>(random.index(kCauseCount)));
      scan.instances.push_back(continues ? scan.instances.back()
                                         : static_cast<std::uint32_t>(random.index(3)));
    }
    VerdictRuns runs;
    runs.assign(scan);
    CHECK(runs.ends.size() <= points);
    ChunkScan expanded = scan_of(7, 3);
    REQUIRE(runs.is_valid());
    runs.expand(expanded);
    CHECK(expanded.labels == scan.labels);
    CHECK(expanded.causes == scan.causes);
    CHECK(expanded.instances == scan.instances);
  }
}

TEST_CASE("runs that do not fit together are refused") {
  VerdictRuns runs;
  runs.assign(scan_of(5, 3));
  REQUIRE(runs.ends == Ids{5});
  runs.causes.clear();
  CHECK_FALSE(runs.is_valid());
  runs.assign(scan_of(5, 3));
  runs.ends = {0xFFFFFFFF};
  CHECK_FALSE(runs.is_valid());
  runs.ends = {5, 4};
  runs.instances = {1, 2};
  runs.labels.assign(2, PointLabel::kStatic);
  runs.causes.assign(2, Cause::kOccupied);
  CHECK_FALSE(runs.is_valid());
  runs.ends = {4, 5};
  CHECK(runs.is_valid());
}

TEST_CASE("the file of a chunk gives back what was written") {
  const TemporaryFolder folder;
  write_example(folder / "a.chunk");
  ChunkFileReader reader(folder / "a.chunk", kKey);
  reader.verify();
  ChunkScan scan;
  reader.next(scan);
  CHECK(scan.instances == Ids(5, 3));
  CHECK(scan.labels == std::vector<PointLabel>(5, PointLabel::kStatic));
  CHECK(scan.causes == std::vector<Cause>(5, Cause::kOccupied));
  CHECK(scan.beliefs.empty());
  CHECK(scan.online.empty());
  CHECK(scan.moving == std::vector<char>(3, 3));
  reader.next_moving(scan.moving);
  CHECK(scan.moving == std::vector<char>(3, 4));

  ChunkFileReader again(folder / "a.chunk", kKey);
  VerdictRuns runs;
  again.next_runs(runs, scan);
  CHECK(runs.ends == Ids{5});
  CHECK(runs.instances == Ids{3});
  again.next_runs(runs, scan);
  CHECK(runs.ends.empty());

  const ChunkSummary summary = reader.read_summary();
  const ChunkSummary expected = example_summary();
  CHECK(summary.points == expected.points);
  CHECK(summary.labels == expected.labels);
  CHECK(summary.instances.shared_before == expected.instances.shared_before);
  CHECK(summary.instances.shared_behind == expected.instances.shared_behind);
  CHECK(summary.instances.still_before == expected.instances.still_before);
  CHECK(summary.instances.moving_behind == expected.instances.moving_behind);
  CHECK(summary.instances.last == expected.instances.last);
  REQUIRE(summary.overview.size() == 2);
  CHECK(summary.overview[0].pixel == 5);
  CHECK(summary.overview[1].height == -2.0F);
  CHECK(summary.timing.pipeline == 42.0);
  REQUIRE(summary.timing.rows.size() == 2);
  CHECK(summary.timing.rows[0].points == 7);
  CHECK(summary.timing.rows[0].stages == expected.timing.rows[0].stages);
  CHECK_FALSE(summary.timing.rows[0].pose_residual);
  REQUIRE(summary.timing.rows[1].pose_residual);
  CHECK(summary.timing.rows[1].pose_residual->translation == 0.01);

  StaticMapAccumulator map;
  reader.add_map(map);
  CHECK(points_of_map(map) == points_of_map(example_map()));
}

TEST_CASE("a broken file of a chunk, or one of another run, is refused with its path") {
  const TemporaryFolder folder;
  const std::string file = folder / "a.chunk";
  const auto refusal = [&](const ChunkKey& key) {
    return message_of<IoError>([&] { ChunkFileReader(file, key).verify(); });
  };
  CHECK_THAT(refusal(kKey), ContainsSubstring(file + ": cannot be opened"));
  write_example(file);
  const std::string bytes = read_text(file);
  CHECK_THAT(refusal({78, 4, 2}), ContainsSubstring("belongs to another run"));
  CHECK_THAT(refusal({77, 5, 2}), ContainsSubstring("belongs to another chunk"));
  CHECK_THAT(refusal({77, 4, 3}), ContainsSubstring("belongs to another chunk"));
  flip_byte(file, 0);
  CHECK_THAT(refusal(kKey), ContainsSubstring("is no result of a chunk"));
  write_text(file, bytes);
  flip_byte(file, 8);
  CHECK_THAT(refusal(kKey), ContainsSubstring("has another version"));
  for (const std::size_t size : {std::size_t{0}, std::size_t{8}, bytes.size() - 1}) {
    write_text(file, bytes.substr(0, size));
    CHECK_THAT(refusal(kKey), ContainsSubstring("is cut off"));
  }
  // Every byte behind the key counts, also if whole words are missing.
  for (std::size_t at = 40; at < bytes.size(); ++at) {
    write_text(file, bytes);
    flip_byte(file, at);
    CAPTURE(at);
    CHECK_THAT(refusal(kKey), ContainsSubstring("does not have the bytes that were written"));
  }
  for (std::size_t size = 56; size < bytes.size(); size += 8) {
    write_text(file, bytes.substr(0, size));
    CAPTURE(size);
    CHECK_THAT(refusal(kKey), ContainsSubstring("does not have the bytes that were written"));
  }
}

TEST_CASE("maps of parts give the map of the whole") {
  StaticMapAccumulator whole, first, second, merged;
  PointBuffer a, b;
  for (int i = 0; i < 2000; ++i) {
    const auto value = [&](int step) {
      return 0.013F * static_cast<float>(i * step % 1997) - 9.0F;
    };
    PointBuffer& points = i < 1000 ? a : b;
    points.x.push_back(value(7));
    points.y.push_back(value(11));
    points.z.push_back(0.1F * value(13));
  }
  const Eigen::Isometry3d place = Eigen::Isometry3d::Identity();
  whole.insert(a, {}, place);
  whole.insert(b, {}, place);
  first.insert(a, {}, place);
  second.insert(b, {}, place);
  for (const StaticMapAccumulator* part : {&first, &second}) {
    for (std::uint32_t block = 0; block < part->block_count(); ++block) {
      std::vector<std::array<float, 3>> points;
      part->visit_in_block(block, [&](float x, float y, float z) { points.push_back({x, y, z}); });
      std::vector<float> xyz;
      for (auto point = points.rbegin(); point != points.rend(); ++point) {
        xyz.insert(xyz.end(), point->begin(), point->end());
      }
      const std::array<std::int32_t, 3> index = part->block_index(block);
      merged.insert_in_block(index, xyz);
    }
  }
  CHECK(whole.size() > 500);
  CHECK(points_of_map(merged) == points_of_map(whole));
}
