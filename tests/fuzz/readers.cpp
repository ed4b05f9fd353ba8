// Every reader of files: any bytes give a valid value or an IoError.

#include "city/session_file.hpp"
#include "dynains/compiled_remover.hpp"
#include "dynains/io/kitti.hpp"
#include "dynains/io/point_file.hpp"
#include "dynains/pose.hpp"
#include "io/point_format_writer.hpp"
#include "io/poses/kitti_files.hpp"
#include "run/settings/parameter_values.hpp"
#include "support/standard.hpp"
#include "targets.hpp"

namespace dynains::fuzz {
namespace {

/// Writes a file of this name, in a folder that lives as long as the process.
fs::path file_of(const char* name, Bytes bytes) {
  static const test::TemporaryFolder folder;
  const fs::path path = folder / name;
  test::write_text(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  return path;
}

std::size_t column_size(std::size_t column, std::size_t points) {
  return column == 0 ? points : column;
}

template <const char* name>
void read_point_file(Bytes bytes) {
  expect_value_or<IoError>(file_of(name, bytes), [&](const fs::path& path) {
    const PointFile file = read_points(path);
    const std::size_t count = file.positions.size();
    require(count <= bytes.size() || bytes.size() > (1U << 16), "points come from bytes");
    require(column_size(file.intensity.size(), count) == count, "an intensity for each point");
    require(column_size(file.label.size(), count) == count, "a label for each point");
  });
}

std::string pose_row(double x) { return "1 0 0 " + std::to_string(x) + " 0 1 0 -2.5 0 0 1 1e-3\n"; }

std::string pcd(const std::string& data, const std::string& points) {
  return "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z intensity label\nSIZE 4 4 4 4 4\nTYPE F F F F U\n"
         "COUNT 1 1 1 1 1\nWIDTH 2\nHEIGHT 1\nVIEWPOINT 1 2 3 1 0 0 0\nPOINTS 2\nDATA " +
         data + "\n" + points;
}

std::string ply(const std::string& format, const std::string& points) {
  return "ply\nformat " + format +
         " 1.0\ncomment no\nelement camera 1\nproperty list uchar int views\nelement vertex 2\n"
         "property float x\nproperty float y\nproperty float z\nproperty uchar intensity\n"
         "element face 0\nproperty list uchar int vertex_indices\nend_header\n" +
         points;
}

constexpr char kPly[] = "cloud.ply", kPcd[] = "cloud.pcd", kLas[] = "cloud.las",
               kNpy[] = "cloud.npy", kXyz[] = "cloud.xyz";

void read_labels_file(Bytes bytes) {
  const std::size_t count = bytes.size() / sizeof(std::uint32_t);
  expect_value_or<IoError>(file_of("000000.label", bytes), [&](const fs::path& path) {
    require(read_labels(path, count).size() == count, "a label for each point");
    require(count * sizeof(std::uint32_t) == bytes.size(), "no part of a label");
  });
}

void read_scan_file(Bytes bytes) {
  expect_value_or<IoError>(file_of("000000.bin", bytes), [&](const fs::path& path) {
    std::vector<float> xyzi;
    read_scan(path, xyzi);
    require(xyzi.size() * sizeof(float) == bytes.size(), "every byte is read");
  });
}

void read_calib(Bytes bytes) {
  expect_value_or<IoError>(file_of("calib.txt", bytes), [](const fs::path& path) {
    require(read_kitti_calib(path).matrix().allFinite(), "calibration is finite");
  });
}

void read_times(Bytes bytes) {
  expect_value_or<IoError>(file_of("times.txt", bytes), [](const fs::path& path) {
    const std::vector<double> times = read_kitti_times(path);
    for (std::size_t i = 0; i < times.size(); ++i) {
      require(std::isfinite(times[i]) && (i == 0 || times[i] > times[i - 1]), "times increase");
    }
  });
}

void read_config(Bytes bytes) {
  const fs::path path = file_of("run.cfg", bytes);
  expect_value_or<ConfigError>(path, [](const fs::path& file) {
    const run::ParameterValues values = run::read_config_file(file);
    DynaInsRemover::Config config;
    values.apply(config);
    DynaInsRemover::Config::visit(config, [](const auto& parameter) {
      using Value = std::remove_reference_t<decltype(parameter.value)>;
      if constexpr (kIsBounded<Value>) {
        require(parameter.bounds.contain(static_cast<double>(parameter.value)),
                "what a config file sets is within bounds");
      }
    });
  });
}

void read_session_file(Bytes bytes) {
  expect_value_or<IoError>(file_of("day.session", bytes), [&](const fs::path& path) {
    const SessionInfo session = read_session(path);
    for (const auto& [tile, block] : session.tiles) {
      require(read_block(path, block).size() == block.size, "a block has its size");
    }
  });
}

std::string session_file() {
  std::ostringstream stream;
  SessionFileWriter writer(stream);
  SessionInfo session;
  session.name = "day";
  session.scans = 1;
  session.tiles[{0, -1}] = writer.add({"twenty-four bytes, so..", 24});
  writer.finish(session);
  return stream.str();
}

}  // namespace

std::vector<Target> reader_targets() {
  const std::string ply_point = test::bytes_of<float>({1.0F, -2.0F, 3.0F}) + "\x7F";
  const std::string ply_list = std::string("\1\0\0\0\0", 5);
  const std::string pcd_point =
      test::bytes_of<float>({1.0F, 2.0F, 3.0F, 0.5F}) + std::string("\xFB\0\0\0", 4);
  // Twice 20 bytes column by column, in LZF: a literal run of 32 bytes and one of 8.
  const std::string columns(40, '\0');
  const std::string lzf = '\x1F' + columns.substr(0, 32) + '\x07' + columns.substr(0, 8);
  const std::string sizes = std::string("\x2A\0\0\0\x28\0\0\0", 8);
  const std::string extra = test::extra_bytes("ring", 3) + test::extra_bytes("label", 5);
  const std::string xyzi = test::bytes_of<float>({1.0F, 2.0F, 3.0F, 0.5F}),
                    session = session_file();
  return {
      {"scan",
       read_scan_file,
       {"", xyzi, test::bytes_of<float>({1.0F, 2.0F, 3.0F}),
        test::bytes_of<float>({1e30F, -40.0F, 0.0F, 0.0F, NAN, INFINITY, 0.0F, 1.0F}) + "cut"}},
      {"labels", read_labels_file, {"", std::string("\xFB\0\1\0", 4), "abc"}},
      {"calib",
       read_calib,
       {"P0: 1 2 3\nTr: " + pose_row(0.25), "Tr: 0 -1 0 0 0 0 -1 0 1 0 0 -0.08"}},
      {"times", read_times, {"0.0\n1.036e-01\n2.0\n", "-1\n+5\r\n\n", "1\n1\n", "inf"}},
      {"ply",
       read_point_file<kPly>,
       {ply("ascii", "1 5\n1 2 3 4\n-1e3 nan 0.5 255\n"),
        ply("binary_little_endian", ply_list + ply_point + ply_point),
        ply("binary_big_endian", ply_list + ply_point + ply_point)}},
      {"pcd",
       read_point_file<kPcd>,
       {pcd("ascii", "1 2 3 0.5 251\nnan -inf 0 1 9\n"), pcd("binary", pcd_point + pcd_point),
        pcd("binary_compressed", sizes + lzf)}},
      {"las",
       read_point_file<kLas>,
       {test::las_file({2, 1, "", 28, 2}, std::string(56, '\1')),
        test::las_file({4, 6, extra, 36, 1}, std::string(36, '\0'))}},
      {"npy",
       read_point_file<kNpy>,
       {test::npy_file("'<f4'", "(1, 4)", xyzi), test::npy_file("'>f4'", "(1, 4)", xyzi, "True"),
        test::npy_file("[('x', '<f4'), ('y', '<f4'), ('z', '<f4'), ('label', '|u1', (4,))]", "(1,)",
                       xyzi)}},
      {"xyz",
       read_point_file<kXyz>,
       {"x,y,z,label\n1,2,3,9\n", "1 2 3\n-1e3 nan 0.5\n", "# x y z t\n\n1;2;3;4"}},
      {"config",
       read_config,
       {"# comment\nwindow = 4\ntau-s=0.6 # more\nuse_belief = off\n", "max-range = 1e3\n",
        "window = 4\nwindow = 5\n", "tau-s =\n", "no-such = 1\n"}},
      {"session",
       read_session_file,
       {session, session.substr(0, session.size() - 9), "DYNSESS5", ""}},
  };
}

}  // namespace dynains::fuzz
