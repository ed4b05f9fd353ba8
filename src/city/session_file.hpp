// The file of a session. Numbers are little endian, checksums FNV-1a of 64 bits. In this order:
//
//  "DYNSESS5"
//  blocks, each with the uint64 checksum of its bytes behind it; the last one is the JSON:
//    tiles: for each point float x, y (m, from the corner of the tile), z (m, world); uint32 number
//    of its scan, label of the recording or 0, 1 for ground, else 0
//    references: 12 double, the upper three rows of T_world_sensor, row by row; then the image, see
//    pack_image()
//    JSON of SessionInfo, with the offset and the size (bytes) of each block before
//  uint64 size of the JSON
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <ostream>
#include <string>

#include "dynains/city/session.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "io/folder.hpp"

namespace dynains {

/// Writes the file of a session to a stream. Errors set the state of the stream.
class SessionFileWriter {
 public:
  explicit SessionFileWriter(std::ostream& stream);
  SessionBlock add(Span<const char> bytes);
  /// Writes what is behind the blocks.
  void finish(const SessionInfo& session);

 private:
  void write(Span<const char> bytes);

  std::ostream& stream_;
  std::uint64_t position_ = 0;
};

/// The upper three rows of a pose, row by row.
using PoseRows = std::array<double, 12>;
PoseRows rows_of(const Pose& T);
Pose pose_of(const PoseRows& rows);

/// The folder of a city with an exclusive lock. Waits up to ten minutes, since others hold it while
/// they write a session. Throws UsageError, IoError.
Folder lock_city(const std::filesystem::path& path);

/// Throw IoError with path and byte.
SessionInfo read_session(const std::filesystem::path& path);
std::string read_block(const std::filesystem::path& path, const SessionBlock& block);

}  // namespace dynains
