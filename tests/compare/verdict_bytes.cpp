// Writes all answers of the remover on a recording, as bytes to compare: for each final verdict the
// labels, instances, beliefs and causes, then the points of the map. Prints the median time of a
// push in milliseconds. Uses only interfaces that exist in all revisions.
//
//   verdict_bytes SEQUENCE default|paper OUT [SCANS]
//
// SEQUENCE has the layout of KITTI: velodyne/NNNNNN.bin, poses.txt, calib.txt with a row "Tr:".
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <dynains/dyna_ins_remover.hpp>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace {

Eigen::Isometry3d read_pose(std::istream& row) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  for (int i = 0; i < 12; ++i) row >> T.matrix()(i / 4, i % 4);
  return T;
}

Eigen::Isometry3d read_calibration(const std::string& path) {
  std::ifstream file(path);
  for (std::string key; file >> key;) {
    if (key == "Tr:") return read_pose(file);
  }
  return Eigen::Isometry3d::Identity();
}

std::vector<float> read_scan(const std::string& folder, std::size_t number) {
  char name[32];
  std::snprintf(name, sizeof(name), "/velodyne/%06zu.bin", number);
  std::ifstream file(folder + name, std::ios::binary | std::ios::ate);
  if (!file) return {};
  std::vector<float> xyzi(static_cast<std::size_t>(file.tellg()) / sizeof(float));
  file.seekg(0);
  file.read(reinterpret_cast<char*>(xyzi.data()),
            static_cast<std::streamsize>(xyzi.size() * sizeof(float)));
  return xyzi;
}

template <class Values>
void write(std::ostream& out, const Values& values) {
  out.write(reinterpret_cast<const char*>(values.data()),
            static_cast<std::streamsize>(values.size() * sizeof(values[0])));
}

}  // namespace

int main(int count, char** arguments) {
  if (count < 4) return 2;
  const std::string folder = arguments[1];
  const bool paper = std::string(arguments[2]) == "paper";
  std::ofstream out(arguments[3], std::ios::binary);
  const std::size_t most = count > 4 ? std::strtoul(arguments[4], nullptr, 10) : 100000;

  using Remover = dynains::DynaInsRemover;
  Remover remover(paper ? Remover::Config::paper() : Remover::Config());
  const auto write_verdict = [&](const dynains::ScanVerdict& verdict) {
    write(out, verdict.labels);
    write(out, verdict.instances);
    write(out, verdict.beliefs);
    write(out, verdict.causes);
  };
  const Eigen::Isometry3d Tr = read_calibration(folder + "/calib.txt");
  std::ifstream poses(folder + "/poses.txt");
  std::vector<double> milliseconds;
  std::string row;
  for (std::size_t i = 0; i < most && std::getline(poses, row); ++i) {
    std::istringstream numbers(row);
    const Eigen::Isometry3d T_world_sensor = Tr.inverse() * read_pose(numbers) * Tr;
    const std::vector<float> xyzi = read_scan(folder, i);
    const dynains::RawPoints<float> cloud{xyzi.data(), xyzi.size() / 4, 4};
    if (i == 0) remover.reserve_like(cloud);
    const auto frame = remover.push(cloud, T_world_sensor, 0.1 * static_cast<double>(i));
    milliseconds.push_back(frame.times.total());
    write_verdict(frame.newest);
    if (frame.finished) write_verdict(*frame.finished);
  }
  remover.flush(write_verdict);
  remover.map().for_each([&](const Eigen::Vector3d& point) { write(out, point); });
  if (milliseconds.empty() || !out.flush()) return 1;
  std::sort(milliseconds.begin(), milliseconds.end());
  std::printf("%.3f\n", milliseconds[milliseconds.size() / 2]);
  return 0;
}
