// Copies of point files keep every byte of the points that stay.
#include "io/files.hpp"
#include "io/points/point_sink.hpp"
#include "support/catch.hpp"

using namespace dynains;
using namespace dynains::test;

namespace {

/// The copy of a file with this content without the second of its three points.
std::string copy_of(const std::string& name, const std::string& content) {
  const TemporaryFolder folder;
  write_text(folder / name, content);
  const std::vector<std::uint8_t> keep = {1, 0, 1};
  std::ostringstream copy;
  copy_points(folder / name, keep, copy);
  return copy.str();
}

std::string ply(const std::string& format, int count, const std::string& more = "") {
  return "ply\nformat " + format + " 1.0\ncomment of another program\nelement vertex " +
         std::to_string(count) +
         "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n" + more +
         "end_header\n";
}

std::string pcd(const std::string& encoding, int width, int height = 1) {
  return "# made by another program\nVERSION 0.7\nFIELDS x y z _ day\nSIZE 4 4 4 1 2\n"
         "TYPE F F F U U\nCOUNT 1 1 1 3 1\nWIDTH " +
         std::to_string(width) + "\nHEIGHT " + std::to_string(height) +
         "\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + std::to_string(width * height) + "\nDATA " +
         encoding + '\n';
}

// Three records of `size` bytes, of letters that no text reader could take for numbers.
std::string record(char letter, std::size_t size) { return std::string(size, letter); }

}  // namespace

TEST_CASE("copies of PLY keep columns, comments and bytes") {
  CHECK(copy_of("a.ply", ply("ascii", 3) + "1 2 3  7\n4 5 6 8\n7 8.50 9 9\n") ==
        ply("ascii", 2) + "1 2 3  7\n7 8.50 9 9\n");
  for (const std::string format : {"binary_little_endian", "binary_big_endian"}) {
    CHECK(copy_of("a.ply", ply(format, 3) + record('a', 13) + record('b', 13) + record('c', 13)) ==
          ply(format, 2) + record('a', 13) + record('c', 13));
  }
  const std::string empty_faces = "element face 0\nproperty list uchar int vertex_indices\n";
  CHECK(copy_of("a.PLY", ply("ascii", 3, empty_faces) + "1 2 3 7\n4 5 6 8\n7 8 9 9\n") ==
        ply("ascii", 2, empty_faces) + "1 2 3 7\n7 8 9 9\n");
}

TEST_CASE("copies of PCD keep columns, comments and bytes") {
  CHECK(copy_of("a.pcd", pcd("ascii", 3) + "1 2 3 0 0 0 7\n4 5 6 0 0 0 8\n7 8 9 0 0 0 9\n") ==
        pcd("ascii", 2) + "1 2 3 0 0 0 7\n7 8 9 0 0 0 9\n");
  CHECK(
      copy_of("a.pcd", pcd("binary", 1, 3) + record('a', 17) + record('b', 17) + record('c', 17)) ==
      pcd("binary", 2) + record('a', 17) + record('c', 17));
  // Field after field, in literals of at most 32 bytes.
  const std::string plain =
      "aaaabbbbcccc"
      "ddddeeeeffff"
      "gggghhhhiiii"
      "jjjkkklll"
      "mmnnoo";
  REQUIRE(plain.size() == 51);
  const std::string block =
      std::string(1, 31) + plain.substr(0, 32) + std::string(1, 18) + plain.substr(32);
  const std::string sizes("\x35\0\0\0\x33\0\0\0", 8);
  CHECK(copy_of("a.pcd", pcd("binary_compressed", 3) + sizes + block) ==
        pcd("binary", 2) + "aaaaddddggggjjjmm" + "ccccffffiiiillloo");
}

TEST_CASE("copies refuse what is more than points, and other formats") {
  const std::string points = "1 2 3 7\n4 5 6 8\n7 8 9 9\n";
  const std::string faces = "element face 1\nproperty list uchar int vertex_indices\n";
  CHECK_THROWS_WITH(copy_of("a.ply", ply("ascii", 3, faces) + points + "3 0 1 2\n"),
                    ContainsSubstring("expected points alone, found \"element face 1\""));
  CHECK_THROWS_WITH(copy_of("a.ply", ply("ascii", 3, "property list uchar int around\n") + points),
                    ContainsSubstring("expected vertices without the list around"));
  CHECK_THROWS_WITH(copy_of("a.ply", ply("ascii", 3) + "1 2 3 7\n"),
                    ContainsSubstring("file ends"));
  CHECK_THROWS_WITH(copy_of("a.xyz", points), ContainsSubstring("ends in .ply, .pcd or .bin"));
}
