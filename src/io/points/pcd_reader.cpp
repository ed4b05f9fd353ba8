#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "../byte_reader.hpp"
#include "../poses/kitti_files.hpp"
#include "../scalar.hpp"
#include "../text.hpp"
#include "lzf.hpp"
#include "point_sink.hpp"

namespace dynains {
namespace {

struct Field {
  std::string name;
  std::size_t size = 0;
  char kind = 0;  ///< of its type, as of scalar_of()
  std::size_t count = 1;
  Scalar type = Scalar::kFloat;
  Role role = Role::kNone;

  std::size_t bytes() const { return size * count; }
};

enum class PcdEncoding : std::uint8_t { kAscii, kBinary, kCompressed };

struct PcdHeader {
  std::vector<Field> fields;
  std::optional<std::uint64_t> width, stated_points;
  std::uint64_t height = 1;
  std::uint64_t points = 0;
  PcdEncoding encoding = PcdEncoding::kAscii;

  std::size_t record_bytes() const {
    std::size_t bytes = 0;
    for (const Field& field : fields) bytes += field.bytes();
    return bytes;
  }
};

Pose parse_viewpoint(const ByteReader& reader, std::string_view line) {
  const std::string expected = "expected VIEWPOINT tx ty tz qw qx qy qz with a rotation";
  std::array<double, 7> v{};
  for (double& value : v) {
    const auto number = text::parse_number(text::next_token(line));
    if (!number) reader.fail_on_line(expected);
    value = *number;
  }
  const auto pose = rigid_pose({v[0], v[1], v[2]}, {v[3], v[4], v[5], v[6]});
  if (!pose) reader.fail_on_line(expected);
  return *pose;
}

PcdEncoding parse_encoding(const ByteReader& reader, std::string_view line) {
  const std::string_view name = text::next_token(line);
  if (name == "ascii") return PcdEncoding::kAscii;
  if (name == "binary") return PcdEncoding::kBinary;
  if (name == "binary_compressed") return PcdEncoding::kCompressed;
  reader.fail_on_line("expected DATA ascii, binary or binary_compressed");
}

void parse_fields(const ByteReader& reader, std::string_view line, PcdHeader& header) {
  if (!header.fields.empty()) reader.fail_on_line("expected FIELDS once");
  for (const std::string_view name : text::tokens(line)) {
    if (header.fields.size() == kMaxHeaderItems) reader.fail_on_line("expected fewer fields");
    header.fields.emplace_back().name = name;
  }
  if (header.fields.empty()) reader.fail_on_line("expected the names of the fields");
}

/// SIZE, TYPE or COUNT of a field.
void parse_property(const ByteReader& reader, std::string_view keyword, std::string_view token,
                    Field& field) {
  const std::string of_field = " for field " + field.name;
  if (keyword == "COUNT") {
    const std::string what = "a COUNT from 0 to 65536" + of_field;
    const std::uint64_t count = reader.whole_number(token, what);
    if (count > 1U << 16U) reader.fail_on_line("expected " + what);
    field.count = static_cast<std::size_t>(count);
    return;
  }
  const bool is_size = keyword == "SIZE";
  const std::string_view known = is_size ? "1248" : "IUF";
  if (token.size() != 1 || known.find(token.front()) == std::string_view::npos) {
    reader.fail_on_line((is_size ? "expected SIZE 1, 2, 4 or 8" : "expected TYPE I, U or F") +
                        of_field);
  }
  if (is_size) field.size = static_cast<std::size_t>(token.front() - '0');
  if (!is_size) field.kind = static_cast<char>(token.front() - 'A' + 'a');
}

/// The line of a property that each field has.
void parse_properties(const ByteReader& reader, std::string_view keyword, std::string_view line,
                      PcdHeader& header) {
  if (header.fields.empty()) reader.fail_on_line("expected FIELDS before this line");
  const std::vector<std::string_view> tokens = text::tokens(line);
  if (tokens.size() != header.fields.size()) {
    reader.fail_on_line("expected " + std::to_string(header.fields.size()) +
                        " values, one for each field");
  }
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    parse_property(reader, keyword, tokens[i], header.fields[i]);
  }
}

void parse_header_line(const ByteReader& reader, std::string_view keyword, std::string_view line,
                       PcdHeader& header, PointSink& sink) {
  const auto number = [&](const char* what) {
    return reader.whole_number(text::next_token(line), what);
  };
  if (keyword == "VERSION") return;
  if (keyword == "FIELDS" || keyword == "COLUMNS") {
    parse_fields(reader, line, header);
  } else if (keyword == "SIZE" || keyword == "TYPE" || keyword == "COUNT") {
    parse_properties(reader, keyword, line, header);
  } else if (keyword == "WIDTH") {
    header.width = number("WIDTH as a whole number");
  } else if (keyword == "HEIGHT") {
    header.height = number("HEIGHT as a whole number");
  } else if (keyword == "VIEWPOINT") {
    sink.file().viewpoint = parse_viewpoint(reader, line);
  } else if (keyword == "POINTS") {
    header.stated_points = number("POINTS as a whole number");
  } else {
    reader.fail_on_line("expected a line of a PCD header (FIELDS, SIZE, ... DATA), found \"" +
                        std::string(keyword.substr(0, 40)) + "\"");
  }
}

void finish_header(const ByteReader& reader, PcdHeader& header, PointSink& sink) {
  for (Field& field : header.fields) {
    if (field.size == 0) reader.fail_on_line("expected SIZE before DATA");
    if (field.kind == 0) reader.fail_on_line("expected TYPE before DATA");
    const std::optional<Scalar> type = scalar_of(field.kind, field.size);
    if (!type) reader.fail_on_line("expected SIZE 4 or 8 for field " + field.name);
    field.type = *type;
    const Role role = field.count == 1 ? role_of(field.name) : Role::kNone;
    if (role != Role::kNone && sink.claim(role)) field.role = role;
  }
  if (const auto name = sink.missing()) reader.fail_on_line("expected a field " + *name);
  if (!header.width && !header.stated_points) {
    reader.fail_on_line("expected WIDTH or POINTS before DATA");
  }
  const std::uint64_t width = header.width.value_or(0), product = width * header.height;
  // Some programs write POINTS alone, others also WIDTH 0.
  header.points = product == 0 ? header.stated_points.value_or(0) : product;
  const bool overflows = header.height != 0 && product / header.height != width;
  if (overflows || header.stated_points.value_or(header.points) != header.points) {
    reader.fail_on_line("expected POINTS to be WIDTH * HEIGHT");
  }
}

PcdHeader parse_pcd_header(ByteReader& reader, PointSink& sink) {
  PcdHeader header;
  std::string line;
  for (std::size_t i = 0; i < kMaxHeaderItems; ++i) {
    if (!reader.read_line(line)) reader.fail_on_line("file ends, expected a line DATA");
    std::string_view rest = line;
    const std::string_view keyword = text::next_token(rest);
    if (keyword.empty() || keyword.front() == '#') continue;
    if (keyword == "DATA") {
      header.encoding = parse_encoding(reader, rest);
      finish_header(reader, header, sink);
      return header;
    }
    parse_header_line(reader, keyword, rest, header, sink);
  }
  reader.fail_on_line("expected a line DATA before this line");
}

/// Stores the value of point `i` that lies at `bytes`.
void store(const ByteReader& reader, const Field& field, std::size_t i, const char* bytes,
           PointSink& sink) {
  if (field.role == Role::kNone || sink.set(i, field.role, load_scalar(field.type, bytes, false))) {
    return;
  }
  reader.fail_here("expected a whole number that " + field.name + " can have, at point " +
                   std::to_string(i));
}

struct BlockSizes {
  std::uint32_t compressed = 0;
  std::uint32_t plain = 0;
};

/// Reads the sizes of the compressed block. Throws IoError unless the file can hold the block, and
/// the block can hold the points.
BlockSizes read_block_sizes(ByteReader& reader, const PcdHeader& header) {
  BlockSizes sizes;
  reader.read(&sizes.compressed, 1, "the sizes of the compressed block");
  reader.read(&sizes.plain, 1, "the sizes of the compressed block");
  if (sizes.compressed > reader.remaining()) {
    reader.fail_here("expected " + std::to_string(sizes.compressed) +
                     " bytes of compressed points, the file has " +
                     std::to_string(reader.remaining()) + " bytes left");
  }
  const std::uint64_t each = header.record_bytes();
  if (sizes.plain % each != 0 || sizes.plain / each != header.points) {
    reader.fail_here("expected a block of " + std::to_string(header.points) + " points of " +
                     std::to_string(each) + " bytes, its size is given as " +
                     std::to_string(sizes.plain));
  }
  if (sizes.plain > std::uint64_t{sizes.compressed} * kLzfMaxExpansion) {
    reader.fail_here("expected a block of points that LZF can have compressed: " +
                     std::to_string(sizes.compressed) + " bytes cannot hold " +
                     std::to_string(sizes.plain));
  }
  return sizes;
}

void read_ascii(ByteReader& reader, const PcdHeader& header, PointSink& sink) {
  sink.resize(static_cast<std::size_t>(header.points));
  std::string line;
  for (std::size_t i = 0; i < header.points; ++i) {
    if (!reader.read_line(line)) {
      reader.fail_on_line("file ends, expected " + std::to_string(header.points) + " points");
    }
    std::string_view rest = line;
    for (const Field& field : header.fields) {
      for (std::size_t k = 0; k < field.count; ++k) {
        if (!sink.set(i, field.role, reader.number(text::next_token(rest), field.name))) {
          reader.fail_on_line("expected a whole number that " + field.name + " can have");
        }
      }
    }
    if (!text::next_token(rest).empty()) reader.fail_on_line("expected fewer values on this line");
  }
}

void read_binary(ByteReader& reader, const PcdHeader& header, PointSink& sink) {
  if (header.points == 0) return;
  std::vector<char> record(header.record_bytes());
  sink.resize(static_cast<std::size_t>(header.points));
  for (std::size_t i = 0; i < header.points; ++i) {
    reader.read(record.data(), record.size(), "a point");
    const char* bytes = record.data();
    for (const Field& field : header.fields) {
      store(reader, field, i, bytes, sink);
      bytes += field.bytes();
    }
  }
}

/// One compressed block with the values of all points field by field.
std::vector<char> read_block(ByteReader& reader, const PcdHeader& header) {
  const BlockSizes sizes = read_block_sizes(reader, header);
  std::vector<char> compressed(sizes.compressed);
  reader.read(compressed.data(), compressed.size(), "compressed points");
  std::vector<char> plain(sizes.plain);
  if (!decode_lzf(compressed, plain)) {
    reader.fail_here("expected a sound compressed block (LZF) before this byte");
  }
  return plain;
}

void read_compressed(ByteReader& reader, const PcdHeader& header, PointSink& sink) {
  const std::vector<char> plain = read_block(reader, header);
  const auto count = static_cast<std::size_t>(header.points);
  sink.resize(count);
  const char* column = plain.data();
  for (const Field& field : header.fields) {
    for (std::size_t i = 0; field.role != Role::kNone && i < count; ++i) {
      store(reader, field, i, column + i * field.size, sink);
    }
    column += field.bytes() * count;
  }
}

}  // namespace

