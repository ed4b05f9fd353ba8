#include "dynains/io/point_file.hpp"

#include "point_file_of.hpp"
#include "support/catch.hpp"

using namespace dynains;
using namespace dynains::test;

namespace {

std::string reversed(std::string bytes) { return {bytes.rbegin(), bytes.rend()}; }

const std::string kPlyXyz = "property float x\nproperty float y\nproperty float z\nend_header\n";

std::string pcd_header(const std::string& points, const std::string& data) {
  return "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH " + points +
         "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + points + "\nDATA " + data + "\n";
}

}  // namespace

TEST_CASE("Points are read as they were written, in their order") {
  TemporaryFolder folder;
  const std::string extension = GENERATE(".ply", ".pcd", ".PLY");
  const auto count = GENERATE(values<std::size_t>({0, 9, 10, 123456}));
  PointColumns columns;
  columns.intensity = columns.label = columns.time = columns.ring = GENERATE(false, true);
  columns.double_xyz = GENERATE(false, true);
  const fs::path path = folder / ("points" + extension);
  PointFileWriter writer(path, columns);
  for (std::size_t k = 0; k < count; ++k) {
    const int i = static_cast<int>(k);
    FilePoint point;
    point.position = {691234.125 + i, -2.0 * i, 0.1 * i};
    point.intensity = static_cast<float>(i);
    point.label = static_cast<std::uint32_t>(3 * i);
    point.ring = static_cast<std::uint16_t>(i % 64);
    point.time = 1e9 + i;
    writer.add(point);
  }
  CHECK_FALSE(fs::exists(path));
  writer.commit();
  const PointFile file = read_points(path);
  REQUIRE(file.positions.size() == count);
  CHECK(file.viewpoint.isApprox(Eigen::Isometry3d::Identity()));
  for (const std::size_t size :
       {file.intensity.size(), file.label.size(), file.ring.size(), file.time.size()}) {
    REQUIRE(size == (columns.label ? count : 0));
  }
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double value = static_cast<double>(i);
    Eigen::Vector3d position(691234.125 + value, -2.0 * value, 0.1 * value);
    if (!columns.double_xyz) position = position.cast<float>().cast<double>();
    wrong += file.positions[i] == position ? 0 : 1;
    if (!columns.label) continue;
    wrong += file.intensity[i] == static_cast<float>(i) && file.label[i] == 3 * i &&
                     file.ring[i] == i % 64 && file.time[i] == 1e9 + value
                 ? 0
                 : 1;
  }
  CHECK(wrong == 0);
}

TEST_CASE("A written PLY has the bytes of the format") {
  TemporaryFolder folder;
  PointColumns columns;
  columns.label = true;
  PointFileWriter writer(folder / "a.ply", columns);
  FilePoint point;
  point.position = {1.0, 2.0, 3.0};
  point.label = 7;
  writer.add(point);
  writer.commit();
  const std::string text = read_text(folder / "a.ply");
  CHECK_THAT(text, StartsWith("ply\nformat binary_little_endian 1.0\ncomment dynains..."));
  CHECK(text.substr(text.find("\nelement")) ==
        "\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
        "property uint label\nend_header\n" +
            packed(1.0F, 2.0F, 3.0F) + packed(7U));
}

TEST_CASE("A point file without commit leaves no file") {
  TemporaryFolder folder;
  write_text(folder / "a.ply", "old");
  {
    PointFileWriter writer(folder / "a.ply");
    for (int i = 0; i < 100000; ++i) writer.add({});
  }
  CHECK(read_text(folder / "a.ply") == "old");
  CHECK(count_entries(folder.path()) == 1);
}

TEST_CASE("Only .ply, .pcd and .las are written as point files") {
  CHECK(is_point_file("a/b.ply"));
  CHECK(is_point_file("b.PCD"));
  CHECK_FALSE(is_point_file("ply"));
  CHECK(is_point_file("a.las"));
  CHECK_FALSE(is_point_file("a.xyz"));
  CHECK_THAT(message_of<IoError>([] { PointFileWriter("a.xyz"); }),
             ContainsSubstring("a.xyz: expected a name that ends in .ply, .pcd or .las"));
  CHECK_THAT(message_of<IoError>([] { read_points("a.las"); }), ContainsSubstring("a.las"));
}

