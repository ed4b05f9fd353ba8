#include <algorithm>
#include <iterator>
#include <vector>

#include "../failure.hpp"
#include "../logs/raw_file.hpp"
#include "npy_array.hpp"
#include "point_readers.hpp"
#include "point_sink.hpp"

namespace dynains {
namespace {

/// A column of numbers in the bytes of an array.
struct NpyColumn {
  Role role;
  Scalar type;
  bool swap;
  std::uint64_t begin;   // byte of the first value
  std::uint64_t stride;  // bytes from value to value
};

struct NpyPoints {
  std::uint64_t count = 0;
  std::vector<NpyColumn> columns;
};

constexpr Role kUsualRoles[] = {Role::kX, Role::kY, Role::kZ, Role::kIntensity};

void add_npy_column(const Bytes& place, const NpyArray& array, const NpyArray::Field& field,
                    Role role, std::uint64_t begin, std::uint64_t stride, PointSink& sink,
                    NpyPoints& points) {
  if (role == Role::kNone || !sink.claim(role)) return;
  if (!field.type) place.fail("expected numbers of 1, 2, 4 or 8 bytes (float16 is not read)");
  points.columns.push_back({role, *field.type, field.swap, array.data_begin + begin, stride});
}

/// Points of a structured array, by the names of its fields.
NpyPoints structured_points(const Bytes& place, const NpyArray& array, PointSink& sink) {
  NpyPoints points{array.item_count(), {}};
  for (const NpyArray::Field& field : array.fields) {
    add_npy_column(place, array, field, role_of(field.name), field.offset, array.item_size, sink,
                   points);
  }
  return points;
}

/// Points of an array whose last dimension is x y z, intensity if there is a fourth value, others.
NpyPoints plain_points(const Bytes& place, const NpyArray& array, PointSink& sink) {
  const bool is_table =
      array.shape.size() >= 2 && array.shape.back() >= 3 && array.shape.back() <= kMostHeaderItems;
  if (!is_table || (array.is_column_major && array.shape.size() > 2)) {
    place.fail(
        "expected an array of N rows with x y z, or a structured array with the fields x, "
        "y and z");
  }
  const std::uint64_t columns = array.shape.back();
  NpyPoints points{array.item_count() / columns, {}};
  const std::uint64_t step = array.is_column_major ? points.count : 1;
  const std::uint64_t stride = array.item_size * (array.is_column_major ? 1 : columns);
  for (std::uint64_t i = 0; i < columns && i < std::size(kUsualRoles); ++i) {
    add_npy_column(place, array, array.fields.front(), kUsualRoles[i], i * step * array.item_size,
                   stride, sink, points);
  }
  return points;
}

NpyPoints points_of_array(const Bytes& place, const NpyArray& array, PointSink& sink) {
  return array.is_structured() ? structured_points(place, array, sink)
                               : plain_points(place, array, sink);
}

void store_column(const Bytes& place, const NpyColumn& column, std::uint64_t count,
                  const std::uint8_t* bytes, PointSink& sink) {
  const char* value = reinterpret_cast<const char*>(bytes) + column.begin;
  for (std::size_t i = 0; i < count; ++i, value += column.stride) {
    if (sink.set(i, column.role, load_scalar(column.type, value, column.swap))) continue;
    place.fail("expected whole numbers of at least 0 for rings and labels");
  }
}

void require_xyz(const std::filesystem::path& path, const PointSink& sink) {
  if (const auto name = sink.missing()) fail(path, "expected arrays x, y and z; found no " + *name);
}

struct NpyFile {
  std::vector<std::uint8_t> bytes;
  NpyPoints points;
};

NpyFile open_npy(const std::filesystem::path& path, PointSink& sink, bool with_points) {
  RawFile raw(path);
  NpyFile file;
  const std::uint64_t longest = with_points ? raw.size() : kLongestNpyHeader + 16;
  raw.read(0, std::min(raw.size(), longest), "an array", file.bytes);
  const Bytes bytes(raw.path(), 0, file.bytes.data(), file.bytes.size());
  const NpyArray array = parse_npy_header(bytes, raw.size());
  file.points = points_of_array(bytes, array, sink);
  require_xyz(path, sink);
  return file;
}

}  // namespace

void read_npy(const std::filesystem::path& path, PointSink& sink) {
  const NpyFile file = open_npy(path, sink, true);
  sink.resize(static_cast<std::size_t>(file.points.count));
  const Bytes place(path, 0, file.bytes.data(), file.bytes.size());
  for (const NpyColumn& column : file.points.columns) {
    store_column(place, column, file.points.count, file.bytes.data(), sink);
  }
}

PointFileHeader read_npy_header(const std::filesystem::path& path) {
  PointSink sink;
  const NpyFile file = open_npy(path, sink, false);
  return {Pose::Identity(), sink.columns(), file.points.count};
}

}  // namespace dynains
