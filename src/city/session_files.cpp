#include "session_files.hpp"

#include <cmath>
#include <cstring>

#include "dynains/errors.hpp"
#include "io/byte_reader.hpp"
#include "io/failure.hpp"
#include "io/fingerprint.hpp"
#include "io/scalar.hpp"

namespace dynains {
namespace session_files {
namespace {

namespace fs = std::filesystem;

constexpr char kTileMagic[9] = "DYNSTILE";
constexpr char kReferenceMagic[9] = "DYNSREFS";
constexpr std::uint64_t kTileHeaderBytes = 48;
constexpr std::uint64_t kPointBytes = 24;
constexpr std::uint64_t kRecordHeaderBytes = 112;  // scan, pose, size
constexpr std::uint64_t kMostImageBytes = std::uint64_t{1} << 26U;

std::uint64_t checksum(const char* data, std::size_t size) {
  Fingerprint fingerprint;
  fingerprint.add(data, size);
  return fingerprint.value();
}

template <class T>
T number_at(const std::string& bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof(value));
  return value;
}

template <class T>
void put_number(const T& value, char* to) {
  std::memcpy(to, &value, sizeof(value));
}

/// Throws IoError unless the bytes end with their checksum, which begins at byte `offset` of the
/// file.
void check_sum(const fs::path& path, const std::string& bytes, std::uint64_t offset) {
  const std::size_t size = bytes.size() - sizeof(std::uint64_t);
  if (number_at<std::uint64_t>(bytes, size) == checksum(bytes.data(), size)) return;
  fail_at_byte(path, offset, "expected the checksum of the bytes before; the file is damaged");
}

void check_magic(const fs::path& path, const std::string& header, const char* magic) {
  if (header.compare(0, 8, magic) != 0) {
    fail_at_byte(path, 0, std::string("expected \"") + magic + '"');
  }
  const auto version = number_at<std::uint32_t>(header, 8);
  if (version != kVersion) {
    fail_at_byte(
        path, 8,
        "version " + std::to_string(version) + "; expected version " + std::to_string(kVersion));
  }
}

bool is_within(const SessionGrid& grid, const SessionPoint& point) {
  const auto most = static_cast<float>(grid.tile);
  return point.x >= 0.0F && point.x <= most && point.y >= 0.0F && point.y <= most &&
         std::abs(point.z) < 1e6F;
}

}  // namespace

std::string tile_name(const TileIndex& tile) {
  return std::to_string(tile[0]) + '_' + std::to_string(tile[1]) + kTileEnd;
}

std::string tile_bytes(const SessionGrid& grid, const TileIndex& tile,
                       const std::vector<SessionPoint>& points) {
  std::string bytes(kTileMagic, 8);
  bytes.reserve(kTileHeaderBytes + kPointBytes * points.size() + 8);
  append_number(kVersion, bytes);
  append_number(std::uint32_t{0}, bytes);
  append_number(grid.map_voxel, bytes);
  append_number(grid.tile, bytes);
  append_number(tile[0], bytes);
  append_number(tile[1], bytes);
  append_number(static_cast<std::uint64_t>(points.size()), bytes);
  bytes.resize(kTileHeaderBytes + kPointBytes * points.size());
  char* to = bytes.data() + kTileHeaderBytes;
  for (const SessionPoint& point : points) {
    put_number(point.x, to);
    put_number(point.y, to + 4);
    put_number(point.z, to + 8);
    put_number(point.scan, to + 12);
    put_number(point.label, to + 16);
    put_number(std::uint32_t{point.is_ground ? 1U : 0U}, to + 20);
    to += kPointBytes;
  }
  append_number(checksum(bytes.data(), bytes.size()), bytes);
  return bytes;
}

std::vector<SessionPoint> read_tile(const fs::path& path, const SessionGrid& grid,
                                    const TileIndex& tile) {
  ByteReader file(path);
  std::string bytes = file.read_block(kTileHeaderBytes, "the header of a tile");
  check_magic(path, bytes, kTileMagic);
  const bool has_grid =
      number_at<double>(bytes, 16) == grid.map_voxel && number_at<double>(bytes, 24) == grid.tile;
  if (!has_grid) fail_at_byte(path, 16, "expected map_voxel and tile of city.json");
  const bool has_index = number_at<std::int32_t>(bytes, 32) == tile[0] &&
                         number_at<std::int32_t>(bytes, 36) == tile[1];
  if (!has_index) fail_at_byte(path, 32, "expected the indices of the name of the file");
  const auto count = number_at<std::uint64_t>(bytes, 40);
  const std::uint64_t left = file.remaining();
  if (left < 8 || (left - 8) % kPointBytes != 0 || (left - 8) / kPointBytes != count) {
    fail_at_byte(path, 40,
                 std::to_string(count) + " points of " + std::to_string(kPointBytes) +
                     " bytes and a checksum of 8; found " + std::to_string(left) + " bytes");
  }
  bytes += file.read_block(left, "the points of a tile");
  check_sum(path, bytes, kTileHeaderBytes + kPointBytes * count);
  std::vector<SessionPoint> points(static_cast<std::size_t>(count));
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::size_t at = kTileHeaderBytes + kPointBytes * i;
    points[i] = {number_at<float>(bytes, at),
                 number_at<float>(bytes, at + 4),
                 number_at<float>(bytes, at + 8),
                 number_at<std::uint32_t>(bytes, at + 12),
                 number_at<std::uint32_t>(bytes, at + 16),
                 number_at<std::uint32_t>(bytes, at + 20) != 0};
    if (!is_within(grid, points[i])) fail_at_byte(path, at, "expected a point within the tile");
  }
  return points;
}