TEST_CASE("PLY: ascii with other elements, lists, aliases and any order") {
  const PointFile file =
      read_file_of("a.ply",
                   "ply\r\nformat ascii 1.0\r\ncomment made by hand\r\n"
                   "element camera 1\r\nproperty list uchar int ids\r\n"
                   "property float f\r\nelement vertex 2\r\nproperty double z\r\n"
                   "property uchar Ring\r\nproperty list uchar float extra\r\n"
                   "property float x\r\nproperty int y\r\n"
                   "property float scalar_Intensity\r\nproperty uint t\r\n"
                   "element face 1\r\nproperty list uchar int vertex_index\r\n"
                   "end_header\r\n"
                   "2 5 6 1.5\r\n"
                   "0.25 63 2 9 9 -1e3 4 0.5 4000000000\r\n"
                   "nan 0 0 +2 -5 1 0\r\n"
                   "3 0 1 2\r\n");
  REQUIRE(file.positions.size() == 2);
  CHECK(file.positions[0] == Eigen::Vector3d(-1000.0, 4.0, 0.25));
  CHECK(file.positions[1].head<2>() == Eigen::Vector2d(2.0, -5.0));
  CHECK(std::isnan(file.positions[1].z()));
  CHECK(file.ring == std::vector<std::uint16_t>{63, 0});
  CHECK(file.intensity == std::vector<float>{0.5F, 1.0F});
  CHECK(file.time == std::vector<double>{4e9, 0.0});
  CHECK(file.label.empty());
}

TEST_CASE("PLY: binary of both byte orders, all types, lists before and within") {
  const std::string types =
      "element other 2\nproperty list ushort short items\nelement vertex 1\n"
      "property char a\nproperty short b\nproperty ushort ring\nproperty int c\n"
      "property list int double d\nproperty uint label\nproperty double x\nproperty float y\n"
      "property int8 z\nproperty float64 time\nend_header\n";
  const auto check = [](const PointFile& file) {
    REQUIRE(file.positions.size() == 1);
    CHECK(file.positions[0] == Eigen::Vector3d(691234.125, -2.5, -7.0));
    CHECK(file.ring == std::vector<std::uint16_t>{40000});
    CHECK(file.label == std::vector<std::uint32_t>{4000000000U});
    CHECK(file.time == std::vector<double>{0.1});
  };
  const auto v = [](auto value) { return packed(value); };
  const auto build = [&](auto&& order) {
    return order(v(std::uint16_t{2})) + order(v(std::int16_t{1})) + order(v(std::int16_t{2})) +
           order(v(std::uint16_t{0})) + v(std::int8_t{-1}) + order(v(std::int16_t{-2})) +
           order(v(std::uint16_t{40000})) + order(v(std::int32_t{-3})) + order(v(std::int32_t{1})) +
           order(v(3.5)) + order(v(std::uint32_t{4000000000U})) + order(v(691234.125)) +
           order(v(-2.5F)) + v(std::int8_t{-7}) + order(v(0.1));
  };
  check(read_file_of("le.ply", "ply\nformat binary_little_endian 1.0\n" + types +
                                   build([](std::string s) { return s; })));
  check(read_file_of("be.ply", "ply\nformat binary_big_endian 1.0\n" + types + build(reversed)));
}

TEST_CASE("PCD: ascii, with a field to skip and a viewpoint") {
  const PointFile file =
      read_file_of("a.pcd",
                   "# .PCD v0.7\nVERSION .7\nFIELDS x y z normal ring label\n"
                   "SIZE 4 4 4 4 2 4\nTYPE F F F F U U\nCOUNT 1 1 1 2 1 1\nWIDTH 2\n"
                   "HEIGHT 1\n# half a turn about z\nVIEWPOINT 1 2 3 0 0 0 1\n"
                   "POINTS 2\nDATA ascii\n"
                   "1 2 3 0 0 5 251\nnan nan nan 0 0 6 9\n");
  REQUIRE(file.positions.size() == 2);
  CHECK(file.positions[0] == Eigen::Vector3d(1.0, 2.0, 3.0));
  CHECK(file.positions[1].array().isNaN().all());
  CHECK(file.ring == std::vector<std::uint16_t>{5, 6});
  CHECK(file.label == std::vector<std::uint32_t>{251, 9});
  const Eigen::Vector3d image = file.viewpoint * Eigen::Vector3d(1.0, 0.0, 0.0);
  CHECK(image.isApprox(Eigen::Vector3d(0.0, 2.0, 3.0)));
}

