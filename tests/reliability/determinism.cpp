// Prints a fingerprint of all answers of the remover on a small scene, for each preset. Writes the
// final labels to the file that is given, one byte each.
#include "io/fingerprint.hpp"
#include "support/runs.hpp"

namespace {

using namespace dynains;
using namespace dynains::test;

/// A rough floor and boxes. Every second box moves. Coordinates and poses are exact in binary, so
/// that only the remover computes with rounding.
std::vector<Scan> scene() {
  std::vector<Scan> scans;
  Random random(5);
  const auto noise = [&random] { return 0x1p-6F * static_cast<float>(random.index(8)); };
  for (int i = 0; i < 12; ++i) {
    Scan scan{sensor_at(0.5 * i, 0.25 * i), 0.125 * i, {}, {}};
    scan.T_world_sensor.linear() << 0.6, -0.8, 0.0, 0.8, 0.6, 0.0, 0.0, 0.0, 1.0;
    for (int x = -80; x < 80; ++x) {
      for (int y = -80; y < 80; ++y) {
        // Separate statements: the order in which function arguments are evaluated is unspecified.
        const float ahead = 0.375F * static_cast<float>(x) + noise();
        const float left = 0.375F * static_cast<float>(y) + noise();
        scan.points.emplace_back(ahead, left, -1.75F + noise());
      }
    }
    for (int object = 0; object < 6; ++object) {
      const float left = 6.0F + 5.0F * static_cast<float>(object);
      const float ahead = object % 2 == 0 ? 12.0F - 1.5F * static_cast<float>(i) : -6.0F;
      for (int point = 0; point < 400; ++point) {
        const auto along = 0.125F * static_cast<float>(random.index(16)) + noise();
        const auto across = 0.125F * static_cast<float>(random.index(8)) + noise();
        const auto up = 0.125F * static_cast<float>(random.index(16)) + noise();
        scan.points.emplace_back(ahead + along, left + across, -1.25F + up);
      }
    }
    scans.push_back(scan);
  }
  return scans;
}

}  // namespace

int main(int count, char** arguments) {
  std::ofstream labels(count > 1 ? arguments[1] : "/dev/null", std::ios::binary);
  for (const auto& config : {DynaInsRemover::Config::paper(), DynaInsRemover::Config()}) {
    DynaInsRemover remover(config);
    const std::vector<Scan> scans = scene();
    const Run result = run(remover, scans);
    Fingerprint fingerprint;
    const auto add_bytes = [&](const auto& values) {
      fingerprint.add(values.data(), values.size() * sizeof(values[0]));
    };
    for (const std::vector<Verdict>* verdicts : {&result.newest, &result.final}) {
      for (const Verdict& verdict : *verdicts) {
        add_bytes(verdict.labels);
        add_bytes(verdict.instances);
        add_bytes(verdict.beliefs);
      }
    }
    for (const Verdict& verdict : result.final) {
      for (const PointLabel label : verdict.labels) labels.put(static_cast<char>(label));
    }
    remover.map().for_each([&](const Eigen::Vector3d& point) {
      for (int axis = 0; axis < 3; ++axis) fingerprint.add(point[axis]);
    });
    const Share moving = share(scans, result.final, PointLabel::kDynamic);
    std::printf("%016llx %zu moving points, map of %zu\n",
                static_cast<unsigned long long>(fingerprint.value()), moving.labelled,
                remover.map().size());
  }
  return labels ? 0 : 1;
}