std::string reference_header(const RangeImageGrid& grid) {
  std::string bytes(kReferenceMagic, 8);
  append_number(kVersion, bytes);
  append_number(grid.rows, bytes);
  append_number(grid.columns, bytes);
  append_number(grid.lowest, bytes);
  append_number(grid.rows_per_level, bytes);
  append_number(grid.columns_per_radian, bytes);
  append_number(grid.last_inner_row, bytes);
  append_number(grid.hole_rows, bytes);
  append_number(checksum(bytes.data(), bytes.size()), bytes);
  return bytes;
}

Span<const char> reference_record(const RecordingReference& reference, std::vector<char>& buffer) {
  detail::grow(buffer, kRecordHeaderBytes + most_packed_bytes(reference.image.grid()) + 8);
  char* const image = buffer.data() + kRecordHeaderBytes;
  auto* const packed = reinterpret_cast<std::uint8_t*>(image);
  const auto size = static_cast<std::size_t>(pack_image(reference.image, packed) - packed);
  put_number(std::uint64_t{reference.scan}, buffer.data());
  for (std::size_t i = 0; i < 12; ++i) {
    put_number(
        reference.T_world_beams(static_cast<Eigen::Index>(i / 4), static_cast<Eigen::Index>(i % 4)),
        buffer.data() + 8 + 8 * i);
  }
  put_number(std::uint64_t{size}, buffer.data() + 104);
  put_number(checksum(buffer.data(), kRecordHeaderBytes + size), image + size);
  return {buffer.data(), kRecordHeaderBytes + size + 8};
}

}  // namespace session_files

namespace {

/// Values that RangeImageGrid::for_sensor() can give.
bool is_plausible(const RangeImageGrid& grid) {
  return grid.rows > 0 && grid.rows <= 2000 && grid.columns > 0 && grid.columns <= 4000 &&
         std::isfinite(grid.lowest) && std::isfinite(grid.rows_per_level) &&
         std::isfinite(grid.columns_per_radian);
}

}  // namespace

SessionReferenceReader::SessionReferenceReader(const City& city, const SessionInfo& session)
    : path_(city.session_folder(session.name) / session_files::kReferenceFile) {
  using namespace session_files;
  if (session.references == 0) return;
  ByteReader file(path_);
  const std::string header = file.read_block(kReferenceHeaderBytes, "the header of references");
  check_magic(path_, header, kReferenceMagic);
  check_sum(path_, header, kReferenceHeaderBytes - 8);
  grid_.rows = number_at<std::int32_t>(header, 12);
  grid_.columns = number_at<std::int32_t>(header, 16);
  grid_.lowest = number_at<float>(header, 20);
  grid_.rows_per_level = number_at<float>(header, 24);
  grid_.columns_per_radian = number_at<float>(header, 28);
  grid_.last_inner_row = number_at<std::int32_t>(header, 32);
  grid_.hole_rows = number_at<std::int32_t>(header, 36);
  if (!is_plausible(grid_)) fail_at_byte(path_, 12, "expected the grid of a range image");
  while (file.remaining() > 0) {
    const std::uint64_t offset = file.position();
    const std::string record = file.read_block(kRecordHeaderBytes, "a reference");
    const auto size = number_at<std::uint64_t>(record, 104);
    if (size > kMostImageBytes) fail_at_byte(path_, offset + 104, "expected at most 64 MB");
    file.skip(size + 8, "the image of a reference and its checksum");
    const Eigen::Vector3d sensor(number_at<double>(record, 32), number_at<double>(record, 64),
                                 number_at<double>(record, 96));
    entries_.push_back(
        {static_cast<std::uint32_t>(number_at<std::uint64_t>(record, 0)), sensor, offset});
  }
  if (entries_.size() != session.references) {
    fail_at_byte(path_, file.position(),
                 std::to_string(entries_.size()) + " references; expected " +
                     std::to_string(session.references));
  }
}

void SessionReferenceReader::read(const Entry& entry, RecordingReference& reference) const {
  using namespace session_files;
  ByteReader file(path_);
  file.skip(entry.offset, "a reference");
  std::string record = file.read_block(kRecordHeaderBytes, "a reference");
  const auto size = number_at<std::uint64_t>(record, 104);
  if (size > kMostImageBytes) fail_at_byte(path_, entry.offset + 104, "expected at most 64 MB");
  record.resize(kRecordHeaderBytes + size + 8);
  file.read(record.data() + kRecordHeaderBytes, size + 8, "the image of a reference");
  check_sum(path_, record, entry.offset + kRecordHeaderBytes + size);
  reference.scan = entry.scan;
  for (std::size_t i = 0; i < 12; ++i) {
    reference.T_world_beams(static_cast<Eigen::Index>(i / 4), static_cast<Eigen::Index>(i % 4)) =
        number_at<double>(record, 8 + 8 * i);
  }
  const auto* const image = reinterpret_cast<const std::uint8_t*>(record.data());
  if (!unpack_image(grid_, {image + kRecordHeaderBytes, size}, reference.image)) {
    fail_at_byte(path_, entry.offset + kRecordHeaderBytes, "expected a coded range image");
  }
}

}  // namespace dynains
