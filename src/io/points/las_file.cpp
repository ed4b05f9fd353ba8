// LAS files, versions 1.0 to 1.4 (ASPRS).
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "../byte_reader.hpp"
#include "../failure.hpp"
#include "../scalar.hpp"
#include "point_sink.hpp"

namespace dynains {
namespace {

/// Signature of a file, and user and number of its record of extra bytes.
struct LasMarks {
  std::string_view magic = "LASF", spec_user = "LASF_Spec";
  std::uint16_t extra_bytes_record = 4;
};
constexpr LasMarks kLasMarks;

/// Bytes of the parts of a file.
struct LasSizes {
  std::size_t header_1_2 = 227, header_1_4 = 375;
  std::size_t before_count = 247;  ///< the number of points in 64 bits, in the header of 1.4
  std::size_t record_header = 54;  ///< of a variable length record
  std::size_t extra_bytes = 192;   ///< of the description of one value
};
constexpr LasSizes kLasSizes;

/// Parts of a point record, by its format.
struct LasPointFormat {
  std::uint16_t size;        ///< bytes, without extra bytes
  std::uint16_t gps_offset;  ///< bytes from the begin; 0: no time
};
constexpr LasPointFormat kLasPointFormats[] = {{20, 0},  {28, 20}, {26, 0},  {34, 20},
                                               {57, 20}, {63, 20}, {30, 22}, {36, 22},
                                               {38, 22}, {59, 22}, {67, 22}};

/// Types of extra bytes; index 0 has no type.
constexpr Scalar kLasExtraTypes[] = {Scalar::kUint8,  Scalar::kUint8,  Scalar::kInt8,
                                     Scalar::kUint16, Scalar::kInt16,  Scalar::kUint32,
                                     Scalar::kInt32,  Scalar::kUint64, Scalar::kInt64,
                                     Scalar::kFloat,  Scalar::kDouble};

struct LasColumn {
  Role role;
  std::size_t offset;  // bytes from the begin of a record
  Scalar type;
};

struct LasHeader {
  std::uint64_t points_begin = 0;
  std::uint64_t point_count = 0;
  std::uint32_t vlr_count = 0;
  std::uint64_t vlr_begin = 0;
  std::size_t point_size = 0;   // bytes, of a record
  std::size_t extra_begin = 0;  // bytes from the begin of a record
  std::array<double, 3> scale{}, offset{};
  std::vector<LasColumn> columns;
};

void add_column(PointSink& sink, LasHeader& header, LasColumn column) {
  if (sink.claim(column.role)) header.columns.push_back(column);
}

/// Columns of extra bytes whose names are those of a ring or a label.
void add_extra_columns(PointSink& sink, LasHeader& header, Bytes descriptions) {
  std::size_t offset = header.extra_begin;
  while (descriptions.remaining() >= kLasSizes.extra_bytes) {
    Bytes fields = descriptions.block(kLasSizes.extra_bytes, "the description of extra bytes");
    fields.skip(2, "reserved bytes");
    const auto type = fields.number<std::uint8_t>("a type of extra bytes");
    const auto options = fields.number<std::uint8_t>("options of extra bytes");
    const auto* const text = reinterpret_cast<const char*>(fields.here());
    const std::string name(text, std::find(text, text + 32, '\0'));
    if (type >= std::size(kLasExtraTypes)) {
      fields.fail("expected a type of extra bytes from 0 to 10, found " + std::to_string(type));
    }
    const Scalar scalar = kLasExtraTypes[type];
    const std::size_t size = type == 0 ? options : size_of(scalar);
    if (offset + size > header.point_size) {
      fields.fail("expected extra bytes within the " + std::to_string(header.point_size) +
                  " bytes of a point");
    }
    const Role role = role_of(name);
    // Neither scaled nor with an offset.
    if (type != 0 && (options & 0x18) == 0 && (role == Role::kRing || role == Role::kLabel)) {
      add_column(sink, header, {role, offset, scalar});
    }
    offset += size;
  }
}

/// Columns of a point format and of extra bytes.
void read_columns(ByteReader& file, PointSink& sink, LasHeader& header,
                  const LasPointFormat& format) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    add_column(sink, header, {kUsualRoles[axis], 4 * axis, Scalar::kInt32});
  }
  add_column(sink, header, {Role::kIntensity, 12, Scalar::kUint16});
  if (format.gps_offset != 0) {
    add_column(sink, header, {Role::kTime, format.gps_offset, Scalar::kDouble});
  }
  std::uint64_t position = header.vlr_begin;
  for (std::uint32_t i = 0; i < header.vlr_count; ++i) {
    FilePart head(file, position, kLasSizes.record_header, "a variable length record");
    Bytes& fields = head.fields;
    fields.skip(2, "reserved bytes");
    const auto* const text = reinterpret_cast<const char*>(fields.here());
    const std::string user(text, std::find(text, text + 16, '\0'));
    fields.skip(16, "a user id");
    const auto record = fields.number<std::uint16_t>("a record id");
    const auto size = fields.number<std::uint16_t>("the size of a record");
    position += kLasSizes.record_header;
    if (user == kLasMarks.spec_user && record == kLasMarks.extra_bytes_record) {
      const FilePart content(file, position, size, "a variable length record");
      add_extra_columns(sink, header, content.fields);
    }
    position += size;
  }
}