TEST_CASE("PCD: POINTS counts if WIDTH is 0") {
  const PointFile file =
      read_file_of("a.pcd",
                   "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 0\nHEIGHT 1\nPOINTS 2\n"
                   "DATA ascii\n1 2 3\n4 5 6\n");
  REQUIRE(file.positions.size() == 2);
  CHECK(file.positions[1] == Eigen::Vector3d(4.0, 5.0, 6.0));
}

TEST_CASE("PCD: binary and compressed files hold equal points") {
  const std::string header =
      "VERSION 0.7\nFIELDS x _ y z timestamp\nSIZE 4 1 4 4 8\nTYPE F U F F F\nCOUNT 1 3 1 1 1\n"
      "WIDTH 1\nHEIGHT 2\nDATA ";
  const auto check = [](const PointFile& file) {
    REQUIRE(file.positions.size() == 2);
    CHECK(file.positions[0] == Eigen::Vector3d(1.0, 2.0, 3.0));
    CHECK(file.positions[1] == Eigen::Vector3d(4.0, 5.0, 6.0));
    CHECK(file.time == std::vector<double>{0.25, 0.5});
  };
  check(read_file_of("a.pcd", header + "binary\n" + packed(1.0F) + "abc" +
                                  packed(2.0F, 3.0F, 0.25) + packed(4.0F) + "def" +
                                  packed(5.0F, 6.0F, 0.5)));
  // Field after field, stored in literals of at most 32 bytes.
  const std::string plain =
      packed(1.0F, 4.0F) + "abcdef" + packed(2.0F, 5.0F, 3.0F, 6.0F) + packed(0.25, 0.5);
  REQUIRE(plain.size() == 46);
  const std::string compressed =
      std::string(1, 31) + plain.substr(0, 32) + std::string(1, 13) + plain.substr(32);
  check(read_file_of("a.pcd", header + "binary_compressed\n" +
                                  packed(std::uint32_t{48}, std::uint32_t{46}) + compressed));
}

TEST_CASE("Empty clouds") {
  CHECK(read_file_of("a.ply", "ply\nformat ascii 1.0\nelement vertex 0\n" + kPlyXyz)
            .positions.empty());
  CHECK(read_file_of("a.pcd", pcd_header("0", "ascii")).positions.empty());
  CHECK(read_file_of("a.pcd", pcd_header("0", "binary")).positions.empty());
  const std::string no_sizes(8, '\0');
  CHECK(read_file_of("a.pcd", pcd_header("0", "binary_compressed") + no_sizes).positions.empty());
}