void copy_pcd(const std::filesystem::path& path, Span<const std::uint8_t> keep,
              std::ostream& target) {
  ByteReader reader(path);
  PointSink sink;
  const PcdHeader header = parse_pcd_header(reader, sink);
  const std::string count = std::to_string(kept_count(keep));
  copy_lines(path, reader.position(), target, [&](const std::string& line) -> std::string {
    std::string_view rest = line;
    const std::string_view keyword = text::next_token(rest);
    if (keyword == "HEIGHT") return "HEIGHT 1";
    if (keyword == "WIDTH" || keyword == "POINTS") return std::string(keyword) + ' ' + count;
    if (keyword == "DATA" && text::next_token(rest) == "binary_compressed") return "DATA binary";
    return line;
  });
  if (header.encoding != PcdEncoding::kCompressed) {
    const bool is_text = header.encoding == PcdEncoding::kAscii;
    return copy_records(reader, is_text ? 0 : header.record_bytes(), "a point", keep, target);
  }
  const std::vector<char> block = read_block(reader, header);
  for (std::size_t i = 0; i < keep.size(); ++i) {
    if (keep[i] == 0) continue;
    const char* column = block.data();
    for (const Field& field : header.fields) {
      const std::size_t size = field.bytes();
      target.write(column + i * size, static_cast<std::streamsize>(size));
      column += size * static_cast<std::size_t>(header.points);
    }
  }
}

std::uint64_t read_pcd(const std::filesystem::path& path, PointSink& sink, bool with_points) {
  ByteReader reader(path);
  const PcdHeader header = parse_pcd_header(reader, sink);
  if (header.encoding == PcdEncoding::kCompressed) {
    if (with_points) {
      read_compressed(reader, header, sink);
    } else {
      read_block_sizes(reader, header);
    }
    return header.points;
  }
  const bool is_text = header.encoding == PcdEncoding::kAscii;
  std::uint64_t values = 0;
  for (const Field& field : header.fields) values += field.count;
  reader.check_room(header.points, "points", is_text ? 2 * values : header.record_bytes(), is_text);
  if (with_points) is_text ? read_ascii(reader, header, sink) : read_binary(reader, header, sink);
  return header.points;
}

}  // namespace dynains
