// Labels do not depend on the type of the cloud.

#include "support/catch.hpp"
#include "support/points.hpp"
#include "support/runs.hpp"

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
  const auto check = [&](auto&& convert) {
    DynaInsRemover remover(DynaInsRemover::Config::paper());
    CHECK((run(remover, scans, convert).final == expected));
  };
  check([](const Points& points) {
    std::vector<Eigen::Vector3d> cloud;
    for (const auto& p : points) cloud.push_back(p.cast<double>());
    return cloud;
  });
  std::vector<float> floats;
  std::vector<double> doubles;
  check([&](const Points& points) {  // of which the coordinates come last
    floats.assign(1, -99.0F);
    const std::vector<float> values = interleaved<float>(points, 4);
    floats.insert(floats.end(), values.begin(), values.end() - 1);
    floats.shrink_to_fit();  // no memory after the last coordinate
    return RawPoints<float>{floats.data() + 1, points.size(), 4};
  });
  for (const std::size_t stride : {std::size_t{3}, std::size_t{4}, std::size_t{7}}) {
    check([&](const Points& points) {
      floats = interleaved<float>(points, stride);
      return RawPoints{floats.data(), points.size(), stride};
    });
    check([&](const Points& points) {
      doubles = interleaved<double>(points, stride);
      return RawPoints{doubles.data(), points.size(), stride};
    });
  }
  check([&](const Points& points) {
    floats = interleaved<float>(points, 3);
    return RawPoints{floats.data(), points.size()};
  });
  check([](const Points& points) {  // a point per column
    Eigen::Matrix3Xf cloud(3, points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      cloud.col(static_cast<Eigen::Index>(i)) = points[i];
    }
    return cloud;
  });
  check([](const Points& points) {  // a point per row
    Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> cloud(points.size(), 3);
    for (std::size_t i = 0; i < points.size(); ++i) {
      cloud.row(static_cast<Eigen::Index>(i)) = points[i].cast<double>();
    }
    return cloud;
  });
  check([&](const Points& points) {  // memory that somebody else owns
    floats = interleaved<float>(points, 3);
    return Eigen::Map<const Eigen::Matrix3Xf>(floats.data(), 3,
                                              static_cast<Eigen::Index>(points.size()));
  });
  PointBuffer buffer;
  check([&](const Points& points) {
    buffer = buffer_of(points);
    return PointsView(buffer);
  });
  check([](const Points& points) {
    EchoCloud cloud;
    for (const auto& p : points) cloud.echoes.push_back({0, {p.x(), p.y(), p.z()}});
    return cloud;
  });
}

}  // namespace
}  // namespace dynains::test
