// Points in files of LAS, NumPy and text.

#include "dynains/io/point_file.hpp"
#include "dynains/io/recording.hpp"
#include "io/points/point_sink.hpp"
#include "point_file_of.hpp"
#include "point_format_writer.hpp"
#include "support/catch.hpp"

namespace dynains {

using namespace test;

namespace {

using Position = Eigen::Vector3d;

const std::string kTwoPoints = bytes_of<float>({1, 2, 3, 0.5F, 4, 5, 6, 0.25F});
const std::string kFields =
    "[('x', '<f8'), ('y', '<f8'), ('z', '<f8'), ('name', '<U2'), "
    "('vector', '<f4', (2,)), ('Ring', '>u2'), ('t', '<i8'), "
    "('label', '|u1')]";

std::string structured_point(double x, char ring, std::int64_t time, std::uint8_t label) {
  return packed(x, 2.0, 3.0, zeros(17), ring, time, label);
}

void check_two_points(const PointFile& points) {
  REQUIRE(points.positions.size() == 2);
  CHECK(points.positions[0] == Position(1, 2, 3));
  CHECK(points.positions[1] == Position(4, 5, 6));
  CHECK(points.intensity == std::vector<float>{0.5F, 0.25F});
}

std::string las_points(const LasParts& parts, std::uint8_t label) {
  std::string record =
      packed(std::int32_t{150}, std::int32_t{-1}, std::int32_t{2000000000}, std::uint16_t{700});
  record.resize(parts.format < 6 ? 20 : 22, '\0');
  record += packed(1234.5);
  record.resize(parts.point_size - 3U, '\0');
  return record + packed(std::uint16_t{17}, label);
}

}  // namespace

TEST_CASE("NumPy: rows of x y z and intensity") {
  check_two_points(read_file_of("a.npy", npy_file("'<f4'", "(2, 4)", kTwoPoints)));
  const std::string columns = bytes_of<double>({1, 4, 2, 5, 3, 6, 0.5, 0.25});
  check_two_points(read_file_of("a.NPY", npy_file("'<f8'", "(2, 4)", columns, "True")));
  // An image of points, and integers.
  const PointFile image = read_file_of("a.npy", npy_file("'|i1'", "(2, 1, 3)", "\1\2\3\4\5\6"));
  CHECK(image.positions[1] == Position(4, 5, 6));
  CHECK(image.intensity.empty());
  CHECK(read_file_of("a.npy", npy_file("'<f4'", "(0, 3)", "")).positions.empty());
}

TEST_CASE("NumPy: a structured array has columns by name") {
  const std::string data = structured_point(1e7, 5, -3, 9) + structured_point(1.5, 6, 1LL << 52, 0);
  const PointFile points = read_file_of("a.npy", npy_file(kFields, "(2,)", data));
  CHECK(points.positions[0] == Position(1e7, 2, 3));
  CHECK(points.ring == std::vector<std::uint16_t>{5, 6});
  CHECK(points.time == std::vector<double>{-3.0, 4503599627370496.0});
  CHECK(points.label == std::vector<std::uint32_t>{9, 0});
}

TEST_CASE("NumPy: malformed arrays are refused with the reason") {
  const auto check = [](const std::string& content, const std::string& expected) {
    CHECK_THAT(refusal_of("a.npy", content), ContainsSubstring(expected));
  };
  const std::string xyz = std::string(24, '\0');
  check("", "magic bytes of an array");
  check(std::string("\x93NUMPY\1\0", 8), "the length of the header");
  check(std::string("\x93NUMPY\7\0\1\0", 10), "expected format 1 to 3");
  check(npy_file("'<f4'", "(2, 3)", xyz.substr(1)), "expected all items of the array");
  check(npy_file("'<f4'", "(18446744073709551615, 18446744073709551615)", xyz), "all items");
  check(npy_file("'<f4'", "(2305843009213693952, 8)", xyz), "all items");
  check(npy_file("'<f4'", "(99999999999999999999, 3)", xyz), "length of a dimension");
  const std::string one_item = "[('x', '<u8'), ('y', '>u1'), ('z', '<f4')]";
  check(npy_file(one_item, "()", xyz.substr(0, 5)), "expected all items of the array");
  check(npy_file(one_item, "()", ""), "expected all items of the array");
  // The size of an item must not overflow: 65536^4 values are 2^64 bytes.
  check(npy_file("[('a', '|u1', (65536, 65536, 65536, 65536)), ('x', '<f4'), ('y', '<f4'), ('z', "
                 "'<f4')]",
                 "(1,)", xyz),
        "fields of at most 1 GB");
  check(npy_file("'<f4'", "(6,)", xyz), "expected an array of N rows");
  check(npy_file("'<f4'", "(3, 2)", xyz), "expected an array of N rows");
  check(npy_file("'<f4'", "(-2, 3)", xyz), "length of a dimension");
  check(npy_file("'<f4'", "(2 3)", xyz), "expected ',' or ')'");
  check(npy_file("'<f2'", "(2, 3)", xyz), "float16 is not read");
  check(npy_file("'<M8[ns]'", "(1, 3)", xyz), "expected numbers");
  check(npy_file("''", "(2, 3)", xyz), "expected a type such as");
  check(npy_file("'<f999999999999'", "(2, 3)", xyz), "expected a type such as");
  check(npy_file("[]", "(2,)", xyz), "expected at least one field");
  check(npy_file("[('x', '<f4'), ('y', '<f4')]", "(3,)", xyz), "found no z");
  check(npy_file("[('x', [('a', '<f4')])]", "(3,)", xyz), "fields of one level");
  check(npy_file("'<f4'", "(2, 3)", xyz, "Maybe"), "True or False");
  check(npy_file("'<f4'", "(2, 3)", xyz, "False, 'other': 1"), "once each");
  check(npy_file("'<f4", "(2, 3)", xyz), "header of the array");
  const std::string labels = "[('x', '<f4'), ('y', '<f4'), ('z', '<f4'), ('label', '<f4')]";
  check(npy_file(labels, "(1,)", bytes_of<float>({1, 2, 3, -1})), "whole numbers of at least 0");
}

TEST_CASE("LAS: versions and point formats with scale, offset, time and extra bytes") {
  for (const LasParts& parts :
       {LasParts{2, 0, "", 20, 1}, LasParts{2, 1, "", 31, 1}, LasParts{3, 3, "", 37, 1},
        LasParts{4, 6, "", 40, 1},
        LasParts{4, 7, extra_bytes("ring", 3) + extra_bytes("label", 1), 39, 1}}) {
    CAPTURE(int(parts.format));
    const PointFile points = read_file_of("a.las", las_file(parts, las_points(parts, 9)));
    REQUIRE(points.positions.size() == 1);
    CHECK(points.positions[0].isApprox(Position(101.5, 199.99, 20000300.0), 1e-12));
    if (parts.point_size > 22) CHECK(points.intensity[0] == 700.0F);
    CHECK(points.time == (parts.format == 0 ? std::vector<double>{} : std::vector<double>{1234.5}));
    if (parts.extra_bytes.empty()) continue;
    CHECK(points.ring == std::vector<std::uint16_t>{17});
    CHECK(points.label == std::vector<std::uint32_t>{9});
  }
}

TEST_CASE("LAS: malformed files are refused with position and reason") {
  const LasParts good;
  const std::string whole = las_file(good, las_points(good, 9));
  const auto check = [](LasParts parts, const std::string& points, const std::string& expected) {
    CHECK_THAT(refusal_of("a.las", las_file(parts, points)), ContainsSubstring(expected));
  };
  CHECK_THAT(refusal_of("a.las", "LASX"), ContainsSubstring("byte 0: expected LASF"));
  CHECK_THAT(refusal_of("a.las", whole.substr(0, 100)),
             ContainsSubstring("a.las: byte 100: expected 4 bytes"));
  for (std::size_t size = 0; size < whole.size(); ++size)
    refusal_of("a.las", whole.substr(0, size));
  check({5, 1, "", 28, 1}, "", "found 1.5");
  check({4, 11, "", 28, 1}, "", "point format from 0 to 10");
  check({4, 0x86, "", 30, 1}, "", "pdal translate IN.laz OUT.las");
  check({4, 6, "", 29, 1}, "", "points of at least 30 bytes, found 29");
  check({2, 1, "", 28, 4000000000U}, std::string(28, '\0'), "expected 4000000000 points");
  check({4, 6, "", 30, 2}, std::string(59, '\0'), "expected 2 points of 30 bytes");
  check({4, 6, extra_bytes("label", 1), 30, 1}, std::string(30, '\0'), "within the 30 bytes");
  check({4, 6, extra_bytes("label", 30), 34, 1}, std::string(34, '\0'), "from 0 to 10, found 30");
  const std::string bad_label = std::string(30, '\0') + bytes_of<float>({-1});
  check({4, 6, extra_bytes("label", 9), 34, 1}, bad_label, "expected a whole number");
}

TEST_CASE("Text: columns by order or by name, with any separator") {
  check_two_points(read_file_of("a.xyz", "1 2 3 0.5\n\n4 5 6 .25\n"));
  check_two_points(read_file_of("a.csv", "1,2,3,0.5,9\r\n4, 5, 6, 0.25, 9"));
  check_two_points(read_file_of(
      "a.csv", "\"X\";\"Y\";\"Z\";\"colour\";\"Intensity\"\n1;2;3;9;0.5\n4;5;6;9;0.25\n"));
  check_two_points(read_file_of(
      "a.csv", "Points_m_XYZ:0,Points_m_XYZ:1,Points_m_XYZ:2,intensity\n1,2,3,0.5\n4,5,6,0.25\n"));
  check_two_points(read_file_of("a.xyz", "# x y z i\n# a comment\n1 2 3 0.5\n4 5 6 0.25\n"));
  check_two_points(read_file_of("a.xyz", "//X Y Z intensity\n1 2 3 0.5\n4 5 6 0.25\n"));
  check_two_points(read_file_of("a.xyz", "# from a scanner\n1 2 3 0.5\n4 5 6 0.25\n"));
  const PointFile points = read_file_of("a.csv", "time,label,ring,z,y,x\n1e9,251,7,3,2,1\n");
  CHECK(points.positions[0] == Position(1, 2, 3));
  CHECK(points.time == std::vector<double>{1e9});
  CHECK(points.label == std::vector<std::uint32_t>{251});
  CHECK(points.ring == std::vector<std::uint16_t>{7});
  CHECK(read_file_of("a.csv", "x,y,z\n").positions.empty());
}

TEST_CASE("Text: malformed lines are refused with their number") {
  const auto check = [](const std::string& content, const std::string& expected) {
    CHECK_THAT(refusal_of("a.csv", content), ContainsSubstring(expected));
  };
  check("", "expected at least one point");
  check("# nothing\n", "expected at least one point");
  check("1 2\n", ":1: expected at least 3 numbers");
  check("1 2 3\n1 2\n", ":2: expected 3 columns, found 2");
  check("1 2 3\n1 2 three\n", ":2: expected a number that the column can have, found \"three\"");
  check("x,y\n1,2\n", ":1: expected columns x, y and z, found no z");
  check("x,y,z,label\n1,2,3,-1\n", ":2: expected a number that the column can have, found \"-1\"");
}

TEST_CASE("Scans of a recording can be LAS, NumPy or text, and poses.csv is none") {
  const TemporaryFolder folder;
  const LasParts parts{4, 6, "", 33, 1};
  const auto write = [&](const std::string& kind, const std::string& content) {
    write_text(folder / kind / ("0." + kind), content);
    write_text(folder / kind / ("1." + kind), content);
    write_text(folder / kind / "poses.csv",
               "t,x,y,z,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n1,1,0,0,0,0,0,1\n");
  };
  write("csv", "1,2,3\n4,5,6\n");
  write("npy", npy_file("'<f4'", "(2, 4)", kTwoPoints));
  write("las", las_file(parts, las_points(parts, 0)));
  for (const auto& [kind, format] :
       {std::pair("csv", ScanFormat::kCsv), {"npy", ScanFormat::kNpy}, {"las", ScanFormat::kLas}}) {
    CAPTURE(kind);
    const Recording recording(folder / kind);
    CHECK(recording.format() == format);
    CHECK(recording.size() == 2);
    CHECK(recording.columns().time == (format == ScanFormat::kLas));
    CHECK(recording.read_scan(1).size() == recording.point_count(1));
  }
  // Beside scans of other formats, a table is no scan.
  write_text(folder / "csv" / "2.bin", std::string(16, '\0'));
  write_text(folder / "csv" / "poses.csv", "t,x,y,z,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n");
  CHECK(Recording(folder / "csv").format() == ScanFormat::kBin);
}

TEST_CASE("A known format that is not read gets its name and the way to convert it") {
  for (const auto& [name, expected] :
       {std::pair<std::string, std::string>("scan.laz", "pdal translate"),
        {"scan.E57", "pdal translate"},
        {"scan.npz", "n.load('IN.npz')"},
        {"drive.pcap", "sensor_msgs/PointCloud2"}}) {
    const TemporaryFolder folder;
    write_text(folder / name, "content");
    const auto of_folder = message_of<IoError>([&] { Recording recording(folder.path()); });
    CHECK_THAT(of_folder, ContainsSubstring(name + ": ") && ContainsSubstring(expected));
    const auto of_file = message_of<IoError>([&] { Recording recording(folder / name); });
    CHECK_THAT(of_file, StartsWith((folder / name).string()) && ContainsSubstring(expected));
    CHECK_THAT(refusal_of(name, ""), ContainsSubstring(expected));
  }
  const TemporaryFolder dump;
  write_text(dump / "000000" / "points_compact.bin", std::string(24, '\0'));
  CHECK_THAT(message_of<IoError>([&] { Recording recording(dump.path()); }),
             ContainsSubstring("000000: a dump of GLIM") && ContainsSubstring("traj_lidar.txt"));
}

}  // namespace dynains
