#include <algorithm>
#include <iterator>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "failure.hpp"
#include "log/raw_file.hpp"
#include "npy_array.hpp"
#include "point_readers.hpp"
#include "point_sink.hpp"
#include "zip_archive.hpp"

namespace dynains {
namespace {

/// A column of numbers in the bytes of an array.
struct NpyColumn {
  Role role;
  Scalar type;
  bool swap;
  std::uint64_t begin;                    // byte of the first value
  std::uint64_t stride;                   // bytes from value to value
  std::optional<std::size_t> other = {};  // place among the other values of a point
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
  constexpr std::uint64_t kMostColumns = 1000;
  const bool is_table =
      array.shape.size() >= 2 && array.shape.back() >= 3 && array.shape.back() <= kMostColumns;
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

/// PLY, which holds the clean clouds of arrays, has no 64-bit integers: they become doubles.
Scalar type_in_ply(Scalar type) {
  return type == Scalar::kInt64 || type == Scalar::kUint64 ? Scalar::kDouble : type;
}

/// Adds the columns that have no role: fields, or those of an array with a row for each point. A
/// table of several gives them the name of the array and a number.
void add_other_columns(const NpyArray& array, const std::string& name, NpyPoints& points,
                       PointSink& sink) {
  constexpr std::uint64_t kMostColumns = 1000;
  const auto add = [&](const NpyArray::Field& field, const std::string& column, std::uint64_t begin,
                       std::uint64_t stride) {
    begin += array.data_begin;
    const bool has_role = std::any_of(points.columns.begin(), points.columns.end(),
                                      [&](const NpyColumn& one) { return one.begin == begin; });
    if (has_role || !field.type) return;
    const auto place = sink.claim_other(column, type_in_ply(*field.type));
    if (!place) return;
    points.columns.push_back({Role::kNone, *field.type, field.swap, begin, stride, place});
  };
  if (array.is_structured()) {
    for (const NpyArray::Field& field : array.fields) {
      if (array.item_count() == points.count) add(field, field.name, field.offset, array.item_size);
    }
    return;
  }
  const std::uint64_t columns = array.shape.size() < 2 ? 1 : array.shape.back();
  const bool has_rows = columns <= kMostColumns && array.item_count() == columns * points.count;
  if (!has_rows || (array.is_column_major && array.shape.size() > 2)) return;
  const std::uint64_t step = array.is_column_major ? points.count : 1;
  const std::uint64_t stride = array.item_size * (array.is_column_major ? 1 : columns);
  for (std::uint64_t i = 0; i < columns; ++i) {
    add(array.fields.front(), columns == 1 ? name : name + '_' + std::to_string(i),
        i * step * array.item_size, stride);
  }
}

/// Whole numbers of 64 bits are rounded to 53 bits.
bool store_value(const NpyColumn& column, const char* value, std::size_t i, PointSink& sink) {
  const double number = load_scalar(column.type, value, column.swap);
  return column.other ? store_scalar(type_in_ply(column.type), number, sink.other(i, *column.other))
                      : sink.set(i, column.role, number);
}

void store_column(const Bytes& place, const NpyColumn& column, std::uint64_t count,
                  const std::uint8_t* bytes, PointSink& sink) {
  const char* value = reinterpret_cast<const char*>(bytes) + column.begin;
  for (std::size_t i = 0; i < count; ++i, value += column.stride) {
    if (store_value(column, value, i, sink)) continue;
    place.fail("expected whole numbers of at least 0 for rings and labels");
  }
}

void require_xyz(const std::filesystem::path& path, const PointSink& sink) {
  if (const auto name = sink.missing()) fail(path, "expected arrays x, y and z; found no " + *name);
}

// .npy

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
  add_other_columns(array, "column", file.points, sink);
  return file;
}

// .npz

struct NpzColumns {
  std::vector<std::uint8_t> bytes;
  std::string name, stem;
  NpyArray array;
  NpyPoints points;
};

/// The array of an archive that gives points: a structured array, a table, or a single column.
NpyPoints points_of_member(const Bytes& place, const NpyArray& array, Role role, PointSink& sink) {
  const bool is_column = !array.is_structured() && array.shape.size() == 1;
  if (!is_column) return points_of_array(place, array, sink);
  NpyPoints points{array.item_count(), {}};
  add_npy_column(place, array, array.fields.front(), role, 0, array.item_size, sink, points);
  return points;
}

bool may_be_points(const NpyArray& array, Role role) {
  if (array.is_structured() || array.shape.size() == 1)
    return array.is_structured() || role != Role::kNone;
  return array.shape.size() >= 2 && array.shape.back() >= 3;
}

std::vector<NpzColumns> open_npz(const std::filesystem::path& path, PointSink& sink) {
  ZipArchive archive(path);
  std::vector<NpzColumns> all, others;
  for (const ZipArchive::Member& member : archive.members()) {
    const std::filesystem::path member_path(member.name);
    if (member_path.extension() != ".npy") continue;
    NpzColumns one;
    archive.read(member, one.bytes);
    one.name = path.string() + ": " + member.name;
    const std::filesystem::path place(one.name);
    const Bytes bytes(place, 0, one.bytes.data(), one.bytes.size());
    one.array = parse_npy_header(bytes, one.bytes.size());
    one.stem = member_path.stem().string();
    const Role role = role_of(one.stem);
    if (may_be_points(one.array, role)) {
      one.points = points_of_member(bytes, one.array, role, sink);
    }
    if (one.points.columns.empty()) {
      if (sink.wants_others()) others.push_back(std::move(one));
      continue;
    }
    if (!all.empty() && one.points.count != all.front().points.count) {
      bytes.fail("expected " + std::to_string(all.front().points.count) + " items, as in " +
                 all.front().name + ", found " + std::to_string(one.points.count));
    }
    all.push_back(std::move(one));
  }
  require_xyz(path, sink);
  for (NpzColumns& one : others) one.points.count = all.front().points.count;
  std::move(others.begin(), others.end(), std::back_inserter(all));
  for (NpzColumns& one : all) add_other_columns(one.array, one.stem, one.points, sink);
  return all;
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

void check_npy(const std::filesystem::path& path) { read_npy_header(path); }

void read_npz(const std::filesystem::path& path, PointSink& sink) {
  const std::vector<NpzColumns> all = open_npz(path, sink);
  sink.resize(static_cast<std::size_t>(all.front().points.count));
  for (const NpzColumns& one : all) {
    const std::filesystem::path name(one.name);
    const Bytes place(name, 0, one.bytes.data(), one.bytes.size());
    for (const NpyColumn& column : one.points.columns) {
      store_column(place, column, one.points.count, one.bytes.data(), sink);
    }
  }
}

PointFileHeader read_npz_header(const std::filesystem::path& path) {
  PointSink sink;
  const std::vector<NpzColumns> all = open_npz(path, sink);
  return {Pose::Identity(), sink.columns(), all.front().points.count};
}

void check_npz(const std::filesystem::path& path) { read_npz_header(path); }

}  // namespace dynains
