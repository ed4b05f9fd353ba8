// A consumer may let the compiler fuse multiplications and additions: labels then hardly change.
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <iterator>
#include <string>
#include <vector>

#include "support/catch.hpp"
#include "support/scene.hpp"

namespace dynains::test {
namespace {

std::vector<char> bytes_of(const std::string& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

int label(const std::string& program, const std::string& scans, const std::string& labels) {
  const int status = std::system(("\"" + program + "\" " + scans + " " + labels).c_str());
  return WEXITSTATUS(status);
}

// A car in a yard, as the program reads it; the number of points.
std::size_t write_scans(const std::string& scans) {
  std::size_t count = 0;
  std::ofstream file(scans, std::ios::binary);
  for (const Scan& scan : drive(yard_with(van(14.0, 3.5, {-6.0, 0.0, 0.0})), 8, 3.0, 0.3)) {
    const std::uint64_t points = scan.points.size();
    count += points;
    file.write(reinterpret_cast<const char*>(&points), sizeof(points));
    file.write(reinterpret_cast<const char*>(scan.T_world_sensor.matrix().data()),
               16 * sizeof(double));
    for (const Eigen::Vector3f& p : scan.points) {
      file.write(reinterpret_cast<const char*>(p.data()), 3 * sizeof(float));
    }
  }
  return count;
}

TEST_CASE("with contraction on, less than one label in a thousand differs") {
  const std::string scans = "contraction.scans";
  const std::size_t count = write_scans(scans);
  REQUIRE(label(DYNAINS_LABELS_EXACT, scans, "contraction.off") == 0);
  const int fused = label(DYNAINS_LABELS_FUSED, scans, "contraction.on");
  if (fused == 77) {
    std::cout << "SKIPPED: this processor has no fused multiply-add\n";
    return;
  }
  REQUIRE(fused == 0);
  const std::vector<char> off = bytes_of("contraction.off");
  const std::vector<char> on = bytes_of("contraction.on");
  REQUIRE(off.size() == count);
  REQUIRE(on.size() == count);
  std::size_t different = 0;
  for (std::size_t i = 0; i < count; ++i) different += off[i] != on[i] ? 1U : 0U;
  CAPTURE(different, count);
  CHECK(different * 1000 < count);
}

TEST_CASE("without wide vectors, and without SSE, labels are the same byte for byte") {
  const std::string scans = "instructions.scans";
  const std::size_t count = write_scans(scans);
  REQUIRE(label(DYNAINS_LABELS_EXACT, scans, "instructions.wide") == 0);
  REQUIRE(label(DYNAINS_LABELS_PLAIN, scans, "instructions.plain") == 0);
  const std::vector<char> wide = bytes_of("instructions.wide");
  REQUIRE(wide.size() == count);
  CHECK(bytes_of("instructions.plain") == wide);
}

TEST_CASE("with AVX2 wherever the compiler likes it, labels are the same byte for byte") {
  const std::string scans = "avx2.scans";
  const std::size_t count = write_scans(scans);
  REQUIRE(label(DYNAINS_LABELS_EXACT, scans, "avx2.chosen") == 0);
  const int all_over = label(DYNAINS_LABELS_AVX2, scans, "avx2.all_over");
  if (all_over == 77) {
    std::cout << "SKIPPED: this processor has no AVX2\n";
    return;
  }
  REQUIRE(all_over == 0);
  const std::vector<char> chosen = bytes_of("avx2.chosen");
  REQUIRE(chosen.size() == count);
  CHECK(bytes_of("avx2.all_over") == chosen);
}

}  // namespace
}  // namespace dynains::test
