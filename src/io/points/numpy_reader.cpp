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
      array.shape.size() >= 2 && array.shape.back() >= 3 && array.shape.back() <= kMaxHeaderItems;
  if (!is_table || (array.is_column_major && array.shape.size() > 2)) {
    place.fail(
        "expected an array of N rows with x y z, or a structured array with the fields x, y and z");
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

}  // namespace

std::uint64_t read_npy(const std::filesystem::path& path, PointSink& sink, bool with_points) {
  RawFile raw(path);
  const std::uint64_t wanted = with_points ? raw.size() : kMaxNpyHeader + 16;
  const auto bytes = raw.read(0, std::min(raw.size(), wanted), "an array");
  const Bytes place(raw.path(), 0, bytes.data(), bytes.size());
  const NpyArray array = parse_npy_header(place, raw.size());
  const NpyPoints points = points_of_array(place, array, sink);
  require_xyz(path, sink);
  if (!with_points) return points.count;
  sink.resize(static_cast<std::size_t>(points.count));
  for (const NpyColumn& column : points.columns) {
    store_column(place, column, points.count, bytes.data(), sink);
  }
  return points.count;
}

}  // namespace dynains
