// Tables of nuScenes: any bytes give sweeps with poses, or an IoError that names a file.

#include "dynains/io/recording.hpp"
#include "io/nuscenes_writer.hpp"
#include "support/standard.hpp"
#include "targets.hpp"

namespace dynains::fuzz {
namespace {

// The first byte of an input chooses the table; the other ones are whole.
const char* const kTables[] = {"sample_data", "ego_pose", "calibrated_sensor", "scene", "sample"};
const std::string* const kContents[] = {&test::kSampleData, &test::kEgoPoses, &test::kSensors,
                                        &test::kScenes, &test::kSamples};

void run_nuscenes(Bytes bytes) {
  if (bytes.empty()) return;
  static const test::TemporaryFolder folder;
  static const bool is_written = (test::write_nuscenes(folder.path()), true);
  require(is_written, "the other tables are there");
  const std::size_t table = bytes[0] % std::size(kTables);
  const fs::path file = folder / "v1.0-mini" / (std::string(kTables[table]) + ".json");
  test::write_text(file, {reinterpret_cast<const char*>(bytes.data()) + 1, bytes.size() - 1});
  RecordingOptions options;
  options.scene = "scene-0061";
  expect_value_or<IoError>(folder.path(),
                           [&](const fs::path& path) { check_poses(Recording(path, options)); });
  test::write_text(file, *kContents[table]);
}

}  // namespace

Target nuscenes_target() {
  std::vector<std::string> seeds;
  for (std::size_t i = 0; i < std::size(kTables); ++i) {
    seeds.push_back(static_cast<char>(i) + *kContents[i]);
  }
  return {"nuscenes", run_nuscenes, seeds};
}

}  // namespace dynains::fuzz
