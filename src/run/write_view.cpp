#include "write_view.hpp"

#include <algorithm>
#include <string>

#include "dynains/errors.hpp"
#include "dynains/evidence/free_space_config.hpp"
#include "dynains/io/atomic_file.hpp"
#include "json_file.hpp"
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

viewer::RunFiles files_of(const OutputFolder& out, const Recording& recording) {
  const fs::path report = out.path() / out.kind().marker;
  const auto& json = out.marker();
  viewer::RunFiles files;
  files.folder = out.path();
  const auto text = [&](const char* field) {
    return required_json_field<std::string>(report, json, field);
  };
  files.first = scan_named(recording, text("/first_scan"), report);
  files.last = scan_named(recording, text("/last_scan"), report);
  if (files.last < files.first) {
    throw IoError(report.string() + ": /last_scan: expected a scan after /first_scan");
  }
  const FreeSpaceConfig defaults;
  const auto scans = [&](const std::string& name, int value) {
    const auto given = json_field<double>(report, json, "/configuration/" + name);
    return static_cast<std::size_t>(std::clamp(given.value_or(value), 0.0, 1e9));
  };
  files.references = viewer::ReferenceWindow(
      scans("lookback_scans", defaults.lookback_scans),
      scans("lookahead_scans", defaults.lookahead_scans),
      std::max<std::size_t>(scans("reference_step", defaults.reference_step), 1));
  const auto map = json_field<std::string>(report, json, "/static_map/file");
  if (map) files.map = out.path() / *map;
  return files;
}

}  // namespace

OutputFolder open_finished_run(const fs::path& folder) {
  OutputFolder out(Folder(folder), run_output_kind());
  if (!out.has_results()) {
    throw IoError(out.path().string() + ": holds no results; expected a folder of `dynains run`");
  }
  if (!out.is_complete()) {
    throw IoError(out.path().string() +
                  ": the run was interrupted; complete it first by dynains run --resume");
  }
  return out;
}

fs::path write_view(OutputFolder& out, const Recording& recording, std::size_t max_points) {
  OutputListing listing = out.listing();
  listing.files.insert(kViewPage);
  out.check(listing, InputFiles());
  const viewer::ViewData data =
      viewer::view_of_run(recording, files_of(out, recording), max_points);
  const fs::path page = out.path() / kViewPage;
  AtomicFile file(page);
  viewer::write_page(file.stream(), data);
  // Listed first: a page that is not listed would count as a file of the user.
  out.mark(nlohmann::ordered_json(out.marker()), listing);
  file.commit();
  return page;
}

fs::path write_view(const fs::path& folder, const OpenRecording& open, std::size_t max_points) {
  if (!fs::is_directory(folder)) {
    throw IoError(folder.string() + ": no such folder; expected a folder of `dynains run`");
  }
  const LockedFolder lock(folder);
  OutputFolder out = open_finished_run(folder);
  return write_view(out, open(out.path() / out.kind().marker, out.marker()), max_points);
}

}  // namespace dynains::program
