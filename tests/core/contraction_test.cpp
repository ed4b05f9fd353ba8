// A consumer may let the compiler fuse multiplications and additions. This changes few labels.
// Other SIMD packs and another processor change no label.
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <iterator>
#include <optional>
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

std::string quoted(const std::string& path) { return '"' + path + '"'; }

// `command`: the program, quoted if it has blanks, or an emulator and the program.
int label(const std::string& command, const std::string& scans, const std::string& labels) {
  const int status = std::system((command + ' ' + scans + ' ' + labels).c_str());
  return WEXITSTATUS(status);
}

// Writes scans of a car in a yard for the program; returns the number of points.
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

struct Labels {
  std::vector<char> exact, other;
};

// Labels of the scans by the exact build and by another one, in files called `name`. Empty if the
// processor lacks a feature of the other build.
std::optional<Labels> labels_by_both(const std::string& other, const std::string& name) {
  const std::string scans = name + ".scans";
  const std::size_t count = write_scans(scans);
  REQUIRE(label(quoted(DYNAINS_LABELS_EXACT), scans, name + ".exact") == 0);
  const int status = label(other, scans, name + ".other");
  if (status == 77) {
    std::cout << "SKIPPED: not with this processor: " << other << "\n";
    return std::nullopt;
  }
  REQUIRE(status == 0);
  Labels labels{bytes_of(name + ".exact"), bytes_of(name + ".other")};
  REQUIRE(labels.exact.size() == count);
  REQUIRE(labels.other.size() == count);
  return labels;
}

TEST_CASE("with contraction on, less than one label in a thousand differs") {
  const std::optional<Labels> labels = labels_by_both(quoted(DYNAINS_LABELS_FUSED), "fused");
  if (!labels) return;
  const std::size_t count = labels->exact.size();
  std::size_t different = 0;
  for (std::size_t i = 0; i < count; ++i) {
    different += labels->exact[i] != labels->other[i] ? 1U : 0U;
  }
  CAPTURE(different, count);
  CHECK(different * 1000 < count);
}

TEST_CASE("without wide vectors, and without SSE, all labels are equal") {
  const std::optional<Labels> labels = labels_by_both(quoted(DYNAINS_LABELS_PLAIN), "plain");
  REQUIRE(labels);
  CHECK(labels->other == labels->exact);
}

TEST_CASE("with AVX2 for the whole program, all labels are equal") {
  const std::optional<Labels> labels = labels_by_both(quoted(DYNAINS_LABELS_AVX2), "avx2");
  if (!labels) return;
  CHECK(labels->other == labels->exact);
}

TEST_CASE("on aarch64, all labels are equal") {
  const std::string command = DYNAINS_LABELS_AARCH64;
  if (command.empty()) {
    std::cout << "SKIPPED: without aarch64-linux-gnu-g++ and qemu-aarch64\n";
    return;
  }
  const std::optional<Labels> labels = labels_by_both(command, "aarch64");
  REQUIRE(labels);
  CHECK(labels->other == labels->exact);
}

}  // namespace
}  // namespace dynains::test
