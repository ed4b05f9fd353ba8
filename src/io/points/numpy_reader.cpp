#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "../byte_reader.hpp"
#include "../failure.hpp"
#include "../scalar.hpp"
#include "point_sink.hpp"

namespace dynains {
namespace {

constexpr std::string_view kNpyMagic("\x93NUMPY", 6);
constexpr std::size_t kMaxNpyField = 1000000000;              // bytes
constexpr std::size_t kMaxNpyHeader = std::size_t{1} << 16U;  // bytes

/// Values in the bytes of an array: a field of a structured one, or all values of another one.
struct NpyColumn {
  std::string name;            ///< empty if the array is not structured
  std::optional<Scalar> type;  ///< empty: not a number that is read here
  bool swap = false;           ///< big-endian
  std::uint64_t begin = 0;     ///< bytes from the begin of the first item
  Role role = Role::kNone;
};

/// Header of an array (.npy, format 1 to 3).
struct NpyArray {
  std::vector<NpyColumn> columns;
  std::vector<std::uint64_t> shape;
  bool is_column_major = false;
  std::size_t item_size = 0;     ///< bytes
  std::uint64_t data_begin = 0;  ///< byte of the first item
};

/// Parses the literal of Python in which a header describes its array.
class NpyLiteral {
 public:
  NpyLiteral(const Bytes& place, std::string_view text) : place_(place), rest_(text) {}

  bool is_next(char c) {
    const std::size_t begin = rest_.find_first_not_of(" \t\r\n");
    rest_.remove_prefix(begin == std::string_view::npos ? rest_.size() : begin);
    return !rest_.empty() && rest_.front() == c;
  }
  bool skip(char c) {
    if (!is_next(c)) return false;
    rest_.remove_prefix(1);
    return true;
  }
  void expect(char c) {
    if (!skip(c)) fail(std::string("expected '") + c + '\'');
  }
  std::string string() {
    const char quote = is_next('"') ? '"' : '\'';
    expect(quote);
    const std::size_t end = rest_.find(quote);
    if (end == std::string_view::npos) fail("expected the end of a text");
    std::string text(rest_.substr(0, end));
    rest_.remove_prefix(end + 1);
    return text;
  }
  bool boolean() {
    const bool value = is_next('T');
    const std::string_view word = value ? "True" : "False";
    if (rest_.substr(0, word.size()) != word) fail("expected True or False");
    rest_.remove_prefix(word.size());
    return value;
  }
  /// (3,), (3, 4) or ().
  std::vector<std::uint64_t> shape() {
    std::vector<std::uint64_t> values;
    expect('(');
    while (!skip(')')) {
      std::uint64_t value = 0;
      const auto [stop, error] = std::from_chars(rest_.data(), rest_.data() + rest_.size(), value);
      if (error != std::errc{}) fail("expected the length of a dimension");
      rest_.remove_prefix(static_cast<std::size_t>(stop - rest_.data()));
      values.push_back(value);
      if (!skip(',') && !is_next(')')) fail("expected ',' or ')'");
    }
    return values;
  }
  [[noreturn]] void fail(const std::string& what) const {
    place_.fail("header of the array: " + what);
  }