LasHeader read_header(ByteReader& file, PointSink& sink) {
  FilePart head(file, 0, std::min<std::uint64_t>(file.size(), kLasSizes.header_1_2),
                "the header of LAS");
  Bytes& fields = head.fields;
  if (!fields.begins_with(kLasMarks.magic)) {
    fields.fail("expected LASF, the magic bytes of LAS");
  }
  fields.skip(24, "the header of LAS");
  // Two bytes: the number after the point in the upper one.
  const auto version = fields.number<std::uint16_t>("a version");
  const auto minor = static_cast<std::uint8_t>(version >> 8U);
  if ((version & 0xffU) != 1 || minor > 4) {
    fields.fail("expected version 1.0 to 1.4 of LAS, found " + std::to_string(version & 0xffU) +
                '.' + std::to_string(minor));
  }
  fields.skip(68, "the header of LAS");
  LasHeader header;
  header.vlr_begin = fields.number<std::uint16_t>("the size of the header");
  header.points_begin = fields.number<std::uint32_t>("the place of the points");
  header.vlr_count = fields.number<std::uint32_t>("the number of records");
  const auto format = fields.number<std::uint8_t>("a point format");
  if ((format & 0x80U) != 0) {
    fields.fail(
        "points are compressed (LAZ), which is not read; convert the file: "
        "pdal translate IN.laz OUT.las");
  }
  if (format >= std::size(kLasPointFormats)) {
    fields.fail("expected a point format from 0 to 10, found " + std::to_string(format));
  }
  header.point_size = fields.number<std::uint16_t>("the size of a point");
  header.extra_begin = kLasPointFormats[format].size;
  if (header.point_size < header.extra_begin) {
    fields.fail("expected points of at least " + std::to_string(header.extra_begin) +
                " bytes, found " + std::to_string(header.point_size));
  }
  const auto legacy_count = fields.number<std::uint32_t>("the number of points");
  fields.skip(20, "the numbers of points by return");
  for (double& scale : header.scale) scale = fields.number<double>("a scale");
  for (double& offset : header.offset) offset = fields.number<double>("an offset");
  header.point_count = legacy_count;
  if (minor >= 4) {
    FilePart count(file, kLasSizes.before_count, 8, "the number of points");
    header.point_count = count.fields.number<std::uint64_t>("the number of points");
  }
  read_columns(file, sink, header, kLasPointFormats[format]);
  return header;
}

std::string extra_description(const char* name, Scalar type, const char* description) {
  const auto* const types = std::begin(kLasExtraTypes);
  const auto* const number = std::find(types + 1, std::end(kLasExtraTypes), type);
  return ByteWriter()
      .zeros(2)
      .numbers(static_cast<std::uint8_t>(number - types), std::uint8_t{0})
      .text(name, 32)
      .zeros(124)  // no-data, least, most, scale and offset
      .text(description, 32)
      .bytes();
}

std::string vlr(std::string_view user, std::uint16_t record, const std::string& description,
                const std::string& content) {
  return ByteWriter()
             .zeros(2)
             .text(user, 16)
             .numbers(record, static_cast<std::uint16_t>(content.size()))
             .text(description, 32)
             .bytes() +
         content;
}

std::string extra_bytes_vlr() {
  return vlr(kLasMarks.spec_user, kLasMarks.extra_bytes_record, "extra bytes",
             extra_description("belief", Scalar::kFloat, "probability of being dynamic") +
                 extra_description("cause", Scalar::kUint8, "cause of the verdict") +
                 extra_description("instance", Scalar::kUint32, "0: none"));
}

constexpr std::uint8_t kLasWrittenFormat = 6;  // of written files
constexpr double kLasStep = 0.001;             // m, of written coordinates

}  // namespace

