#include "dynains/io/kitti.hpp"

#include <fstream>
#include <system_error>

#include "dynains/io/atomic_file.hpp"
#include "failure.hpp"
#include "input_file.hpp"
#include "kitti_files.hpp"
#include "sequential_file.hpp"
#include "text.hpp"

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__,
              "scans and labels are little-endian and read as they stand");

namespace dynains {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kFloatsPerPoint = 4;
constexpr std::uintmax_t kBytesPerPoint = kFloatsPerPoint * sizeof(float);

std::uintmax_t size_of(const fs::path& path) {
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error);
  if (error) fail(path, "cannot be read: " + error.message());
  return size;
}

/// Fills `values` from a file that must have exactly that size.
template <class T>
void read_all(const fs::path& path, std::vector<T>& values) {
  SequentialFile(path, values.size() * sizeof(T)).read(values.data(), values.size());
}

template <class T>
void write_all(const fs::path& path, Span<const T> values) {
  AtomicFile file(path);
  file.stream().write(reinterpret_cast<const char*>(values.data()),
                      static_cast<std::streamsize>(values.size() * sizeof(T)));
  file.commit(AtomicFile::Sync::kLater);
}

}  // namespace

KittiSequence::KittiSequence(const fs::path& folder) : folder_(folder) {
  if (!is_folder(folder)) fail(folder, "is not a folder");
  const std::vector<NumberedScan> scans = list_kitti_scans(folder / "velodyne");

  const fs::path poses_path = folder / "poses.txt";
  if (!is_there(poses_path)) {
    fail(poses_path, "not found: expected a row of 12 numbers for each scan");
  }
  const std::vector<Pose> poses = read_kitti_poses(poses_path);
  const std::uint64_t last = scans.back().number;
  const bool by_order = last >= poses.size() && poses.size() == scans.size();
  const std::size_t needed = by_order ? scans.size() : static_cast<std::size_t>(last) + 1;
  check_rows(poses_path, poses.size(), needed);

  const fs::path times_path = folder / "times.txt";
  std::vector<double> times;
  const bool has_times = is_there(times_path);
  if (has_times) {
    times = read_kitti_times(times_path);
    check_rows(times_path, times.size(), needed);
  }

  const fs::path calib_path = folder / "calib.txt";
  const Pose Tr = is_there(calib_path) ? read_kitti_calib(calib_path) : Pose::Identity();

  scans_.resize(scans.size());
  for (std::size_t i = 0; i < scans.size(); ++i) {
    const std::size_t row = by_order ? i : static_cast<std::size_t>(scans[i].number);
    scans_[i].name = scans[i].name;
    scans_[i].T_world_sensor = Tr.inverse() * poses[row] * Tr;
    scans_[i].time = has_times ? times[row] : kKittiPeriod * static_cast<double>(row);
  }
  has_labels_ = is_folder(folder / "labels");
}

fs::path KittiSequence::scan_path(std::size_t i) const {
  return folder_ / "velodyne" / (name(i) + ".bin");
}

std::size_t KittiSequence::point_count(std::size_t i) const {
  return count_scan_points(scan_path(i));
}

std::size_t count_scan_points(const fs::path& file) {
  const std::uintmax_t size = size_of(file);
  if (size % kBytesPerPoint != 0) {
    fail(file, "truncated at byte " + std::to_string(size) + ": expected a multiple of " +
                   std::to_string(kBytesPerPoint) + " bytes (float32 x y z intensity)");
  }
  return static_cast<std::size_t>(size / kBytesPerPoint);
}

std::vector<float> KittiSequence::read_scan(std::size_t i) const {
  std::vector<float> xyzi;
  read_scan(i, xyzi);
  return xyzi;
}

void KittiSequence::read_scan(std::size_t i, std::vector<float>& xyzi) const {
  dynains::read_scan(scan_path(i), xyzi);
}

void read_scan(const fs::path& file, std::vector<float>& xyzi) {
  const std::size_t count = count_scan_points(file) * kFloatsPerPoint;
  if (count > xyzi.capacity()) {
    xyzi = {};
    xyzi.reserve(count + count / 8);  // scans of one sensor differ in size; resize() would double
  }
  xyzi.resize(count);
  read_all(file, xyzi);
}

std::vector<std::uint32_t> KittiSequence::read_labels(std::size_t i) const {
  return dynains::read_labels(folder_ / "labels" / (name(i) + ".label"), point_count(i));
}

void check_labels(const fs::path& file, std::size_t count) {
  const std::uintmax_t size = size_of(file);
  if (size != count * sizeof(std::uint32_t)) {
    fail(file, "has " + std::to_string(size) + " bytes, expected " +
                   std::to_string(count * sizeof(std::uint32_t)) + " (uint32 for each of " +
                   std::to_string(count) + " points)");
  }
}

std::vector<std::uint32_t> read_labels(const fs::path& file, std::size_t count) {
  check_labels(file, count);
  std::vector<std::uint32_t> labels(count);
  read_all(file, labels);
  return labels;
}

void write_scan(const fs::path& file, Span<const float> xyzi) {
  if (xyzi.size() % kFloatsPerPoint != 0) fail(file, "expected 4 floats for each point to write");
  write_all(file, xyzi);
}

void write_labels(const fs::path& file, Span<const std::uint32_t> labels) {
  write_all(file, labels);
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
