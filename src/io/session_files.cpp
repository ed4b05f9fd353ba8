#include "session_files.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <random>
#include <system_error>
#include <thread>

#include "byte_reader.hpp"
#include "dynains/errors.hpp"
#include "failure.hpp"
#include "fingerprint.hpp"
#include "scalar.hpp"

#if defined(DYNAINS_HAS_JSON)
#include <nlohmann/json.hpp>
#endif

namespace dynains {
namespace session_files {
namespace {

namespace fs = std::filesystem;

constexpr char kTileMagic[9] = "DYNSTILE";
constexpr char kReferenceMagic[9] = "DYNSREFS";
constexpr std::uint32_t kVersion = 1;
constexpr std::uint64_t kTileHeaderBytes = 48;
constexpr std::uint64_t kPointBytes = 24;
constexpr std::uint64_t kRecordHeaderBytes = 112;  // scan, pose, size
constexpr std::uint64_t kMostImageBytes = std::uint64_t{1} << 26U;
constexpr const char* kTileEnd = ".tile";
constexpr const char* kStagingEnd = ".staging";
constexpr std::size_t kRandomDigits = 16;

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

std::string read_block(ByteReader& file, std::uint64_t size, const char* purpose) {
  std::string bytes(static_cast<std::size_t>(size), '\0');
  file.read(bytes.data(), bytes.size(), purpose);
  return bytes;
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
  std::string bytes = read_block(file, kTileHeaderBytes, "the header of a tile");
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
  bytes += read_block(file, left, "the points of a tile");
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

Span<const char> reference_record(const SessionReference& reference, std::vector<char>& buffer) {
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

FolderLock lock_city(const fs::path& folder) {
  using namespace std::chrono_literals;
  const auto end = std::chrono::steady_clock::now() + 60s;
  while (true) {
    try {
      return FolderLock(folder);
    } catch (const UsageError&) {
      if (std::chrono::steady_clock::now() > end) throw;
    }
    std::this_thread::sleep_for(20ms);
  }
}

bool is_staging_name(const std::string& name) {
  const std::size_t end_size = std::strlen(kStagingEnd);
  if (name.size() < 2 + 1 + kRandomDigits + end_size || name.front() != '.') return false;
  const std::size_t digits = name.size() - end_size - kRandomDigits;
  return name.compare(name.size() - end_size, end_size, kStagingEnd) == 0 &&
         name[digits - 1] == '.' &&
         name.find_first_not_of("0123456789abcdef", digits) == name.size() - end_size;
}

fs::path make_staging(const fs::path& city, const std::string& session) {
  std::random_device random;
  std::string digits;
  for (std::size_t i = 0; i < kRandomDigits; ++i) digits += "0123456789abcdef"[random() % 16];
  fs::path folder = city / ('.' + session + '.' + digits + kStagingEnd);
  std::error_code error;
  if (!fs::create_directory(folder, error)) {
    fail_by_system(folder, "cannot be created", error ? error.value() : EEXIST);
  }
  return folder;
}

fs::path foreign_entry(const fs::path& folder) {
  const auto is_one_of_ours = [&](const fs::directory_entry& entry) {
    const std::string name = entry.path().filename().string();
    if (entry.is_symlink()) return false;
    if (entry.is_directory()) return name == kTileFolder;
    return entry.is_regular_file() && (name == kSessionFile || name == kReferenceFile);
  };
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (!is_one_of_ours(entry)) return entry.path();
  }
  if (!fs::exists(folder / kTileFolder)) return {};
  for (const auto& entry : fs::directory_iterator(folder / kTileFolder)) {
    const bool is_tile =
        entry.is_regular_file() && !entry.is_symlink() && entry.path().extension() == kTileEnd;
    if (!is_tile) return entry.path();
  }
  return {};
}

void remove_session_files(const fs::path& folder) {
  fs::path kept;
  std::error_code first_error;
  const auto note = [&](const fs::path& path, const std::error_code& error) {
    if (!error || first_error) return;
    kept = path;
    first_error = error;
  };
  std::error_code error;
  const auto remove = [&](const fs::path& path) {
    fs::remove(path, error);
    if (error != std::errc::directory_not_empty) note(path, error);
  };
  const auto is_folder = [&](const fs::path& path) {
    return fs::is_directory(fs::symlink_status(path, error));
  };
  if (!is_folder(folder)) return;
  const fs::path tiles = folder / kTileFolder;
  if (is_folder(tiles)) {
    std::vector<fs::path> files;
    for (fs::directory_iterator entry(tiles, error), end; !error && entry != end;
         entry.increment(error)) {
      if (entry->path().extension() == kTileEnd) files.push_back(entry->path());
    }
    note(tiles, error);
    for (const fs::path& file : files) {
      if (!is_folder(file)) remove(file);
    }
    remove(tiles);
  }
  for (const char* const name : {kReferenceFile, kSessionFile}) {
    if (!is_folder(folder / name)) remove(folder / name);
  }
  remove(folder);
  if (first_error) fail_by_system(kept, "cannot be removed", first_error.value());
}

#if defined(DYNAINS_HAS_JSON)

namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kCityFormat = "dynains city";
constexpr const char* kSessionFormat = "dynains session";
constexpr std::uint64_t kMostJsonBytes = std::uint64_t{64} << 20U;

Json read_json(const fs::path& path, const char* format) {
  ByteReader file(path);
  if (file.remaining() > kMostJsonBytes) fail(path, "expected at most 64 MB of JSON");
  const std::string text = read_block(file, file.remaining(), "JSON");
  Json json;
  try {
    json = Json::parse(text);
  } catch (const Json::parse_error& error) {
    fail_at_byte(path, error.byte, "expected JSON");
  }
  if (!json.is_object() || json.value("format", Json()) != format) {
    fail(path, std::string("/format: expected \"") + format + '"');
  }
  if (json.value("format_version", Json()) != kVersion) {
    fail(path, "/format_version: " + json.value("format_version", Json()).dump() +
                   "; expected version " + std::to_string(kVersion));
  }
  return json;
}

/// The value of a field. Throws IoError with its name and the expectation.
template <class T>
T field(const fs::path& path, const Json& json, const char* name,
        bool (Json::*is_type)() const noexcept, const char* expectation) {
  const auto found = json.find(name);
  if (found == json.end() || !((*found).*is_type)()) {
    fail(path, std::string("/") + name + ": expected " + expectation);
  }
  return found->get<T>();
}

double number_field(const fs::path& path, const Json& json, const char* name) {
  return field<double>(path, json, name, &Json::is_number, "a number");
}
std::uint64_t count_field(const fs::path& path, const Json& json, const char* name) {
  return field<std::uint64_t>(path, json, name, &Json::is_number_unsigned, "a whole number");
}
std::string text_field(const fs::path& path, const Json& json, const char* name) {
  return field<std::string>(path, json, name, &Json::is_string, "a text");
}

Eigen::Vector3d vector_field(const fs::path& path, const Json& json, const char* name) {
  const auto values = field<Json>(path, json, name, &Json::is_array, "three numbers");
  Eigen::Vector3d result;
  for (std::size_t i = 0; i < 3; ++i) {
    if (values.size() != 3 || !values[i].is_number()) {
      fail(path, std::string("/") + name + ": expected three numbers");
    }
    result(static_cast<Eigen::Index>(i)) = values[i].get<double>();
  }
  return result;
}

/// The upper three rows, row by row.
Json json_of(const Eigen::Isometry3d& T) {
  Json values = Json::array();
  for (Eigen::Index row = 0; row < 3; ++row) {
    for (Eigen::Index column = 0; column < 4; ++column) values.push_back(T(row, column));
  }
  return values;
}

Eigen::Isometry3d transform_field(const fs::path& path, const Json& json, const char* name) {
  const auto values = field<Json>(path, json, name, &Json::is_array, "twelve numbers");
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  for (std::size_t i = 0; i < 12; ++i) {
    if (values.size() != 12 || !values[i].is_number()) {
      fail(path, std::string("/alignment/") + name + ": expected twelve numbers");
    }
    T(static_cast<Eigen::Index>(i / 4), static_cast<Eigen::Index>(i % 4)) = values[i].get<double>();
  }
  return T;
}

Json json_of(const SessionAlignment& alignment) {
  return {{"T_city_session", json_of(alignment.T_city_session)},
          {"T_city_start", json_of(alignment.T_city_start)},
          {"residual", alignment.residual},
          {"fitting", alignment.fitting},
          {"uncertainty", alignment.uncertainty},
          {"sessions", alignment.sessions}};
}

SessionAlignment alignment_of(const fs::path& path, const Json& json) {
  if (!json.is_object()) fail(path, "/alignment: expected an object");
  SessionAlignment alignment;
  alignment.T_city_session = transform_field(path, json, "T_city_session");
  alignment.T_city_start = transform_field(path, json, "T_city_start");
  alignment.residual = number_field(path, json, "residual");
  alignment.fitting = number_field(path, json, "fitting");
  alignment.uncertainty = number_field(path, json, "uncertainty");
  for (const Json& name : field<Json>(path, json, "sessions", &Json::is_array, "a list of names")) {
    if (!name.is_string()) fail(path, "/alignment/sessions: expected a list of names");
    alignment.sessions.push_back(name.get<std::string>());
  }
  return alignment;
}

std::string text_of(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
}

}  // namespace

std::string city_text(const SessionGrid& grid) {
  return text_of({{"format", kCityFormat},
                  {"format_version", kVersion},
                  {"map_voxel", grid.map_voxel},
                  {"tile", grid.tile}});
}

SessionGrid read_city(const fs::path& path) {
  const Json json = read_json(path, kCityFormat);
  SessionGrid grid;
  grid.map_voxel = number_field(path, json, "map_voxel");
  grid.tile = number_field(path, json, "tile");
  try {
    grid.validate();
  } catch (const ConfigError& error) {
    fail(path, error.what());
  }
  return grid;
}

std::string session_text(const SessionInfo& session) {
  const auto vector = [](const Eigen::Vector3d& v) { return Json({v.x(), v.y(), v.z()}); };
  Json tiles = Json::array();
  for (const auto& [tile, count] : session.tiles) tiles.push_back({tile[0], tile[1], count});
  Json json = {{"format", kSessionFormat},
               {"format_version", kVersion},
               {"begin", session.begin},
               {"recording", session.recording},
               {"fingerprint", session.fingerprint},
               {"scans", session.scans},
               {"points", session.points},
               {"references", session.references},
               {"lowest", vector(session.lowest)},
               {"highest", vector(session.highest)},
               {"tiles", tiles},
               {"configuration", session.config.empty() ? Json() : Json::parse(session.config)}};
  if (session.alignment) json["alignment"] = json_of(*session.alignment);
  return text_of(json);
}

SessionInfo read_session(const fs::path& path) {
  const Json json = read_json(path, kSessionFormat);
  SessionInfo session;
  session.name = path.parent_path().filename().string();
  session.begin = number_field(path, json, "begin");
  session.recording = text_field(path, json, "recording");
  session.fingerprint = text_field(path, json, "fingerprint");
  session.scans = count_field(path, json, "scans");
  session.points = count_field(path, json, "points");
  session.references = count_field(path, json, "references");
  session.lowest = vector_field(path, json, "lowest");
  session.highest = vector_field(path, json, "highest");
  for (const Json& tile : field<Json>(path, json, "tiles", &Json::is_array, "a list of tiles")) {
    const bool is_tile = tile.is_array() && tile.size() == 3 && tile[0].is_number_integer() &&
                         tile[1].is_number_integer() && tile[2].is_number_unsigned();
    if (!is_tile) fail(path, "/tiles: expected rows of x, y and a number of points");
    session.tiles[{tile[0].get<std::int32_t>(), tile[1].get<std::int32_t>()}] =
        tile[2].get<std::uint64_t>();
  }
  const auto alignment = json.find("alignment");
  if (alignment != json.end()) session.alignment = alignment_of(path, *alignment);
  const auto config = json.find("configuration");
  if (config != json.end() && !config->is_null()) session.config = config->dump();
  return session;
}

void check_config_text(const std::string& text) {
  if (!text.empty() && !Json::accept(text)) {
    throw ConfigError("SessionInfo.config: expected JSON or nothing");
  }
}

#else

namespace {

[[noreturn]] void fail_without_json(const fs::path& path) {
  fail(path, "needs JSON, which this build of dynains lacks (nlohmann-json3-dev)");
}

}  // namespace

std::string city_text(const SessionGrid&) { fail_without_json(kCityFile); }
SessionGrid read_city(const fs::path& path) { fail_without_json(path); }
std::string session_text(const SessionInfo&) { fail_without_json(kSessionFile); }
SessionInfo read_session(const fs::path& path) { fail_without_json(path); }
void check_config_text(const std::string&) {}

#endif

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
  const std::string header = read_block(file, kReferenceHeaderBytes, "the header of references");
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
    const std::string record = read_block(file, kRecordHeaderBytes, "a reference");
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

void SessionReferenceReader::read(const Entry& entry, SessionReference& reference) const {
  using namespace session_files;
  ByteReader file(path_);
  file.skip(entry.offset, "a reference");
  std::string record = read_block(file, kRecordHeaderBytes, "a reference");
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
