#include "dynains/io/kitti.hpp"

#include <system_error>

#include "../byte_reader.hpp"
#include "../failure.hpp"
#include "../input_file.hpp"
#include "../text.hpp"
#include "bin_layout.hpp"
#include "dynains/io/atomic_file.hpp"

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__,
              "scans and labels are little-endian and read as they stand");

namespace dynains {
namespace {

namespace fs = std::filesystem;

/// Fills `values` from a file that must have exactly that size.
template <class T>
void read_all(const fs::path& path, std::vector<T>& values) {
  ByteReader(path).read(values.data(), values.size(), "its size");
}

template <class T>
void write_all(const fs::path& path, Span<const T> values) {
  AtomicFile file(path);
  file.stream().write(reinterpret_cast<const char*>(values.data()),
                      static_cast<std::streamsize>(values.size() * sizeof(T)));
  file.commit(AtomicFile::Sync::kLater);
}

}  // namespace

void read_scan(const fs::path& file, std::vector<float>& xyzi) {
  const std::size_t count = 4 * static_cast<std::size_t>(count_bin_points(file, BinLayout()));
  if (count > xyzi.capacity()) {
    xyzi = {};
    xyzi.reserve(count + count / 8);  // scans of one sensor differ in size; resize() would double
  }
  xyzi.resize(count);
  read_all(file, xyzi);
}

std::vector<std::uint32_t> read_labels(const fs::path& file, std::size_t count) {
  const std::uint64_t size = size_of_file(file);
  if (size != count * sizeof(std::uint32_t)) {
    fail(file, "has " + std::to_string(size) + " bytes, expected " +
                   std::to_string(count * sizeof(std::uint32_t)) + " (uint32 for each of " +
                   std::to_string(count) + " points)");
  }
  std::vector<std::uint32_t> labels(count);
  read_all(file, labels);
  return labels;
}

std::vector<std::uint8_t> read_point_bytes(const fs::path& file, std::size_t count) {
  const std::string expected =
      "; expected a byte for each of the scan's " + std::to_string(count) + " points";
  std::error_code error;
  const std::uintmax_t size = fs::file_size(file, error);
  if (error == std::errc::no_such_file_or_directory) return {};
  if (error) fail(file, error.message() + expected);
  if (size != count) fail(file, "has " + std::to_string(size) + " bytes" + expected);
  std::vector<std::uint8_t> bytes(count);
  read_all(file, bytes);
  return bytes;
}

void write_scan(const fs::path& file, Span<const float> xyzi) {
  if (xyzi.size() % 4 != 0) fail(file, "expected 4 floats for each point to write");
  write_all(file, xyzi);
}

void write_labels(const fs::path& file, Span<const std::uint32_t> labels) {
  write_all(file, labels);
}

void write_point_bytes(const fs::path& file, Span<const std::uint8_t> bytes) {
  write_all(file, bytes);
}

void write_poses(const fs::path& file, Span<const Pose> poses) {
  AtomicFile out(file);
  text::exact(out.stream());
  for (const Pose& pose : poses) {
    for (Eigen::Index i = 0; i < 12; ++i) {
      out.stream() << pose(i / 4, i % 4) << (i == 11 ? '\n' : ' ');
    }
  }
  out.commit();
}

void write_times(const fs::path& file, Span<const double> times) {
  AtomicFile out(file);
  text::exact(out.stream());
  for (const double time : times) out.stream() << time << '\n';
  out.commit();
}

void write_calib(const fs::path& file, const Pose& Tr) {
  AtomicFile out(file);
  text::exact(out.stream()) << "Tr:";
  for (Eigen::Index i = 0; i < 12; ++i) out.stream() << ' ' << Tr(i / 4, i % 4);
  out.stream() << '\n';
  out.commit();
}

}  // namespace dynains
