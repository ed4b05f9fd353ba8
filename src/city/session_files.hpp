// Tiles and references of a session of a city. docs/scale.md describes them byte by byte.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "dynains/city/city.hpp"
#include "dynains/city/session_points.hpp"
#include "dynains/city/session_references.hpp"

namespace dynains::session_files {

inline constexpr const char* kCityFile = "city.json";
inline constexpr const char* kSessionFile = "session.json";
inline constexpr const char* kReferenceFile = "references.bin";
inline constexpr const char* kTileFolder = "tiles";
inline constexpr const char* kTileEnd = ".tile";

/// Version of the formats of all files.
inline constexpr std::uint32_t kVersion = 1;

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

}  // namespace dynains::session_files
