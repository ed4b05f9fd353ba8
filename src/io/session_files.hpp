// The files of a session of a city. docs/scale.md describes them byte by byte.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "dynains/evidence/session_references.hpp"
#include "dynains/io/city.hpp"
#include "dynains/io/folder_lock.hpp"
#include "dynains/map/session_points.hpp"

namespace dynains::session_files {

inline constexpr const char* kCityFile = "city.json";
inline constexpr const char* kSessionFile = "session.json";
inline constexpr const char* kReferenceFile = "references.bin";
inline constexpr const char* kTileFolder = "tiles";

/// X_Y.tile
std::string tile_name(const TileIndex& tile);

std::string tile_bytes(const SessionGrid& grid, const TileIndex& tile,
                       const std::vector<SessionPoint>& points);
/// Throws IoError with path, byte and expectation.
std::vector<SessionPoint> read_tile(const std::filesystem::path& path, const SessionGrid& grid,
                                    const TileIndex& tile);

inline constexpr std::uint64_t kReferenceHeaderBytes = 48;
std::string reference_header(const RangeImageGrid& grid);
/// The bytes of a record, held by `buffer`, whose memory is used again.
Span<const char> reference_record(const SessionReference& reference, std::vector<char>& buffer);

/// The text of city.json and session.json. Throws IoError without JSON.
std::string city_text(const SessionGrid& grid);
SessionGrid read_city(const std::filesystem::path& path);
std::string session_text(const SessionInfo& session);
SessionInfo read_session(const std::filesystem::path& path);
/// Throws ConfigError unless `text` is empty or JSON.
void check_config_text(const std::string& text);

/// Exclusive lock of a city. Waits up to a minute, since others hold it for moments only. Throws
/// UsageError, IoError.
FolderLock lock_city(const std::filesystem::path& folder);

/// Whether a name in a city is that of a folder that SessionWriter stages or City::drop() removes.
bool is_staging_name(const std::string& name);
/// A new folder of that kind for a session. Throws IoError.
std::filesystem::path make_staging(const std::filesystem::path& city, const std::string& session);
/// Removes the files of a session from a folder, and the folder. Foreign files stay, and the folder
/// with them. What can be removed is removed; then throws IoError if something of ours stays.
void remove_session_files(const std::filesystem::path& folder);
/// Path of the first entry of a folder that is not part of a session; empty if there is none.
std::filesystem::path foreign_entry(const std::filesystem::path& folder);

}  // namespace dynains::session_files
