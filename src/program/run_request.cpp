#include "run_request.hpp"

#include <cstdint>
#include <cstring>
#include <fstream>
#include <string>

#include "dynains/errors.hpp"
#include "dynains/version.hpp"

namespace dynains::program {
namespace {

/// FNV-1a, 64 bits.
class Fingerprint {
 public:
  void add(const void* data, std::size_t size) {
    const auto* const bytes = static_cast<const unsigned char*>(data);
    for (std::size_t i = 0; i < size; ++i) value_ = (value_ ^ bytes[i]) * 0x100000001B3U;
  }
  void add(const std::string& text) { add(text.data(), text.size()); }
  void add(double value) { add(&value, sizeof(value)); }
  std::string text() const { return std::to_string(value_); }

 private:
  std::uint64_t value_ = 0xCBF29CE484222325U;
};

std::string fingerprint(const Recording& recording, const ScanRange& range) {
  Fingerprint result;
  for (std::size_t i = range.first; i <= range.last; ++i) {
    result.add(recording.name(i));
    result.add(recording.time(i));
    const Eigen::Matrix4d pose = recording.T_world_sensor(i).matrix();
    for (Eigen::Index k = 0; k < pose.size(); ++k) result.add(pose(k));
  }
  return result.text();
}

}  // namespace

nlohmann::ordered_json describe_request(const Recording& recording, const ScanRange& range,
                                        const RunOutputs& outputs,
                                        const nlohmann::ordered_json& configuration) {
  return {{"version", kVersionString},
          {"first_scan", recording.name(range.first)},
          {"last_scan", recording.name(range.last)},
          {"poses_and_times", fingerprint(recording, range)},
          {"points_in_world", recording.frame() == PointFrame::kWorld},
          {"map", outputs.map_name()},
          {"write_online", outputs.write_online},
          {"write_clean", outputs.write_clean},
          {"configuration", configuration}};
}

EarlierRun find_earlier_run(const std::filesystem::path& folder,
                            const nlohmann::ordered_json& request) {
  std::ifstream file(folder / "report.json");
  if (!file) return EarlierRun::kNone;
  const auto report = nlohmann::json::parse(file, nullptr, false);
  const auto replace = nlohmann::ordered_json::error_handler_t::replace;
  const auto expected = nlohmann::json::parse(request.dump(-1, ' ', false, replace));
  if (!report.is_object() || report.value("request", nlohmann::json()) != expected) {
    throw IoError(folder.string() +
                  ": holds results of other flags, scans, poses or another version, which cannot "
                  "be resumed; choose another folder, or replace them by --force");
  }
  return report.value("complete", false) ? EarlierRun::kComplete : EarlierRun::kUnfinished;
}

}  // namespace dynains::program
