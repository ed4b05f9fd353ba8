#include "finished_run.hpp"

#include <string>
#include <system_error>

#include "dynains/errors.hpp"
#include "json_file.hpp"

namespace dynains::program {

void check_run_is_finished(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / "report.json";
  std::error_code error;
  if (!std::filesystem::exists(file, error)) return;
  const auto report = read_json_file(file);
  if (json_field<std::string>(file, report, "/program") != "dynains") return;
  if (required_json_field<bool>(file, report, "/complete")) return;
  throw IoError(file.string() +
                ": /complete: expected true, found false: the run was interrupted or is still at "
                "work. Repeat it; eval judges what is there by --unfinished");
}

}  // namespace dynains::program
