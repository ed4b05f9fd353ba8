#include "finished_run.hpp"

#include <optional>
#include <string>
#include <system_error>

#include "dynains/errors.hpp"
#include "json_file.hpp"

namespace dynains::program {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// report.json of `dynains run` in `folder`; nothing if there is none.
std::optional<Json> read_own_report(const fs::path& folder) {
  std::error_code error;
  if (!fs::exists(folder / "report.json", error)) return std::nullopt;
  Json report = read_json_file(folder / "report.json");
  if (json_field<std::string>(folder / "report.json", report, "/program") != "dynains") {
    return std::nullopt;
  }
  return report;
}

void check_is_complete(const fs::path& report_file, const Json& report) {
  if (required_json_field<bool>(report_file, report, "/complete")) return;
  throw IoError(report_file.string() +
                ": /complete: expected true, found false: the run was interrupted or is still at "
                "work. Complete it by dynains run --resume; eval judges what is there by "
                "--unfinished");
}

}  // namespace

void check_run_is_finished(const fs::path& folder) {
  const std::optional<Json> report = read_own_report(folder);
  if (report) check_is_complete(folder / "report.json", *report);
}

void check_map_is_finished(const fs::path& map) {
  const fs::path folder = map.parent_path();
  const std::optional<Json> report = read_own_report(folder);
  const fs::path report_file = folder / "report.json";
  if (!report ||
      json_field<std::string>(report_file, *report, "/static_map/file") != map.filename()) {
    return;
  }
  check_is_complete(report_file, *report);
}

}  // namespace dynains::program
