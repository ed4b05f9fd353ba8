#include "session_json.hpp"

#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "dynains/errors.hpp"
#include "io/byte_reader.hpp"
#include "io/failure.hpp"
#include "io/fingerprint.hpp"
#include "io/scalar.hpp"
#include "session_files.hpp"

namespace dynains::session_files {
namespace {

namespace fs = std::filesystem;

using Json = nlohmann::ordered_json;

constexpr const char* kCityFormat = "dynains city";
constexpr const char* kSessionFormat = "dynains session";
constexpr const char* kChecksum = "checksum";
constexpr std::uint64_t kMostJsonBytes = std::uint64_t{64} << 20U;

Json read_json(const fs::path& path, const char* format) {
  ByteReader file(path);
  if (file.remaining() > kMostJsonBytes) fail(path, "expected at most 64 MB of JSON");
  const std::string text = file.read_block(file.remaining(), "JSON");
  Json json;
  try {
    json = Json::parse(text);
    const std::size_t zero = text.find('\0');  // the parser ends there
    if (zero != std::string::npos) fail_at_byte(path, zero, "expected nothing behind the JSON");
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

/// `where`: path of the object that has the field, for messages.
template <std::size_t kCount>
std::array<double, kCount> numbers_field(const fs::path& path, const Json& json, const char* name,
                                         const std::string& where, const char* expectation) {
  const auto values = field<Json>(path, json, name, &Json::is_array, expectation);
  std::array<double, kCount> numbers{};
  for (std::size_t i = 0; i < kCount; ++i) {
    if (values.size() != kCount || !values[i].is_number()) {
      fail(path, where + name + ": expected " + expectation);
    }
    numbers[i] = values[i].template get<double>();
  }
  return numbers;
}

Eigen::Vector3d vector_field(const fs::path& path, const Json& json, const char* name) {
  const auto numbers = numbers_field<3>(path, json, name, "/", "three numbers");
  return Eigen::Vector3d(numbers.data());
}

/// The upper three rows, row by row.
Json json_of(const Pose& T) {
  Json values = Json::array();
  for (Eigen::Index row = 0; row < 3; ++row) {
    for (Eigen::Index column = 0; column < 4; ++column) values.push_back(T(row, column));
  }
  return values;
}

Pose transform_field(const fs::path& path, const Json& json, const char* name) {
  const auto numbers = numbers_field<12>(path, json, name, "/alignment/", "twelve numbers");
  Pose T = Pose::Identity();
  for (std::size_t i = 0; i < 12; ++i) {
    T(static_cast<Eigen::Index>(i / 4), static_cast<Eigen::Index>(i % 4)) = numbers[i];
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

/// The checksum of all fields that precede it.
std::string checksum_of(const Json& fields) {
  Fingerprint fingerprint;
  fingerprint.add(text_of(fields));
  return fingerprint.text();
}

void check_sum(const fs::path& path, Json json, Checksum checksum) {
  const auto found = json.find(kChecksum);
  if (found == json.end() && checksum == Checksum::kIfPresent) return;
  const std::string expected = found == json.end() ? "" : found->dump();
  json.erase(kChecksum);
  if (expected == '"' + checksum_of(json) + '"') return;
  fail(path, "/checksum: expected that of the other fields; the file was changed");
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
  json[kChecksum] = checksum_of(json);
  return text_of(json);
}

SessionInfo read_session(const fs::path& path, Checksum checksum) {
  const Json json = read_json(path, kSessionFormat);
  check_sum(path, json, checksum);
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

}  // namespace dynains::session_files
