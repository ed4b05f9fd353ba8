// Program of a consumer that takes every compiled component, built with many sets of flags. It
// prints one checksum for each result that crosses the border of a component. Its argument is a
// recording.
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <vector>

#include "dynains/compiled_remover.hpp"
#include "dynains/evaluation/evaluate.hpp"
#include "dynains/io/kitti.hpp"
#include "dynains/io/recording.hpp"
#include "dynains/io/trajectory.hpp"

namespace {

class Checksum {
 public:
  template <class T>
  void add(const T* values, std::size_t count) {
    const auto* bytes = reinterpret_cast<const unsigned char*>(values);
    for (std::size_t i = 0; i < count * sizeof(T); ++i) sum_ = (sum_ ^ bytes[i]) * 1099511628211U;
  }
  void add(double value) { add(&value, 1); }
  template <class Numbers>
  void add_all(const Numbers& numbers) {
    add(numbers.data(), numbers.size());
  }
  void add(const Eigen::Isometry3d& T) { add(T.matrix().data(), 16); }
  void print(const char* name) const {
    std::printf("%s %016llx\n", name, static_cast<unsigned long long>(sum_));
  }

 private:
  std::uint64_t sum_ = 14695981039346656037U;
};

struct Scan {
  double time = 0.0;
  Eigen::Isometry3d T_world_sensor = Eigen::Isometry3d::Identity();  // alignment of the consumer
  std::vector<float> xyzi;
  std::vector<std::uint32_t> truth;
};

std::vector<std::unique_ptr<Scan>> read(const dynains::Recording& recording) {
  std::vector<std::unique_ptr<Scan>> scans;
  for (std::size_t i = 0; i < recording.size(); ++i) {
    scans.push_back(std::make_unique<Scan>());
    Scan& scan = *scans.back();
    scan.time = recording.time(i);
    scan.T_world_sensor = recording.T_world_sensor(i);
    scan.xyzi = recording.read_scan(i).xyzi;
    scan.truth = recording.read_labels(i);
  }
  return scans;
}

void add(const dynains::ScanVerdict& verdict, Checksum& sum) {
  sum.add(static_cast<double>(verdict.scan));
  sum.add(verdict.time);
  sum.add(verdict.T_world_sensor);
  sum.add_all(verdict.labels);
  sum.add_all(verdict.instances);
  sum.add_all(verdict.beliefs);
  sum.add_all(verdict.causes);
}

std::vector<std::vector<std::uint8_t>> remove_movers(
    const std::vector<std::unique_ptr<Scan>>& scans) {
  Checksum sum;
  std::vector<std::vector<std::uint8_t>> in_map;
  const auto finish = [&](const dynains::ScanVerdict& verdict) {
    add(verdict, sum);
    in_map.emplace_back();
    for (const dynains::PointLabel label : verdict.labels) {
      in_map.back().push_back(dynains::is_static(label) ? 1 : 0);
    }
  };
  dynains::DynaInsRemover remover;
  std::vector<dynains::PoseResidual> residuals;
  for (const std::unique_ptr<Scan>& scan : scans) {
    const dynains::RawPoints cloud{scan->xyzi.data(), scan->xyzi.size() / 4, 4};
    const auto frame = std::make_unique<dynains::FrameResult>(
        remover.push(cloud, scan->T_world_sensor, scan->time));
    add(frame->newest(), sum);
    if (frame->finished) finish(*frame->finished);
    if (frame->pose_residual) residuals.push_back(*frame->pose_residual);
  }
  remover.flush(finish);
  for (const dynains::PoseResidual& residual : residuals) {
    sum.add(residual.translation);
    sum.add(residual.rotation);
    sum.add(residual.T_previous_newest);
  }
  sum.print("verdicts");

  Checksum map;
  remover.map().for_each([&](const auto& point) { map.add(point.data(), 3); });
  map.print("map");
  return in_map;
}

void read_back(const std::vector<std::unique_ptr<Scan>>& scans, const std::filesystem::path& folder,
               Checksum& sum) {
  const dynains::Recording recording(folder);
  sum.add(static_cast<double>(recording.size()));
  for (std::size_t i = 0; i < recording.size(); ++i) {
    sum.add(recording.time(i));
    sum.add(recording.T_world_sensor(i));
    sum.add_all(recording.read_scan(i).xyzi);
    sum.add_all(recording.read_labels(i));
    if (const auto pose = recording.pose_after(i, 0.03)) sum.add(*pose);
    dynains::PoseConvention turned;
    turned.T_body_sensor.translation().x() = 0.5;
    if (const auto pose = recording.pose_under(turned, i)) sum.add(*pose);
  }
  sum.add(dynains::interpolate(scans[0]->T_world_sensor, scans[5]->T_world_sensor, 0.3));
}

void write_and_read(const std::vector<std::unique_ptr<Scan>>& scans,
                    const std::filesystem::path& recording) {
  const std::filesystem::path folder = "flags_recording";
  std::filesystem::remove_all(folder);
  std::filesystem::copy(recording, folder, std::filesystem::copy_options::recursive);
  Checksum sum;
  read_back(scans, folder, sum);
  std::vector<dynains::Pose> poses;
  for (const std::unique_ptr<Scan>& scan : scans) poses.push_back(scan->T_world_sensor);
  dynains::write_poses(folder / "poses.txt", poses);
  std::filesystem::remove(folder / "calib.txt");
  read_back(scans, folder, sum);
  sum.print("io");
}

void score(const std::vector<std::unique_ptr<Scan>>& scans,
           const std::vector<std::vector<std::uint8_t>>& in_map) {
  const auto source = [&](std::size_t i, dynains::evaluation::LabelledScan& scan) {
    if (i >= scans.size()) return false;
    scan.xyz = scans[i]->xyzi.data();
    scan.stride = 4;
    scan.T_world_sensor = scans[i]->T_world_sensor;
    scan.truth = scans[i]->truth;
    scan.in_map = in_map[i];
    return true;
  };
  Checksum sum;
  const std::vector<Eigen::Vector3d> points = {{1.0, 2.0, 0.5}, {3.0, 4.0, 0.25}};
  for (const auto& row : dynains::evaluation::evaluate(source, {"run"}, {{"map", points}}).rows) {
    sum.add(row.voxels.kept());
    sum.add(row.voxels.removed());
    sum.add(row.points.kept());
    sum.add(row.points.removed());
  }
  sum.print("evaluation");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 1;
#if defined(__AVX512F__)
  if (!__builtin_cpu_supports("avx512f")) return 77;
#elif defined(__AVX2__)
  if (!__builtin_cpu_supports("avx2")) return 77;
#endif
  const auto scans = read(dynains::Recording(argv[1]));
  write_and_read(scans, argv[1]);
  const auto in_map = remove_movers(scans);
  score(scans, in_map);
  return 0;
}