TEST_CASE("Malformed point files are refused with position and expectation") {
  using Cases = std::vector<std::pair<std::string, std::string>>;  // content, part of the message
  const auto check = [](const std::string& name, const Cases& cases) {
    for (const auto& [content, expected] : cases) {
      CAPTURE(content.substr(0, 200));
      CHECK_THAT(refusal_of(name, content), ContainsSubstring(expected));
    }
  };
  const std::string ply = "ply\nformat ascii 1.0\n";
  const std::string ply_le = "ply\nformat binary_little_endian 1.0\n";
  const std::string vertex = ply + "element vertex 1\n", vertex_le = ply_le + "element vertex 1\n";
  const std::string huge = "18446744073709551615";
  check(
      "a.ply",
      {{"", ":1: expected \"ply\" as first line"},
       {"PLY\n", ":1: expected \"ply\" as first line"},
       {std::string(100000, 'p'), ":1: expected a line of text"},
       {"ply\n", ":2: file ends, expected end_header"},
       {"ply\nformat ascii 2.0\n", ":2: expected format version 1.0"},
       {"ply\nformat text 1.0\n", ":2: expected ascii, binary_little_endian"},
       {"ply\nelement vertex 0\n" + kPlyXyz, ":6: expected a line \"format\""},
       {ply + "end_header\n", ":3: expected \"element vertex\""},
       {ply + "property float x\n", ":3: expected an element before a property"},
       {ply + "element vertex -1\n", ":3: expected a number of elements"},
       {ply + "element vertex 1e3\n", ":3: expected a number of elements"},
       {ply + "element vertex 99999999999999999999\n", ":3: expected a number of elements"},
       {vertex + "property half x\n", ":4: expected a type"},
       {vertex + "property list float\n", ":4: expected a type"},
       {vertex + "property float\n", ":4: expected the name"},
       {vertex + "vertices\n", ":4: expected element, property"},
       {vertex + "property float x\nproperty float y\nend_header\n1 2\n",
        ":6: expected a number property z"},
       {ply + "element vertex 2\n" + kPlyXyz + "1 2 3\n", ": byte 100: expected 2 elements"},
       {ply + "element vertex 2\n" + kPlyXyz + "1.25 2.25 3.25\n", ":9: file ends"},
       {vertex + kPlyXyz + "1 2\n\n\n", ":8: expected a number for z"},
       {vertex + kPlyXyz + "1 2 x\n", "for z, found \"x\""},
       {vertex + kPlyXyz + "1 2 3 4\n", ":8: expected fewer values"},
       {ply + "element vertex " + huge + "\n" + kPlyXyz, "expected " + huge + " elements"},
       {vertex + "property int label\n" + kPlyXyz + "-1 0 0 0\n",
        ":9: expected a whole number that label can have"},
       {vertex + "property float ring\n" + kPlyXyz + "nan 0 0 0\n",
        ":9: expected a whole number that ring can have"},
       {vertex + "property float ring\n" + kPlyXyz + "1.5 0 0 0\n",
        ":9: expected a whole number that ring can have"},
       {ply + "element a 1\nproperty list int int i\nelement vertex 0\n" + kPlyXyz + "-1\n",
        ":10: expected the length of list i"},
       {ply_le + "element vertex " + huge + "\n" + kPlyXyz, "expected " + huge},
       {ply_le + "element vertex 2\n" + kPlyXyz + std::string(23, 'x'),
        "expected 2 elements of at least 12 bytes, the file has 23 bytes left"},
       {vertex_le + "property list uint double l\n" + kPlyXyz + std::string(16, '\xFF'),
        "expected the length of a list before"},
       {vertex_le + "property list uchar double l\n" + kPlyXyz + std::string(1, '\x01') +
            std::string(12, '\0'),
        "file ends, expected a value"},
       {ply_le + "element a " + huge + "\nproperty list uchar int i\nelement vertex 0\n" + kPlyXyz,
        "expected " + huge + " elements of at least 1 bytes"}});
  const std::string xyz = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\n";
  const auto compressed = [](const std::string& points, std::uint32_t size, std::uint32_t of) {
    return pcd_header(points, "binary_compressed") + packed(size, of);
  };
  check(
      "a.pcd",
      {{"", ":1: file ends, expected a line DATA"},
       {"VERSION 0.7\n", ":2: file ends, expected a line DATA"},
       {"ply\n", ":1: expected a line of a PCD header"},
       {"FIELDS\n", ":1: expected the names of the fields"},
       {"FIELDS x\nFIELDS x\n", ":2: expected FIELDS once"},
       {"SIZE 4 4 4\n", ":1: expected FIELDS before this line"},
       {"FIELDS x y z\nSIZE 4 4\n", ":2: expected 3 values"},
       {"FIELDS x y z\nSIZE 4 4 4 4\n", ":2: expected 3 values"},
       {"FIELDS x y z\nSIZE 4 4 3\n", ":2: expected SIZE 1, 2, 4 or 8 for field z"},
       {"FIELDS x y z\nTYPE F F G\n", ":2: expected TYPE I, U or F for field z"},
       {"FIELDS x y z\nCOUNT 1 1 -1\n", ":2: expected a COUNT"},
       {"FIELDS x y z\nCOUNT 1 1 65537\n", ":2: expected a COUNT"},
       {"FIELDS x y z\nWIDTH many\n", ":2: expected WIDTH as a whole number"},
       {"FIELDS x y z\nVIEWPOINT 0 0 0 0 0 0 0\n", ":2: expected VIEWPOINT"},
       {"FIELDS x y z\nVIEWPOINT 0 0 0 1 0 0\n", ":2: expected VIEWPOINT"},
       {"FIELDS x y z\nVIEWPOINT nan 0 0 1 0 0 0\n", ":2: expected VIEWPOINT"},
       {"FIELDS x y z\nTYPE F F F\nWIDTH 0\nDATA ascii\n", ":4: expected SIZE"},
       {"FIELDS x y z\nSIZE 4 4 4\nWIDTH 0\nDATA ascii\n", ":4: expected TYPE"},
       {"FIELDS x y z\nSIZE 4 4 2\nTYPE F F F\nWIDTH 0\nDATA ascii\n", ":5: expected SIZE 4 or 8"},
       {"FIELDS x y\nSIZE 4 4\nTYPE F F\nWIDTH 0\nDATA ascii\n", ":5: expected a field z"},
       {xyz + "COUNT 1 1 3\nWIDTH 0\nDATA ascii\n", ":6: expected a field z"},
       {xyz + "DATA ascii\n", ":4: expected WIDTH or POINTS"},
       {xyz + "WIDTH 2\nHEIGHT 3\nPOINTS 5\nDATA ascii\n",
        ":7: expected POINTS to be WIDTH * HEIGHT"},
       {xyz + "WIDTH " + huge + "\nHEIGHT 2\nDATA binary\n",
        ":6: expected POINTS to be WIDTH * HEIGHT"},
       {pcd_header("1", "zipped"), ":10: expected DATA ascii, binary or"},
       {pcd_header("1", "ascii") + "1 2\n\n\n", ":11: expected a number for z"},
       {pcd_header("1", "ascii") + "1 2 3 4\n", ":11: expected fewer values"},
       {pcd_header("2", "ascii") + "1.5 2.5 3.5\n", ":12: file ends, expected 2 points"},
       {pcd_header(huge, "ascii"), "expected " + huge + " points"},
       {pcd_header("1000000000000", "binary") + std::string(24, 'x'),
        "expected 1000000000000 points of at least 12 bytes, the file has 24 bytes left"},
       {pcd_header("2", "binary") + std::string(23, 'x'), "the file has 23 bytes left"},
       {pcd_header("1", "binary_compressed") + "1234567", "file ends, expected the sizes"},
       {compressed("1", 13, 12) + std::string(12, '\0'),
        "expected 13 bytes of compressed points, the file has 12"},
       {compressed("1", 4, 13) + "1234",
        "expected a block of 1 points of 12 bytes, its size is given as 13"},
       {compressed("100000000", 4, 1200000000) + "1234", "4 bytes cannot hold 1200000000"},
       {compressed("1", 2, 12) + "\x20" + std::string(1, '\0'),
        "expected a sound compressed block"}});
}