std::uint64_t read_las(const std::filesystem::path& path, PointSink& sink, bool with_points) {
  constexpr std::uint64_t kBlock = 1U << 14U;  // points
  ByteReader file(path);
  const LasHeader header = read_header(file, sink);
  const std::uint64_t available = file.size() - std::min(file.size(), header.points_begin);
  if (header.point_count > available / header.point_size) {
    fail_at_byte(path, header.points_begin,
                 "expected " + std::to_string(header.point_count) + " points of " +
                     std::to_string(header.point_size) + " bytes, the file has " +
                     std::to_string(available) + " bytes left");
  }
  if (!with_points) return header.point_count;
  sink.resize(static_cast<std::size_t>(header.point_count));
  std::vector<std::uint8_t> block;
  for (std::uint64_t first = 0; first < header.point_count; first += kBlock) {
    const std::uint64_t count = std::min(kBlock, header.point_count - first);
    const std::uint64_t position = header.points_begin + first * header.point_size;
    file.read_at(position, count * header.point_size, "points", block);
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint8_t* const record = block.data() + i * header.point_size;
      for (const LasColumn& column : header.columns) {
        double value = load_scalar(column.type, record + column.offset, false);
        const auto axis = static_cast<std::size_t>(column.role);
        if (axis < 3) value = value * header.scale[axis] + header.offset[axis];
        if (sink.set(static_cast<std::size_t>(first) + i, column.role, value)) continue;
        fail_at_byte(path, position + i * header.point_size,
                     "expected a whole number of at least 0 in the extra bytes");
      }
    }
  }
  return header.point_count;
}

/// Has the same length for every number of points.
std::string las_header(const std::filesystem::path& path, const LasOptions& options,
                       std::size_t count, const LasSteps& least, const LasSteps& most) {
  if (options.wkt.size() >= std::numeric_limits<std::uint16_t>::max()) {
    fail(path, "expected a reference system of less than 65535 bytes");
  }
  std::string records = extra_bytes_vlr();
  if (!options.wkt.empty()) {
    records += vlr("LASF_Projection", 2112, "OGC WKT", options.wkt + '\0');
  }
  ByteWriter out;
  // Bit 4: coordinate systems are texts (WKT).
  out.text(kLasMarks.magic, kLasMarks.magic.size())
      .zeros(2)
      .number(std::uint16_t{1U << 4U})
      .zeros(16);
  out.numbers(std::uint8_t{1}, std::uint8_t{4});
  out.text("dynains", 32).text("dynains", 32);
  out.zeros(4);  // without a day, so that equal points give equal files
  out.numbers(static_cast<std::uint16_t>(kLasSizes.header_1_4),
              static_cast<std::uint32_t>(kLasSizes.header_1_4 + records.size()),
              std::uint32_t{options.wkt.empty() ? 1U : 2U});
  const std::size_t extra =
      sizeof(FilePoint::belief) + sizeof(FilePoint::cause) + sizeof(FilePoint::instance);
  out.numbers(kLasWrittenFormat,
              static_cast<std::uint16_t>(kLasPointFormats[kLasWrittenFormat].size + extra));
  out.zeros(24);  // numbers of points as in older versions
  out.numbers(kLasStep, kLasStep, kLasStep);
  for (const double offset : options.offset) out.number(offset);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const LasSteps* limit : {&most, &least}) {
      const double steps = count == 0 ? 0.0 : (*limit)[axis];
      out.number(options.offset[static_cast<Eigen::Index>(axis)] + steps * kLasStep);
    }
  }
  out.zeros(20);  // no records behind the points
  out.numbers(std::uint64_t{count}, std::uint64_t{count}).zeros(14 * 8);  // all first returns
  return out.bytes() + records;
}

std::string las_record(const std::filesystem::path& path, const LasOptions& options,
                       const FilePoint& point, LasSteps& least, LasSteps& most) {
  const double limit = std::numeric_limits<std::int32_t>::max();
  ByteWriter record;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<Eigen::Index>(axis);
    const double value = std::round((point.position[i] - options.offset[i]) / kLasStep);
    if (!(std::abs(value) <= limit)) {
      fail(path,
           "expected points within " + std::to_string(limit * kLasStep) + " m of the first one");
    }
    const auto steps = static_cast<std::int32_t>(value);
    least[axis] = std::min(least[axis], steps);
    most[axis] = std::max(most[axis], steps);
    record.number(steps);
  }
  const double intensity = std::round(options.intensity_scale * point.intensity);
  // NaN is not >= 0 and becomes 0.
  record.number(static_cast<std::uint16_t>(intensity >= 0.0 ? std::min(intensity, 65535.0) : 0.0));
  const auto point_class = static_cast<std::uint8_t>(point.is_ground ? 2 : 1);
  record.numbers(std::uint8_t{1U << 4U | 1U}, std::uint8_t{0});  // return 1 of 1
  record.numbers(point_class, std::uint8_t{0}, std::int16_t{0}, std::uint16_t{0});
  record.number(point.scan_time);
  return record.numbers(point.belief, point.cause, point.instance).bytes();
}

}  // namespace dynains
