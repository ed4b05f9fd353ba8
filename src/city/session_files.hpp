// Tiles and references of a session of a city. Numbers are little endian, checksums FNV-1a of 64
// bits. By byte:
//
// X_Y.tile, X = floor(x / tile), Y = floor(y / tile)
//  0  "DYNSTILE"; uint32 version; uint32 0
// 16  double map_voxel, tile (m); int32 X, Y; uint64 number of points
// 48  for each point: float x, y (m, from the corner X tile, Y tile), z (m, world);
//     uint32 scan; uint32 label of the recording or 0; uint32 1 for ground, else 0
//     uint64 checksum of all bytes before
//
// references.bin
//  0  "DYNSREFS"; uint32 version
// 12  int32 rows, columns of the images; float lowest level, rows per level, columns per radian;
//     int32 last inner row, hole rows; uint64 checksum of bytes 0 to 39
// 48  for each reference: uint64 scan; 12 double, the upper three rows of T_world_sensor, row by
//     row; uint64 size of the image; image; uint64 checksum of this record
//
// An image holds two ranges per cell, in cm (RangeImage::Cell): `nearest` of all cells row by row,
// then `around`. A range is coded as the difference d to the range before it in its row (the first
// to 0), as the number 2 d for d > 0 and -2 d - 1 for d < 0, in groups of 7 bits, the lowest first,
// bit 7 set in all but the last group. A byte 0 is d = 0; the number behind it counts further
// differences of 0.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "dynains/city/city.hpp"
#include "dynains/city/session_points.hpp"
#include "dynains/recording/references.hpp"

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
Span<const char> reference_record(const RecordingReference& reference, std::vector<char>& buffer);

}  // namespace dynains::session_files