TEST_CASE("A truncated point file is detected without reading its points") {
  const TemporaryFolder folder;
  struct Case {
    std::string name;
    std::string header;
    std::string data;
    std::string expected;
  };
  const std::string block = packed(std::uint32_t{13}, std::uint32_t{12}) + std::string(13, '\0');
  for (const Case& whole : std::vector<Case>{
           {"a.pcd", pcd_header("2", "ascii"), "1 2 3\n1 2 3", "expected 2 points"},
           {"a.pcd", pcd_header("2", "binary"), std::string(24, 'x'), "expected 2 points"},
           {"a.pcd", pcd_header("1", "binary_compressed"), block, "expected 13 bytes"},
           {"a.ply", "ply\nformat binary_little_endian 1.0\nelement vertex 2\n" + kPlyXyz,
            std::string(24, 'x'), "expected 2 elements"}}) {
    CAPTURE(whole.name, whole.header);
    const auto refusal = [&](const std::string& content) {
      write_text(folder / whole.name, content);
      return message_of<IoError>([&] { read_point_file_header(folder / whole.name); });
    };
    CHECK(refusal(whole.header + whole.data) == "(nothing was thrown)");
    const std::string half = whole.data.substr(0, whole.data.size() / 2 + 4);
    CHECK_THAT(refusal(whole.header + half),
               StartsWith((folder / whole.name).string()) && ContainsSubstring(whole.expected));
  }
}

TEST_CASE("Missing point files are refused") {
  CHECK_THAT(message_of<IoError>([] { read_points("/no/such/file.ply"); }),
             ContainsSubstring("/no/such/file.ply: cannot be read"));
  TemporaryFolder folder;
  fs::create_directory(folder / "folder.pcd");
  CHECK_THAT(message_of<IoError>([&] { read_points(folder / "folder.pcd"); }),
             ContainsSubstring("folder.pcd: cannot be read"));
}
