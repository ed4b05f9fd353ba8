// A cloud type of your own: CloudTraits gives dynains the number of points and their coordinates.
#include <cstdio>
#include <dynains/compiled_remover.hpp>
#include <vector>

struct Return {
  double range, azimuth, elevation;  // m, rad, rad
  int ring;
};

struct SpinningScan {
  std::vector<Return> returns;
};

template <>
struct dynains::PointCloudTraits<SpinningScan> {
  static std::size_t size(const SpinningScan& scan) { return scan.returns.size(); }
  static Eigen::Vector3f point(const SpinningScan& scan, std::size_t i) {  // m, sensor frame
    const Return& r = scan.returns[i];
    const double horizontal = r.range * std::cos(r.elevation);
    return Eigen::Vector3d(horizontal * std::cos(r.azimuth), horizontal * std::sin(r.azimuth),
                           r.range * std::sin(r.elevation))
        .cast<float>();
  }
};

int main() {
  SpinningScan scan;  // 16 rings on a round wall, one beam without return
  for (int ring = 0; ring < 16; ++ring) {
    for (int i = 0; i < 900; ++i) {
      scan.returns.push_back({12.0, i * M_PI / 450.0, 0.02 * (ring - 4), ring});
    }
  }
  scan.returns[7].range = 0.0;

  dynains::DynaInsRemover remover;
  const dynains::FrameResult frame = remover.push(scan, Eigen::Isometry3d::Identity(), 0.0);

  int count[5] = {};
  for (const dynains::PointLabel label : frame.newest().labels) ++count[static_cast<int>(label)];
  std::printf("invalid %d, out of range %d, ground %d, static %d, dynamic %d\n", count[0], count[1],
              count[2], count[3], count[4]);
  return count[0] == 1 && count[4] == 0 ? 0 : 1;
}
