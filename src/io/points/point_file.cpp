#include "dynains/io/point_file.hpp"

#include <algorithm>
#include <limits>
#include <sstream>
#include <string>
#include <system_error>
#include <type_traits>
#include <utility>

#include "../byte_reader.hpp"
#include "../failure.hpp"
#include "../scalar.hpp"
#include "../text.hpp"
#include "point_sink.hpp"

namespace dynains {
namespace {

namespace fs = std::filesystem;

const fs::path& checked(const fs::path& path) {
  if (!is_point_file(path)) fail(path, "expected a name that ends in .ply, .pcd or .las");
  return path;
}

struct PointFileFormat {
  const char* extension;
  std::uint64_t (*read)(const fs::path&, PointSink&, bool with_points);
};

constexpr PointFileFormat kPointFileFormats[] = {{".ply", read_ply}, {".pcd", read_pcd},
                                                 {".las", read_las}, {".npy", read_npy},
                                                 {".xyz", read_xyz}, {".csv", read_xyz}};

const PointFileFormat& format_to_read(const fs::path& path) {
  const std::string extension = lower_extension(path);
  for (const PointFileFormat& format : kPointFileFormats) {
    if (format.extension == extension) return format;
  }
  if (std::error_code error; !fs::exists(path, error)) fail(path, "not found");
  const std::optional<std::string> conversion = conversion_of(path);
  fail(path, conversion ? *conversion
                        : "expected a name that ends in .ply, .pcd, .las, .npy, .xyz or .csv");
}

/// Calls `visit(name, value)` for the columns of a point, in the order of the file.
template <class Visit>
void visit_columns(const PointColumns& columns, const FilePoint& point, Visit&& visit) {
  constexpr const char* axes[] = {"x", "y", "z"};
  for (Eigen::Index i = 0; i < 3; ++i) {
    if (columns.double_xyz) {
      visit(axes[i], point.position[i]);
    } else {
      visit(axes[i], static_cast<float>(point.position[i]));
    }
  }
  if (columns.intensity) visit("intensity", point.intensity);
  if (columns.label) visit("label", point.label);
  if (columns.ring) visit("ring", point.ring);
  if (columns.time) visit("time", point.time);
  if (columns.session) visit("session", point.session);
}

const char* ply_type(float) { return "float"; }
const char* ply_type(double) { return "double"; }
const char* ply_type(std::uint16_t) { return "ushort"; }
const char* ply_type(std::uint32_t) { return "uint"; }

std::string ply_header(std::size_t count, const PointColumns& columns, const std::string& padding,
                       const Pose&) {
  std::string text = "ply\nformat binary_little_endian 1.0\ncomment dynains" + padding +
                     "\nelement vertex " + std::to_string(count) + '\n';
  visit_columns(columns, {}, [&](const std::string& name, auto value) {
    text += std::string("property ") + ply_type(value) + ' ' + name + '\n';
  });
  return text + "end_header\n";
}

std::string viewpoint_line(const Pose& pose) {
  const detail::Quaternion q(pose.linear());
  std::ostringstream line;
  text::exact(line) << "VIEWPOINT";
  for (const double value : {pose.translation().x(), pose.translation().y(), pose.translation().z(),
                             q.w(), q.x(), q.y(), q.z()}) {
    line << ' ' << value;
  }
  return line.str();
}

std::string pcd_header(std::size_t count, const PointColumns& columns, const std::string& padding,
                       const Pose& viewpoint) {
  std::string fields = "FIELDS", sizes = "SIZE", types = "TYPE", counts = "COUNT";
  visit_columns(columns, {}, [&](const std::string& name, auto value) {
    fields += ' ' + name;
    sizes += ' ' + std::to_string(sizeof(value));
    const bool is_float = std::is_floating_point_v<decltype(value)>;
    types += is_float ? " F" : " U";
    counts += " 1";
  });
  const std::string size = std::to_string(count);
  return "# .PCD v0.7 - Point Cloud Data file format\n# dynains" + padding + "\nVERSION 0.7\n" +
         fields + '\n' + sizes + '\n' + types + '\n' + counts + "\nWIDTH " + size + "\nHEIGHT 1\n" +
         viewpoint_line(viewpoint) + "\nPOINTS " + size + "\nDATA binary\n";
}

}  // namespace

PointFileWriter::PointFileWriter(const fs::path& path, const PointColumns& columns,
                                 const Pose& viewpoint, const LasOptions& las)
    : path_(checked(path)),
      columns_(columns),
      viewpoint_(viewpoint),
      is_las_(is_las(path)),
      las_(las),
      file_(path) {
  least_.fill(std::numeric_limits<std::int32_t>::max());
  most_.fill(std::numeric_limits<std::int32_t>::min());
  file_.stream() << header();
}

/// Has the same length for every number of points: a comment is padded.
std::string PointFileWriter::header() const {
  if (is_las_) return las_header(path_, las_, size_, least_, most_);
  const auto text = lower_extension(path_) == ".pcd" ? pcd_header : ply_header;
  const std::size_t most = std::numeric_limits<std::size_t>::max();
  const std::size_t length = text(most, columns_, "", viewpoint_).size();
  const std::size_t needed = text(size_, columns_, "", viewpoint_).size();
  return text(size_, columns_, std::string(length - needed, '.'), viewpoint_);
}

void PointFileWriter::add(const FilePoint& point) {
  if (is_las_) {
    buffer_ += las_record(path_, las_, point, least_, most_);
  } else {
    visit_columns(columns_, point, [&](const char*, auto value) { append_number(value, buffer_); });
  }
  ++size_;
  if (buffer_.size() >= 1U << 16U) write_buffer();
}

void PointFileWriter::write_buffer() {
  file_.stream().write(buffer_.data(), static_cast<std::streamsize>(buffer_.size()));
  buffer_.clear();
}

void PointFileWriter::commit(AtomicFile::Sync sync) {
  write_buffer();
  file_.stream().seekp(0);
  file_.stream() << header();
  file_.commit(sync);
}

bool is_las(const fs::path& path) { return lower_extension(path) == ".las"; }

bool is_point_file(const fs::path& path) {
  const std::string extension = lower_extension(path);
  return extension == ".ply" || extension == ".pcd" || extension == ".las";
}

std::optional<std::string> conversion_of(const fs::path& path) {
  struct Conversion {
    const char* ending;  // the extension, or the name of a file in a folder
    const char* text;
  };
  static constexpr Conversion kConversions[] = {
      {".laz",
       "LAZ (compressed LAS) is not read; convert it: pdal translate IN.laz OUT.las, or laszip "
       "-i IN.laz -o OUT.las"},
      {".e57",
       "E57 is not read; convert it: pdal translate IN.e57 OUT.las, or save it as PLY by "
       "CloudCompare"},
      {".npz",
       "NPZ is not read; save its points as NPY: python3 -c \"import numpy as n; n.save('OUT.npy', "
       "n.load('IN.npz')['points'])\""},
      {".pcap",
       "PCAP (packets of a sensor) is not read; play it through the ROS driver of the sensor and "
       "record sensor_msgs/PointCloud2 in a log (.mcap, .bag)"},
      {"points_compact.bin",
       "a dump of GLIM holds submaps, not scans; pass the log that GLIM read, with --poses "
       "traj_lidar.txt of the dump"}};
  const std::string extension = lower_extension(path);
  std::error_code error;
  for (const Conversion& conversion : kConversions) {
    if (extension == conversion.ending || fs::exists(path / conversion.ending, error)) {
      return conversion.text;
    }
  }
  return std::nullopt;
}

PointFile read_points(const fs::path& path) {
  PointSink sink;
  format_to_read(path).read(path, sink, true);
  return std::move(sink.file());
}

PointFileHeader read_point_file_header(const fs::path& path) {
  PointSink sink;
  const std::uint64_t count = format_to_read(path).read(path, sink, false);
  return {sink.file().viewpoint, sink.columns(), count};
}

void copy_points(const std::filesystem::path& path, Span<const std::uint8_t> keep,
                 std::ostream& target) {
  const std::string extension = lower_extension(path);
  if (extension == ".ply") return copy_ply(path, keep, target);
  if (extension == ".pcd") return copy_pcd(path, keep, target);
  if (extension != ".bin") fail(path, "expected a name that ends in .ply, .pcd or .bin");
  ByteReader reader(path);
  const std::uint64_t points = std::max<std::uint64_t>(keep.size(), 1);
  copy_records(reader, static_cast<std::size_t>(reader.remaining() / points), "a point", keep,
               target);
}

void copy_lines(const std::filesystem::path& path, std::uint64_t size, std::ostream& target,
                const std::function<std::string(const std::string&)>& edit) {
  ByteReader reader(path);
  std::string line;
  while (reader.position() < size && reader.read_line(line)) target << edit(line) << '\n';
}

void copy_records(ByteReader& reader, std::size_t size, const char* record,
                  Span<const std::uint8_t> keep, std::ostream& target) {
  std::string bytes(size, '\0');
  for (const std::uint8_t is_kept : keep) {
    if (size > 0) {
      reader.read(bytes.data(), size, record);
    } else if (!reader.read_line(bytes)) {
      reader.fail_on_line(std::string("file ends, expected ") + record);
    }
    if (is_kept == 0) continue;
    target << bytes;
    if (size == 0) target << '\n';
  }
}

std::size_t kept_count(Span<const std::uint8_t> keep) {
  return static_cast<std::size_t>(
      std::count_if(keep.begin(), keep.end(), [](auto value) { return value != 0; }));
}

}  // namespace dynains
