#include "session_file.hpp"

#include <array>
#include <nlohmann/json.hpp>

#include "io/byte_reader.hpp"
#include "io/failure.hpp"
#include "io/fingerprint.hpp"
#include "io/scalar.hpp"

namespace dynains {
namespace {

namespace fs = std::filesystem;

using Json = nlohmann::ordered_json;
using Vector = std::array<double, 3>;

constexpr char kMagic[9] = "DYNSESS5";
constexpr std::uint64_t kNumber = sizeof(std::uint64_t);

std::uint64_t checksum(const char* data, std::size_t size) {
  Fingerprint fingerprint;
  fingerprint.add(data, size);
  return fingerprint.value();
}

Json json_of(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
Eigen::Vector3d vector_of(const Json& json) { return Eigen::Vector3d(json.get<Vector>().data()); }

/// Calls `field(name, value)` for all that JSON holds as it is.
template <class Session, class Field>
void visit(Session& session, Field&& field) {
  field("begin", session.begin);
  field("recording", session.recording);
  field("fingerprint", session.fingerprint);
  field("configuration", session.config);
  field("margin", session.evidence.margin);
  field("margin_slope", session.evidence.margin_slope);
  field("lateral_margin", session.evidence.lateral_margin);
  field("map_voxel", session.grid.map_voxel);
  field("tile", session.grid.tile);
  field("scans", session.scans);
  field("points", session.points);
}

Json json_of(const SessionAlignment& alignment) {
  return {{"T_city_session", rows_of(alignment.T_city_session)},
          {"T_city_start", rows_of(alignment.T_city_start)},
          {"residual", alignment.residual},
          {"fitting", alignment.fitting},
          {"uncertainty", alignment.uncertainty},
          {"sessions", alignment.sessions}};
}
SessionAlignment alignment_of(const Json& json) {
  return {pose_of(json.at("T_city_session").get<PoseRows>()),
          pose_of(json.at("T_city_start").get<PoseRows>()),
          json.at("residual"),
          json.at("fitting"),
          json.at("uncertainty"),
          json.at("sessions")};
}

Json json_of(const RangeImageGrid& grid) {
  return {grid.rows,     grid.columns, grid.lowest, grid.rows_per_level, grid.columns_per_radian,
          grid.hole_rows};
}
RangeImageGrid image_grid_of(const Json& json) {
  return {json.at(0), json.at(1), json.at(2), json.at(3), json.at(4), json.at(5)};
}

Json json_of(const SessionInfo& session) {
  Json tiles = Json::array(), references = Json::array();
  for (const auto& [tile, block] : session.tiles) {
    tiles.push_back({tile[0], tile[1], block.offset, block.size});
  }
  for (const SessionReference& reference : session.references) {
    references.push_back(
        {reference.scan, json_of(reference.sensor), reference.block.offset, reference.block.size});
  }
  Json json;
  visit(session, [&](const char* name, const auto& value) { json[name] = value; });
  json["lowest"] = json_of(session.lowest);
  json["highest"] = json_of(session.highest);
  json["image_grid"] = json_of(session.image_grid);
  json["tiles"] = tiles;
  json["references"] = references;
  if (session.alignment) json["alignment"] = json_of(*session.alignment);
  return json;
}

SessionInfo session_of(const Json& json) {
  SessionInfo session;
  visit(session, [&](const char* name, auto& value) { json.at(name).get_to(value); });
  session.lowest = vector_of(json.at("lowest"));
  session.highest = vector_of(json.at("highest"));
  session.image_grid = image_grid_of(json.at("image_grid"));
  for (const Json& tile : json.at("tiles")) {
    session.tiles[{tile.at(0), tile.at(1)}] = {tile.at(2), tile.at(3)};
  }
  for (const Json& reference : json.at("references")) {
    session.references.push_back(
        {reference.at(0), vector_of(reference.at(1)), {reference.at(2), reference.at(3)}});
  }
  if (json.contains("alignment")) session.alignment = alignment_of(json.at("alignment"));
  session.grid.validate();
  return session;
}

}  // namespace

PoseRows rows_of(const Pose& T) {
  PoseRows rows;
  for (int i = 0; i < 12; ++i) rows[static_cast<std::size_t>(i)] = T(i / 4, i % 4);
  return rows;
}

Pose pose_of(const PoseRows& rows) {
  Pose T = Pose::Identity();
  for (int i = 0; i < 12; ++i) T(i / 4, i % 4) = rows[static_cast<std::size_t>(i)];
  return T;
}

SessionFileWriter::SessionFileWriter(std::ostream& stream) : stream_(stream) { write({kMagic, 8}); }

void SessionFileWriter::write(Span<const char> bytes) {
  stream_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  position_ += bytes.size();
}

SessionBlock SessionFileWriter::add(Span<const char> bytes) {
  const SessionBlock block = {position_, bytes.size()};
  write(bytes);
  write(ByteWriter().number(checksum(bytes.data(), bytes.size())).bytes());
  return block;
}

void SessionFileWriter::finish(const SessionInfo& session) {
  const std::string text = json_of(session).dump(1, ' ', false, Json::error_handler_t::replace);
  write(ByteWriter().number(add(text).size).bytes());
}

SessionInfo read_session(const fs::path& path) {
  ByteReader file(path);
  const std::uint64_t size = file.remaining();
  if (file.read_block(8, "a session") != kMagic) {
    fail_at_byte(path, 0, std::string("expected \"") + kMagic + '"');
  }
  if (size < 8 + 2 * kNumber) fail_at_byte(path, size, "expected a whole session");
  file.skip(size - 8 - kNumber, "a session");
  std::uint64_t length = 0;
  file.read(&length, 1, "a session");
  if (length > size - 8 - 2 * kNumber) {
    fail_at_byte(path, size - kNumber, "expected the size of the JSON before");
  }
  const std::uint64_t begin = size - 2 * kNumber - length;
  try {
    SessionInfo session = session_of(Json::parse(read_block(path, {begin, length})));
    session.name = path.stem().string();
    return session;
  } catch (const Json::exception& error) {
    fail_at_byte(path, begin, std::string("expected JSON of a session: ") + error.what());
  } catch (const ConfigError& error) {
    fail_at_byte(path, begin, error.what());
  }
}

std::string read_block(const fs::path& path, const SessionBlock& block) {
  ByteReader file(path);
  file.skip(block.offset, "a part of a session");
  std::string bytes = file.read_block(block.size, "a part of a session");
  std::uint64_t sum = 0;
  file.read(&sum, 1, "a checksum");
  if (sum != checksum(bytes.data(), bytes.size())) {
    fail_at_byte(path, block.offset, "expected the checksum behind the bytes; the file is damaged");
  }
  return bytes;
}

}  // namespace dynains
