// Reads scans and writes the final labels of their points, one byte each. It is built with and
// without fused multiply-add and AVX2, and the tests compare the outputs. Exits with 77 if the
// processor lacks a feature of the build.
#include <cstdint>
#include <fstream>
#include <vector>

#include "dynains/compiled_remover.hpp"

int main(int count, char** arguments) {
#if defined(__FMA__)
  if (!__builtin_cpu_supports("fma")) return 77;
#endif
#if defined(__AVX2__)
  if (!__builtin_cpu_supports("avx2")) return 77;
#endif
  if (count != 3) return 2;
  std::ifstream scans(arguments[1], std::ios::binary);
  std::ofstream labels(arguments[2], std::ios::binary);
  const auto write = [&](const dynains::ScanVerdict& verdict) {
    labels.write(reinterpret_cast<const char*>(verdict.labels.data()),
                 static_cast<std::streamsize>(verdict.labels.size()));
  };
  dynains::DynaInsRemover remover(dynains::DynaInsRemover::Config::paper());
  std::uint64_t points = 0;
  Eigen::Isometry3d T_world_sensor = Eigen::Isometry3d::Identity();
  std::vector<float> xyz;
  while (scans.read(reinterpret_cast<char*>(&points), sizeof(points))) {
    scans.read(reinterpret_cast<char*>(T_world_sensor.matrix().data()), 16 * sizeof(double));
    xyz.resize(3 * points);
    scans.read(reinterpret_cast<char*>(xyz.data()),
               static_cast<std::streamsize>(xyz.size() * sizeof(float)));
    if (!scans) return 2;
    const auto frame = remover.push(dynains::RawPoints{xyz.data(), points}, T_world_sensor);
    if (frame.finished) write(*frame.finished);
  }
  remover.flush(write);
  return labels ? 0 : 2;
}
