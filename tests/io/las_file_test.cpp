// Maps in LAS files, and coordinate reference systems.

#include "dynains/io/point_file.hpp"
#include "files.hpp"
#include "support/catch.hpp"

namespace dynains {

using namespace test;

TEST_CASE("LAS: written points are read back to half a millimetre, in coordinates of UTM") {
  const TemporaryFolder folder;
  LasOptions options;
  options.offset = {691000.0, 5334000.0, 500.0};
  options.wkt = "PROJCS[\"a name\"]";
  PointFileWriter writer(folder / "map.las", {}, Pose::Identity(), options);
  FilePoint point;
  point.position = {691234.5678, 5334567.8912, 499.0004};
  point.intensity = 65535;
  point.is_ground = true;
  point.scan_time = 1571234567.25;
  point.belief = 0.75F;
  point.cause = 10;
  point.instance = 70000;
  writer.add(point);
  point.position = {690000.0, 5336000.0, 700.0};
  point.intensity = 7;
  writer.add(point);
  CHECK(writer.size() == 2);
  CHECK_FALSE(std::filesystem::exists(folder / "map.las"));
  writer.commit();

  read_point_file_header(folder / "map.las");
  const PointFile points = read_points(folder / "map.las");
  REQUIRE(points.positions.size() == 2);
  CHECK((points.positions[0] - Eigen::Vector3d(691234.5678, 5334567.8912, 499.0004))
            .cwiseAbs()
            .maxCoeff() <= 0.0005000001);
  CHECK(points.positions[1] == point.position);
  CHECK(points.intensity == std::vector<float>{65535.0F, 7.0F});
  CHECK(points.time == std::vector<double>{1571234567.25, 1571234567.25});
  const std::string bytes = read_text(folder / "map.las");
  CHECK_THAT(bytes, ContainsSubstring("LASF_Projection") &&
                        ContainsSubstring(options.wkt + std::string(1, '\0')));
}

TEST_CASE("LAS: points that the file cannot hold are refused, and no file appears") {
  const TemporaryFolder folder;
  {
    PointFileWriter writer(folder / "map.las");
    FilePoint point;
    writer.add(point);
    for (const double x : {2.2e6, -2.2e6, std::numeric_limits<double>::quiet_NaN()}) {
      point.position.x() = x;
      CHECK_THAT(message_of<IoError>([&] { writer.add(point); }),
                 StartsWith((folder / "map.las").string()) && ContainsSubstring("2147483"));
    }
  }
  CHECK(count_entries(folder.path()) == 0);
  LasOptions options;
  options.wkt.assign(65535, 'x');
  CHECK_THROWS_AS(PointFileWriter(folder / "map.las", {}, Pose::Identity(), options), IoError);
  PointFileWriter(folder / "empty.las").commit();
  CHECK(read_points(folder / "empty.las").positions.empty());
}

}  // namespace dynains
