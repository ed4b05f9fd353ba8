#include "tileset_writer.hpp"

#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "dynains/errors.hpp"
#include "dynains/io/atomic_file.hpp"
#include "page.hpp"
#include "point_tile.hpp"

namespace dynains::viewer {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr double kErrorInCells = 8.0;  // geometric error of a tile, in edges of its cells

/// Which cells of a node have a point.
class OccupiedCells {
 public:
  OccupiedCells() : bits_((std::size_t{1} << (3 * TileNode::kGridBits)) / 64) {}
  /// False if the cell has a point already.
  bool fill(std::uint32_t cell) {
    std::uint64_t& word = bits_[cell / 64];
    const std::uint64_t bit = std::uint64_t{1} << cell % 64;
    const bool is_first = (word & bit) == 0;
    word |= bit;
    return is_first;
  }

 private:
  std::vector<std::uint64_t> bits_;
};

/// The axes of the box are half edges. The margin covers the rounding of positions to float.
Json box_of(const Eigen::AlignedBox3d& bounds, double edge) {
  const double margin = 1e-3 + 0x1p-24 * edge;  // m
  const Eigen::Vector3d centre = bounds.center();
  const Eigen::Vector3d half = (0.5 * bounds.sizes()).array() + margin;
  return {centre.x(), centre.y(), centre.z(), half.x(), 0, 0, 0, half.y(), 0, 0, 0, half.z()};
}

}  // namespace

/// A node while points are added: a list of points, or divided.
struct TilesetWriter::Node {
  explicit Node(TileNode node) : place(std::move(node)) {}

  TileNode place;
  PointSpill::List points;                  // that stay here
  std::unique_ptr<OccupiedCells> occupied;  // null until it is divided
  std::array<std::unique_ptr<Node>, 8> children;
};

TilesetWriter::TilesetWriter(fs::path folder, const PointColumns& columns,
                             const Eigen::Vector3d& lowest, const Eigen::Vector3d& highest)
    : folder_(std::move(folder)),
      columns_(columns),
      cube_(lowest, highest),
      spill_(std::in_place, folder_ / kTilesetFile),
      root_(std::make_unique<Node>(TileNode())) {}

TilesetWriter::~TilesetWriter() = default;

void TilesetWriter::add(const FilePoint& point) {
  TilePoint tile_point;
  tile_point.place = cube_.place_of(point.position);
  tile_point.time = point.time;
  tile_point.intensity = point.intensity;
  tile_point.label = point.label;
  tile_point.session = point.session;
  insert(*root_, tile_point);
  ++size_;
}

void TilesetWriter::insert(Node& start, const TilePoint& point) {
  Node* node = &start;
  while (node->occupied && !node->occupied->fill(node->place.cell_of(point))) {
    const unsigned octant = node->place.octant_of(point);
    std::unique_ptr<Node>& child = node->children[octant];
    if (!child) child = std::make_unique<Node>(node->place.child(octant));
    node = child.get();
  }
  spill_->add(node->points, point);
  const bool is_list = !node->occupied && node->place.depth() < TileNode::kMostDepth;
  if (is_list && node->points.size() > kMostPointsInMemory) divide(*node);
}

void TilesetWriter::divide(Node& node) {
  const std::vector<TilePoint> points = spill_->take(node.points);
  node.occupied = std::make_unique<OccupiedCells>();
  for (const TilePoint& point : points) insert(node, point);
}

TilesetWriter::Written TilesetWriter::write_tile(const TileNode& place,
                                                 const std::vector<TilePoint>& points,
                                                 std::vector<Written> children) {
  const double edge = std::ldexp(cube_.edge(), -place.depth());
  const Eigen::Vector3d centre =
      cube_.to_world(place.corner()) + Eigen::Vector3d::Constant(0.5 * edge);
  const std::string name = place.name() + kPointTileExtension;
  AtomicFile file(folder_ / kTilesetFolder / name);
  file.stream() << encode_point_tile(points, cube_, centre, columns_);
  file.commit(AtomicFile::Sync::kLater);

  Written written;
  for (const TilePoint& point : points) written.bounds.extend(cube_.to_world(point.place));
  for (const Written& child : children) written.bounds.extend(child.bounds);
  const double error = children.empty() ? 0.0 : kErrorInCells * edge / (1U << TileNode::kGridBits);
  written.json = {{"boundingVolume", {{"box", box_of(written.bounds, edge)}}},
                  {"geometricError", error},
                  {"content", {{"uri", std::string(kTilesetFolder) + '/' + name}}},
                  {"extras", {{"points", points.size()}}}};
  for (Written& child : children) written.json["children"].push_back(std::move(child.json));
  return written;
}

TilesetWriter::Written TilesetWriter::write(const TileNode& place, std::vector<TilePoint> points) {
  if (points.size() <= kLeafPoints || place.depth() == TileNode::kMostDepth) {
    return write_tile(place, points, {});
  }
  std::array<std::vector<TilePoint>, 8> passed_on;
  OccupiedCells occupied;
  std::size_t kept = 0;
  for (const TilePoint& point : points) {
    if (occupied.fill(place.cell_of(point))) {
      points[kept++] = point;
    } else {
      passed_on[place.octant_of(point)].push_back(point);
    }
  }
  points.resize(kept);
  std::vector<Written> children;
  for (unsigned octant = 0; octant < 8; ++octant) {
    if (passed_on[octant].empty()) continue;
    children.push_back(write(place.child(octant), std::move(passed_on[octant])));
  }
  return write_tile(place, points, std::move(children));
}

TilesetWriter::Written TilesetWriter::write(Node& node) {
  if (!node.occupied) return write(node.place, spill_->take(node.points));
  node.occupied.reset();
  std::vector<Written> children;
  for (std::unique_ptr<Node>& child : node.children) {
    if (!child) continue;
    children.push_back(write(*child));
    child.reset();
  }
  return write_tile(node.place, spill_->take(node.points), std::move(children));
}

void TilesetWriter::commit() {
  std::error_code error;
  fs::create_directory(folder_ / kTilesetFolder, error);
  if (error) {
    throw IoError((folder_ / kTilesetFolder).string() + ": cannot be created: " + error.message());
  }
  Written root = write(*root_);
  spill_.reset();
  root.json["refine"] = "ADD";
  Json names = Json::array();
  if (columns_.time) names.push_back("time");
  if (columns_.intensity) names.push_back("intensity");
  if (columns_.label) names.push_back("label");
  if (columns_.session) names.push_back("session");
  const Json tileset = {{"asset", {{"version", "1.0"}, {"generator", "dynains"}}},
                        {"geometricError", kErrorInCells * cube_.edge()},
                        {"root", std::move(root.json)},
                        {"extras", {{"points", size_}, {"attributes", names}}}};
  sync_files(folder_);
  AtomicFile page(folder_ / kTilesetPage);
  page.stream() << map_page();
  page.commit();
  AtomicFile file(folder_ / kTilesetFile);
  file.stream() << tileset.dump() << '\n';
  file.commit();
}

}  // namespace dynains::viewer
