// Folders with the map as OGC 3D Tiles.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "run/output_folder.hpp"
#include "run/output_listing.hpp"

namespace dynains::program {

/// A folder that has nothing but a tileset: `dynains map CITY export FOLDER --format 3dtiles`.
const OutputKind& tileset_output_kind();

/// The files of a tileset.
OutputListing tileset_listing();

/// Marker of a folder of the kind above, without the listing.
nlohmann::ordered_json tileset_marker(bool complete);

/// Writes the static map of a run as a tileset into its folder, and lists it in report.json. A
/// tileset that is newer than the map stays. Unless `quiet`, shows the progress. Throws IoError;
/// Interrupted after a signal.
void write_run_tileset(OutputFolder& out, bool quiet);

}  // namespace dynains::program
