// Labels do not depend on the type of the cloud.
#include <Eigen/Core>
#include <vector>

#include "dynains/compiled_remover.hpp"
#include "support/catch.hpp"
#include "support/runs.hpp"
#include "support/scene.hpp"

namespace dynains::test {
namespace {

struct Echo {
  short azimuth;
  double position[3];
};
struct EchoCloud {
  std::vector<Echo> echoes;
};

}  // namespace
}  // namespace dynains::test

template <>
struct dynains::PointCloudTraits<dynains::test::EchoCloud> {
  static std::size_t size(const dynains::test::EchoCloud& cloud) { return cloud.echoes.size(); }
  static Eigen::Vector3f point(const dynains::test::EchoCloud& cloud, std::size_t i) {
    return Eigen::Map<const Eigen::Vector3d>(cloud.echoes[i].position).cast<float>();
  }
};

namespace dynains::test {
namespace {

// Runs over the scans, each converted to another type by `convert`. The converted cloud is a
// variable, so that it outlives the call of push.
template <class Convert>
std::vector<Verdict> verdicts_of(const std::vector<Scan>& scans, Convert&& convert) {
  DynaInsRemover remover(DynaInsRemover::Config::paper());
  std::vector<Verdict> result;
  for (const Scan& scan : scans) {
    const auto cloud = convert(scan.points);
    const FrameResult frame = remover.push(cloud, scan.T_world_sensor, scan.time);
    if (frame.finished) result.emplace_back(*frame.finished);
  }
  remover.flush([&](const ScanVerdict& verdict) { result.emplace_back(verdict); });
  return result;
}

template <class Scalar>
std::vector<Scalar> interleaved(const std::vector<Eigen::Vector3f>& points, std::size_t stride) {
  std::vector<Scalar> values(points.size() * stride, Scalar(-99));
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      values[i * stride + static_cast<std::size_t>(k)] = static_cast<Scalar>(points[i][k]);
    }
  }
  return values;
}

TEST_CASE("labels do not depend on the type of the cloud") {
  using Points = std::vector<Eigen::Vector3f>;
  const std::vector<Scan> scans = drive(oncoming(), 6, 5.0);
  const std::vector<Verdict> expected = run_paper(scans).final;

  SECTION("vectors of Eigen vectors") {
    CHECK((verdicts_of(scans, [](const Points& points) {
             std::vector<Eigen::Vector3d> cloud;
             for (const auto& p : points) cloud.push_back(p.cast<double>());
             return cloud;
           }) == expected));
  }
  SECTION("raw numbers of which the coordinates come last") {
    std::vector<float> floats;
    CHECK((verdicts_of(scans, [&](const Points& points) {
             floats.assign(1, -99.0F);
             const std::vector<float> values = interleaved<float>(points, 4);
             floats.insert(floats.end(), values.begin(), values.end() - 1);
             floats.shrink_to_fit();  // no memory after the last coordinate
             return RawPoints<float>{floats.data() + 1, points.size(), 4};
           }) == expected));
  }
  SECTION("raw numbers with a stride") {
    std::vector<float> floats;
    std::vector<double> doubles;
    for (const std::size_t stride : {std::size_t{3}, std::size_t{4}, std::size_t{7}}) {
      CHECK((verdicts_of(scans, [&](const Points& points) {
               floats = interleaved<float>(points, stride);
               return RawPoints{floats.data(), points.size(), stride};
             }) == expected));
      CHECK((verdicts_of(scans, [&](const Points& points) {
               doubles = interleaved<double>(points, stride);
               return RawPoints{doubles.data(), points.size(), stride};
             }) == expected));
    }
    CHECK((verdicts_of(scans, [&](const Points& points) {
             floats = interleaved<float>(points, 3);
             return RawPoints{floats.data(), points.size()};
           }) == expected));
  }
  SECTION("matrices with a point per column") {
    CHECK((verdicts_of(scans, [](const Points& points) {
             Eigen::Matrix3Xf cloud(3, points.size());
             for (std::size_t i = 0; i < points.size(); ++i) {
               cloud.col(static_cast<Eigen::Index>(i)) = points[i];
             }
             return cloud;
           }) == expected));
  }
  SECTION("matrices with a point per row") {
    CHECK((verdicts_of(scans, [](const Points& points) {
             Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> cloud(points.size(), 3);
             for (std::size_t i = 0; i < points.size(); ++i) {
               cloud.row(static_cast<Eigen::Index>(i)) = points[i].cast<double>();
             }
             return cloud;
           }) == expected));
  }
  SECTION("a map over memory that somebody else owns") {
    std::vector<float> floats;
    CHECK((verdicts_of(scans, [&](const Points& points) {
             floats = interleaved<float>(points, 3);
             return Eigen::Map<const Eigen::Matrix3Xf>(floats.data(), 3,
                                                       static_cast<Eigen::Index>(points.size()));
           }) == expected));
  }
  SECTION("three coordinate arrays") {
    PointBuffer buffer;
    CHECK((verdicts_of(scans, [&](const Points& points) {
             buffer.clear();
             for (const auto& p : points) buffer.push_back(p.x(), p.y(), p.z());
             return PointsView(buffer);
           }) == expected));
  }
  SECTION("a type of one's own") {
    CHECK((verdicts_of(scans, [](const Points& points) {
             EchoCloud cloud;
             for (const auto& p : points) cloud.echoes.push_back({0, {p.x(), p.y(), p.z()}});
             return cloud;
           }) == expected));
  }
}

}  // namespace
}  // namespace dynains::test
