#include "point_tile.hpp"

#include <cstdint>
#include <nlohmann/json.hpp>

namespace dynains::viewer {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kHeaderBytes = 28;
constexpr std::size_t kAlignment = 8;  // bytes, of each part of the file

template <class Number>
void append(Number value, std::string& bytes) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

/// Pads a part that begins `before` bytes after a multiple of kAlignment.
std::string padded(std::string part, char filler, std::size_t before = 0) {
  while ((before + part.size()) % kAlignment != 0) part += filler;
  return part;
}

/// The table of attributes: its description and its columns, widest first, so that each is aligned.
class BatchTable {
 public:
  template <class Value>
  void add(const char* name, const char* type, const std::vector<TilePoint>& points,
           Value TilePoint::*member) {
    description_[name] = {
        {"byteOffset", bytes_.size()}, {"componentType", type}, {"type", "SCALAR"}};
    for (const TilePoint& point : points) append(point.*member, bytes_);
  }
  std::string json() const { return description_.is_null() ? std::string() : description_.dump(); }
  const std::string& bytes() const { return bytes_; }

 private:
  Json description_;
  std::string bytes_;
};

}  // namespace

std::string encode_point_tile(const std::vector<TilePoint>& points, const TileCube& cube,
                              const Eigen::Vector3d& centre, const PointColumns& columns) {
  std::string positions;
  positions.reserve(12 * points.size());
  for (const TilePoint& point : points) {
    const Eigen::Vector3f local = (cube.to_world(point.place) - centre).cast<float>();
    for (const float coordinate : local) append(coordinate, positions);
  }
  BatchTable batch;
  if (columns.time) batch.add("time", "DOUBLE", points, &TilePoint::time);
  if (columns.intensity) batch.add("intensity", "FLOAT", points, &TilePoint::intensity);
  if (columns.label) batch.add("label", "UNSIGNED_INT", points, &TilePoint::label);
  if (columns.session) batch.add("session", "UNSIGNED_SHORT", points, &TilePoint::session);

  const Json features = {{"POINTS_LENGTH", points.size()},
                         {"RTC_CENTER", {centre.x(), centre.y(), centre.z()}},
                         {"POSITION", {{"byteOffset", 0}}}};
  const std::string parts[] = {padded(features.dump(), ' ', kHeaderBytes), padded(positions, '\0'),
                               padded(batch.json(), ' '), padded(batch.bytes(), '\0')};
  std::size_t size = kHeaderBytes;
  for (const std::string& part : parts) size += part.size();
  std::string bytes = "pnts";
  bytes.reserve(size);
  append(std::uint32_t{1}, bytes);
  append(static_cast<std::uint32_t>(size), bytes);
  for (const std::string& part : parts) append(static_cast<std::uint32_t>(part.size()), bytes);
  for (const std::string& part : parts) bytes += part;
  return bytes;
}

}  // namespace dynains::viewer
