#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "../byte_reader.hpp"
#include "../failure.hpp"
#include "../scalar.hpp"
#include "../text.hpp"
#include "point_sink.hpp"

namespace dynains {
namespace {

constexpr const char* kElementCount = "a number of elements";

struct Property {
  Scalar type;
  bool is_list = false;
  Scalar length_type = Scalar::kUint8;  ///< of a list
  Role role = Role::kNone;
  std::string name;
};

struct Element {
  bool is_vertex = false;
  std::uint64_t count = 0;
  std::vector<Property> properties;

  bool has_lists() const {
    return std::any_of(properties.begin(), properties.end(),
                       [](const Property& property) { return property.is_list; });
  }
};

enum class PlyEncoding : std::uint8_t { kAscii, kLittleEndian, kBigEndian };

struct PlyHeader {
  std::optional<PlyEncoding> encoding;
  std::vector<Element> elements;  ///< up to and with the vertices: later ones are not read

  bool has_vertices() const { return !elements.empty() && elements.back().is_vertex; }
};

Scalar parse_type(const ByteReader& reader, std::string_view name) {
  struct Entry {
    std::string_view name;
    Scalar type;
  };
  static constexpr Entry kTypes[] = {
      {"char", Scalar::kInt8},     {"int8", Scalar::kInt8},     {"uchar", Scalar::kUint8},
      {"uint8", Scalar::kUint8},   {"short", Scalar::kInt16},   {"int16", Scalar::kInt16},
      {"ushort", Scalar::kUint16}, {"uint16", Scalar::kUint16}, {"int", Scalar::kInt32},
      {"int32", Scalar::kInt32},   {"uint", Scalar::kUint32},   {"uint32", Scalar::kUint32},
      {"float", Scalar::kFloat},   {"float32", Scalar::kFloat}, {"double", Scalar::kDouble},
      {"float64", Scalar::kDouble}};
  for (const Entry& entry : kTypes) {
    if (entry.name == name) return entry.type;
  }
  reader.fail_on_line("expected a type such as float or uchar, found \"" +
                      std::string(name.substr(0, 40)) + "\"");
}

PlyEncoding parse_format(const ByteReader& reader, std::string_view line) {
  const std::string_view name = text::next_token(line);
  if (text::next_token(line) != "1.0") reader.fail_on_line("expected format version 1.0");
  if (name == "ascii") return PlyEncoding::kAscii;
  if (name == "binary_little_endian") return PlyEncoding::kLittleEndian;
  if (name == "binary_big_endian") return PlyEncoding::kBigEndian;
  reader.fail_on_line("expected ascii, binary_little_endian or binary_big_endian");
}

Property parse_property(const ByteReader& reader, std::string_view line) {
  Property property{};
  std::string_view type = text::next_token(line);
  if (type == "list") {
    property.is_list = true;
    property.length_type = parse_type(reader, text::next_token(line));
    type = text::next_token(line);
  }
  property.type = parse_type(reader, type);
  property.name = text::next_token(line);
  if (property.name.empty()) reader.fail_on_line("expected the name of a property");
  return property;
}

PlyHeader parse_ply_header(ByteReader& reader, PointSink& sink) {
  std::string line;
  if (!reader.read_line(line) || line != "ply") {
    reader.fail_on_line("expected \"ply\" as first line");
  }
  PlyHeader header;
  bool is_past = false;  // the vertices
  for (std::size_t items = 0;; ++items) {
    if (!reader.read_line(line)) reader.fail_on_line("file ends, expected end_header");
    if (items == kMaxHeaderItems) reader.fail_on_line("expected end_header before this line");
    std::string_view rest = line;
    const std::string_view keyword = text::next_token(rest);
    if (keyword == "end_header") break;
    if (keyword == "comment" || keyword == "obj_info") continue;
    if (keyword == "format") {
      header.encoding = parse_format(reader, rest);
    } else if (keyword == "element") {
      Element element;
      element.is_vertex = text::next_token(rest) == "vertex";
      element.count = reader.whole_number(text::next_token(rest), kElementCount);
      is_past = header.has_vertices();
      if (!is_past) header.elements.push_back(std::move(element));
    } else if (keyword == "property") {
      if (header.elements.empty()) reader.fail_on_line("expected an element before a property");
      Property property = parse_property(reader, rest);
      Element& element = header.elements.back();
      if (is_past) continue;
      const bool is_value = element.is_vertex && !property.is_list;
      const Role role = is_value ? role_of(property.name) : Role::kNone;
      if (role != Role::kNone && sink.claim(role)) property.role = role;
      element.properties.push_back(std::move(property));
    } else {
      reader.fail_on_line("expected element, property, comment or end_header, found \"" +
                          std::string(keyword.substr(0, 40)) + "\"");
    }
  }
  if (!header.encoding) reader.fail_on_line("expected a line \"format\" before end_header");
  if (!header.has_vertices()) reader.fail_on_line("expected \"element vertex\" before end_header");
  if (const auto name = sink.missing()) {
    reader.fail_on_line("expected a number property " + *name + " of the vertices");
  }
  return header;
}

/// Reads one element. Calls `store(property, value)` for values that are not in lists. `bytes`:
/// memory for all of its values, which are read at once unless there are lists among them.
template <class Store>
void read_binary_element(ByteReader& reader, const Element& element, bool swap,
                         std::vector<char>& bytes, Store&& store) {
  const bool has_lists = element.has_lists();
  if (!has_lists) reader.read(bytes.data(), bytes.size(), "a value");
  const char* next = bytes.data();
  for (const Property& property : element.properties) {
    if (!property.is_list) {
      if (has_lists) reader.read(bytes.data(), size_of(property.type), "a value");
      store(property, load_scalar(property.type, next, swap));
      if (!has_lists) next += size_of(property.type);
      continue;
    }
    reader.read(bytes.data(), size_of(property.length_type), "the length of a list");
    const double length = load_scalar(property.length_type, bytes.data(), swap);
    if (!(length >= 0.0 && length <= static_cast<double>(reader.remaining()))) {
      reader.fail_here("expected the length of a list before, that the rest of the file can hold");
    }
    reader.skip(static_cast<std::uint64_t>(length) * size_of(property.type), "the items of a list");
  }
}

template <class Store>
void read_ascii_element(ByteReader& reader, const Element& element, std::string& line,
                        Store&& store) {
  if (!reader.read_line(line)) reader.fail_on_line("file ends, expected one more element");
  std::string_view rest = line;
  for (const Property& property : element.properties) {
    if (!property.is_list) {
      store(property, reader.number(text::next_token(rest), property.name));
      continue;
    }
    const double length = reader.number(text::next_token(rest), property.name);
    if (!(length >= 0.0)) reader.fail_on_line("expected the length of list " + property.name);
    for (double i = 0; i < length; ++i) reader.number(text::next_token(rest), property.name);
  }
  if (!text::next_token(rest).empty()) reader.fail_on_line("expected fewer values on this line");
}

/// Smallest size of one element in the file, bytes.
std::uint64_t min_bytes(const Element& element, PlyEncoding encoding) {
  if (encoding == PlyEncoding::kAscii) return 2 * element.properties.size();
  std::uint64_t bytes = 0;
  for (const Property& property : element.properties) {
    bytes += size_of(property.is_list ? property.length_type : property.type);
  }
  return bytes;
}

/// Reads all items of an element; the sink gets the vertices.
void read_element(ByteReader& reader, const Element& element, PlyEncoding encoding,
                  PointSink& sink) {
  if (element.properties.empty()) return;
  if (element.is_vertex) sink.resize(static_cast<std::size_t>(element.count));
  const bool is_text = encoding == PlyEncoding::kAscii;
  std::string line;
  const std::uint64_t size = min_bytes(element, encoding);
  std::vector<char> bytes(element.has_lists() ? sizeof(double) : static_cast<std::size_t>(size));
  for (std::size_t i = 0; i < element.count; ++i) {
    const auto store = [&](const Property& property, double value) {
      if (sink.set(i, property.role, value)) return;
      const std::string what = "expected a whole number that " + property.name + " can have";
      is_text ? reader.fail_on_line(what) : reader.fail_here(what);
    };
    if (is_text) {
      read_ascii_element(reader, element, line, store);
    } else {
      read_binary_element(reader, element, encoding == PlyEncoding::kBigEndian, bytes, store);
    }
  }
}

}  // namespace

void copy_ply(const std::filesystem::path& path, Span<const std::uint8_t> keep,
              std::ostream& target) {
  ByteReader reader(path);
  PointSink sink;
  const PlyHeader header = parse_ply_header(reader, sink);
  copy_lines(path, reader.position(), target, [&](const std::string& line) {
    std::string_view rest = line;
    if (text::next_token(rest) != "element") return line;
    if (text::next_token(rest) == "vertex") {
      return "element vertex " + std::to_string(kept_count(keep));
    }
    if (reader.whole_number(text::next_token(rest), kElementCount) == 0) return line;
    fail(path, "expected points alone, found \"" + line.substr(0, 60) + "\"");
  });
  const Element& vertex = header.elements.back();
  for (const Property& property : vertex.properties) {
    if (property.is_list) reader.fail_here("expected vertices without the list " + property.name);
  }
  const bool is_text = *header.encoding == PlyEncoding::kAscii;
  const std::uint64_t size = is_text ? 0 : min_bytes(vertex, *header.encoding);
  copy_records(reader, static_cast<std::size_t>(size), "a vertex", keep, target);
}

std::uint64_t read_ply(const std::filesystem::path& path, PointSink& sink, bool with_points) {
  ByteReader reader(path);
  const PlyHeader header = parse_ply_header(reader, sink);
  for (const Element& element : header.elements) {
    reader.check_room(element.count, "elements", min_bytes(element, *header.encoding),
                      *header.encoding == PlyEncoding::kAscii);
    if (with_points) read_element(reader, element, *header.encoding, sink);
  }
  return header.elements.back().count;
}

}  // namespace dynains