 private:
  const Bytes& place_;
  std::string_view rest_;
};

/// Appends a column of a type such as "<f4" and gives its size, bytes.
std::size_t add_npy_column(const NpyLiteral& literal, const std::string& name,
                           const std::string& type, NpyArray& array) {
  std::string_view text = type;
  NpyColumn& column = array.columns.emplace_back();
  column.name = name;
  column.begin = array.item_size;
  column.swap = !text.empty() && text.front() == '>';
  if (!text.empty() && std::string_view("<>|=").find(text.front()) != std::string_view::npos) {
    text.remove_prefix(1);
  }
  if (text == "O") return 1;  // pickled objects, of at least one byte each
  std::uint32_t size = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(std::min(text.data() + 1, end), end, size);
  if (text.empty() || error != std::errc{} || size == 0 || size > kMaxNpyField) {
    literal.fail("expected a type such as '<f4', found '" + type.substr(0, 40) + '\'');
  }
  if (stop == end) column.type = scalar_of(text.front(), size);
  return text.front() == 'U' ? 4 * size : size;  // letters have four bytes
}

void read_npy_type(NpyLiteral& literal, NpyArray& array) {
  if (!literal.skip('[')) {
    array.item_size += add_npy_column(literal, "", literal.string(), array);
    return;
  }
  while (!literal.skip(']')) {
    literal.expect('(');
    const std::string name = literal.string();
    literal.expect(',');
    if (name.empty() || literal.is_next('[')) literal.fail("expected fields of one level");
    std::size_t size = add_npy_column(literal, name, literal.string(), array);
    if (literal.skip(',') && literal.is_next('(')) {
      // Several values in one field are no column.
      array.columns.back().type.reset();
      for (const std::uint64_t length : literal.shape()) {
        if (length > 0 && size > kMaxNpyField / length) {
          literal.fail("expected fields of at most 1 GB");
        }
        size *= static_cast<std::size_t>(length);
      }
    }
    literal.expect(')');
    array.item_size += size;
    literal.skip(',');
  }
  if (array.columns.empty()) literal.fail("expected at least one field");
}

void read_npy_description(NpyLiteral& literal, NpyArray& array) {
  bool has_shape = false;
  literal.expect('{');
  while (!literal.skip('}')) {
    const std::string key = literal.string();
    literal.expect(':');
    if (key == "descr" && array.columns.empty()) {
      read_npy_type(literal, array);
    } else if (key == "fortran_order") {
      array.is_column_major = literal.boolean();
    } else if (key == "shape") {
      array.shape = literal.shape();
      has_shape = true;
    } else {
      literal.fail("expected descr, fortran_order and shape, once each");
    }
    literal.skip(',');
  }
  if (array.columns.empty() || !has_shape) literal.fail("expected descr and shape");
}

/// Reads the header at the begin of `in`, which holds the first bytes of an array of `size` bytes,
/// at least kMaxNpyHeader of them if there are as many. Throws IoError unless all items lie
/// within `size`.
NpyArray parse_npy_header(Bytes in, std::uint64_t size) {
  const Bytes begin = in;
  if (!in.begins_with(kNpyMagic)) in.fail("expected the magic bytes of an array of NumPy");
  in.skip(kNpyMagic.size(), "magic bytes");
  const auto major = in.number<std::uint8_t>("a version");
  in.skip(1, "a version");
  if (major < 1 || major > 3) in.fail("expected format 1 to 3 of NumPy");
  const std::uint32_t length = major == 1 ? in.number<std::uint16_t>("the length of the header")
                                          : in.number<std::uint32_t>("the length of the header");
  Bytes header = in.block(length, "the header of the array");
  NpyArray array;
  array.data_begin = in.position();
  const std::string text = header.rest_as_text();
  NpyLiteral literal(header, text);
  read_npy_description(literal, array);

  // Items that each step leaves room for: a product could overflow.
  std::uint64_t available = array.item_size == 0 ? 0 : (size - array.data_begin) / array.item_size;
  const bool is_empty = std::count(array.shape.begin(), array.shape.end(), 0U) > 0;
  if (array.item_size == 0) begin.fail("expected items of at least one byte");
  for (const std::uint64_t dimension : array.shape) available /= is_empty ? 1 : dimension;
  // An array without dimensions has one item.
  if (!is_empty && available == 0) {
    begin.fail("expected all items of the array, found " + std::to_string(size) + " bytes");
  }
  return array;
}

/// Gives the columns of points their meaning, and leaves out the others. Returns the number of
/// points: the items of a structured array, or the rows of one whose last dimension is x y z,
/// intensity if there is a fourth value, others. `stride`: bytes from value to value of a column.
std::uint64_t find_points(const Bytes& place, NpyArray& array, PointSink& sink,
                          std::uint64_t& stride) {
  const std::vector<std::uint64_t>& shape = array.shape;
  std::uint64_t points = 1;
  for (const std::uint64_t length : shape) points *= length;
  stride = array.item_size;
  if (!array.columns.front().name.empty()) {
    for (NpyColumn& column : array.columns) column.role = role_of(column.name);
  } else {
    const bool is_table = shape.size() >= 2 && shape.back() >= 3 && shape.back() <= kMaxHeaderItems;
    if (!is_table || (array.is_column_major && shape.size() > 2)) {
      place.fail(
          "expected an array of N rows with x y z, or a structured array with the fields x, y and "
          "z");
    }
    points /= shape.back();
    if (!array.is_column_major) stride *= shape.back();
    array.columns.resize(std::min<std::size_t>(shape.back(), std::size(kUsualRoles)),
                         array.columns.front());
    for (std::size_t i = 0; i < array.columns.size(); ++i) {
      array.columns[i].role = kUsualRoles[i];
      array.columns[i].begin = i * array.item_size * (array.is_column_major ? points : 1);
    }
  }
  for (NpyColumn& column : array.columns) {
    if (column.role != Role::kNone && !sink.claim(column.role)) column.role = Role::kNone;
    if (column.role == Role::kNone || column.type) continue;
    place.fail("expected numbers of 1, 2, 4 or 8 bytes (float16 is not read)");
  }
  return points;
}

}  // namespace

std::uint64_t read_npy(const std::filesystem::path& path, PointSink& sink, bool with_points) {
  ByteReader raw(path);
  const std::uint64_t wanted = with_points ? raw.size() : kMaxNpyHeader + 16;
  const FilePart content(raw, 0, std::min(raw.size(), wanted), "an array");
  const Bytes& place = content.fields;
  NpyArray array = parse_npy_header(place, raw.size());
  std::uint64_t stride = 0;
  const std::uint64_t count = find_points(place, array, sink, stride);
  if (const auto name = sink.missing()) fail(path, "expected arrays x, y and z; found no " + *name);
  if (!with_points) return count;
  sink.resize(static_cast<std::size_t>(count));
  for (const NpyColumn& column : array.columns) {
    if (column.role == Role::kNone) continue;
    const std::uint8_t* value = content.bytes.data() + array.data_begin + column.begin;
    for (std::size_t i = 0; i < count; ++i, value += stride) {
      if (sink.set(i, column.role, load_scalar(*column.type, value, column.swap))) continue;
      place.fail("expected whole numbers of at least 0 for rings and labels");
    }
  }
  return count;
}

}  // namespace dynains
