#include "write_view.hpp"

#include <string>

#include "dynains/errors.hpp"
#include "dynains/io/atomic_file.hpp"
#include "finished_run.hpp"
#include "json_file.hpp"
#include "run_report.hpp"
#include "run_results.hpp"
#include "viewer/page.hpp"
#include "viewer/run_view.hpp"

namespace dynains::program {
namespace {

namespace fs = std::filesystem;

/// Index of the scan of this name. Throws IoError.
std::size_t scan_named(const Recording& recording, const std::string& name,
                       const fs::path& report) {
  for (std::size_t i = 0; i < recording.size(); ++i) {
    if (recording.name(i) == name) return i;
  }
  throw IoError(report.string() + ": the run has scan " + name + ", which " +
                recording.folder().string() + " does not have; is it the recording of the run?");
}

viewer::RunFiles files_of(const fs::path& folder, const nlohmann::ordered_json& json,
                          const Recording& recording) {
  const fs::path report = folder / run_output_kind().marker;
  viewer::RunFiles files;
  files.folder = folder;
  const auto text = [&](const char* field) {
    return required_json_field<std::string>(report, json, field);
  };
  files.first = scan_named(recording, text("/first_scan"), report);
  files.last = scan_named(recording, text("/last_scan"), report);
  if (files.last < files.first) {
    throw IoError(report.string() + ": /last_scan: expected a scan after /first_scan");
  }
  files.map_voxel = required_json_field<double>(report, json, "/configuration/map_voxel");
  return files;
}

}  // namespace

ResultFolder open_finished_run(const fs::path& folder) {
  ResultFolder out(Folder(folder), run_output_kind());
  if (!out.has_results()) {
    throw IoError(out.marker_path().string() + ": not found; expected a folder of `dynains run`");
  }
  check_run_is_finished(folder);
  return out;
}

void write_page(const fs::path& page, const fs::path& folder, const nlohmann::ordered_json& report,
                const Recording& recording, std::size_t max_points) {
  const viewer::ViewData data =
      viewer::view_of_run(recording, files_of(folder, report, recording), max_points);
  AtomicFile file(page);
  viewer::write_page(file.stream(), data);
  file.commit();
}

fs::path add_page(const fs::path& folder, const OpenRecording& open, std::size_t max_points) {
  ResultFolder out = open_finished_run(folder);
  AddedFile page(out, kViewPage);
  write_page(page.path(), out.path(), out.marker(), open(out.marker_path(), out.marker()),
             max_points);
  page.put_in_place(out.marker());
  return out.path() / kViewPage;
}

}  // namespace dynains::program
