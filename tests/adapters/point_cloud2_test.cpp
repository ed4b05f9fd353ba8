#include "dynains/adapters/point_cloud2.hpp"

#include "adapters/message.hpp"
#include "dynains/compiled_remover.hpp"
#include "support/catch.hpp"
#include "support/runs.hpp"
#include "support/scene.hpp"

namespace dynains::test {
namespace {

const std::vector<Eigen::Vector3f> kPoints = {{1, 2, 3},          {-4.5F, 1e-3F, 6}, {7, -0.0F, 80},
                                              {1.5F, 2.5F, 3.5F}, {10, 11, 12},      {0, 0, 0}};

std::vector<Eigen::Vector3f> points_of(const PointCloud2View& view) {
  std::vector<Eigen::Vector3f> points;
  for (std::size_t i = 0; i < view.size(); ++i) points.push_back(view.point(i));
  return points;
}

TEST_CASE("a message gives its points, in any layout") {
  Layout layout;
  SECTION("as most drivers lay it out") {}
  SECTION("odd offsets, not aligned, another order") {
    layout.z = 3;
    layout.x = 9;
    layout.y = 17;
    layout.point_step = 21;
  }
  SECTION("doubles") {
    layout.type = kFloat64;
    layout.y = 8;
    layout.z = 16;
    layout.point_step = 26;
  }
  SECTION("the other byte order") { layout.swapped = true; }
  SECTION("doubles in the other byte order") {
    layout.swapped = true;
    layout.type = kFloat64;
    layout.x = 2;
    layout.y = 10;
    layout.z = 18;
    layout.point_step = 30;
  }
  SECTION("rows") { layout.height = 2; }
  SECTION("padded rows") {
    layout.height = 3;
    layout.padding = 5;
  }
  SECTION("a point is its coordinates and nothing else") { layout.point_step = 12; }
  CHECK(points_of(PointCloud2View(make_message<LookAlike>(kPoints, layout))) == kPoints);
}

TEST_CASE("a message may mix floats and doubles") {
  LookAlike message = make_message<LookAlike>({{1, 2, 0}}, {0, 4, 8, kFloat32, 16});
  message.fields[0].datatype = kFloat64;  // z
  const double z = -3.25;
  std::memcpy(&message.data[8], &z, sizeof z);
  CHECK(PointCloud2View(message).point(0) == Eigen::Vector3f(1, 2, -3.25F));
}

TEST_CASE("values that drivers often leave out are not needed") {
  SECTION("row_step of a single row") {
    LookAlike message = make_message<LookAlike>(kPoints);
    message.row_step = 0;
    CHECK(points_of(PointCloud2View(message)) == kPoints);
  }
  SECTION("the padding of the last row") {
    LookAlike message = make_message<LookAlike>(kPoints, {0, 4, 8, kFloat32, 16, 2, 7});
    message.data.resize(message.data.size() - 7);
    CHECK(points_of(PointCloud2View(message)) == kPoints);
  }
  SECTION("everything, in a message without points") {
    CHECK(PointCloud2View(LookAlike()).size() == 0);
    LookAlike message;
    message.height = 64;  // an organized scan without columns
    CHECK(PointCloud2View(message).size() == 0);
  }
}

std::string refusal(const LookAlike& message) {
  try {
    PointCloud2View view(message);
  } catch (const CloudError& error) {
    return error.what();
  }
  return "accepted";
}

TEST_CASE("a message that cannot be read is refused with the reason") {
  LookAlike message = make_message<LookAlike>(kPoints);
  SECTION("a coordinate is missing") {
    message.fields[3].name = "Y";
    CHECK(refusal(message) == "PointCloud2: no field 'y', only: z, ring, x, Y");
  }
  SECTION("a coordinate is an integer") {
    message.fields[2].datatype = kUint16;
    CHECK(refusal(message) ==
          "PointCloud2: field 'x' has datatype 4, expected 7 (FLOAT32) or 8 (FLOAT64)");
  }
  SECTION("a coordinate lies over the end of the point by one byte") {
    message.fields[0].offset = 13;
    CHECK(refusal(message) == "PointCloud2: field 'z' ends at byte 17 of a point of 16 bytes");
    message.fields[0].offset = 12;
    CHECK(refusal(message) == "accepted");
  }
  SECTION("offsets whose sum with the size has more than 32 bits") {
    message.fields[0].offset = 0xffffffff;
    CHECK_THAT(refusal(message), ContainsSubstring("ends at byte 4294967299"));
  }
  SECTION("one byte of data is missing") {
    message.data.pop_back();
    CHECK(refusal(message) == "PointCloud2: data has 95 bytes, 6 x 1 points of 16 bytes need more");
  }
  SECTION("numbers that no data can back") {
    message.height = 0xffffffff;
    message.width = 1;
    message.row_step = 0xffffffff;
    message.point_step = 0xffffffff;
    CHECK_THAT(refusal(message), ContainsSubstring("data has 96 bytes"));
    message.width = 2;
    CHECK_THAT(refusal(message), ContainsSubstring("must fit 32 bits"));
  }
  SECTION("rows that overlap") {
    message.height = 2;
    message.width = 3;
    message.row_step = 47;
    CHECK(refusal(message) ==
          "PointCloud2: row_step = 47 must be at least width * point_step = 48");
  }
}

TEST_CASE("labels of messages are those of the points in them") {
  const std::vector<Scan> scans = drive(oncoming(), 6, 5.0);
  const std::vector<Verdict> expected = run_paper(scans).final;
  CHECK(share(scans, expected, PointLabel::kDynamic).labelled > 0);

  DynaInsRemover remover(DynaInsRemover::Config::paper());
  std::vector<Verdict> found;
  for (const Scan& scan : scans) {
    const auto message = make_message<LookAlike>(scan.points, {2, 6, 10, kFloat32, 19});
    const auto frame = remover.push(PointCloud2View(message), scan.T_world_sensor, scan.time);
    if (frame.finished) found.emplace_back(*frame.finished);
  }
  remover.flush([&](const ScanVerdict& verdict) { found.emplace_back(verdict); });
  CHECK((found == expected));
}

TEST_CASE("the static points of a message keep every byte, and the others are apart") {
  const std::vector<PointLabel> labels = {PointLabel::kDynamic, PointLabel::kStatic,
                                          PointLabel::kGround,  PointLabel::kOutOfRange,
                                          PointLabel::kInvalid, PointLabel::kStatic};
  LookAlike message = make_message<LookAlike>(kPoints, {0, 4, 8, kFloat32, 16, 2, 3});
  message.header.frame_id = "velodyne";
  for (std::size_t i = 0; i < 6; ++i) {  // the four bytes after the coordinates
    message.data[(i / 3) * message.row_step + (i % 3) * 16 + 15] = static_cast<std::uint8_t>(i);
  }
  const LookAlike kept = static_points(message, labels);
  CHECK(points_of(PointCloud2View(kept)) ==
        std::vector<Eigen::Vector3f>{kPoints[1], kPoints[2], kPoints[5]});
  CHECK(kept.data.size() == 48);
  CHECK(kept.data[15] == 1);
  CHECK(kept.data[31] == 2);
  CHECK(kept.data[47] == 5);
  CHECK(kept.header.frame_id == "velodyne");
  CHECK(kept.height == 1);
  CHECK(kept.width == 3);
  CHECK(kept.row_step == 48);
  const LookAlike moving = dynamic_points(message, labels);
  CHECK(points_of(PointCloud2View(moving)) == std::vector<Eigen::Vector3f>{kPoints[0]});
  CHECK(moving.header.frame_id == "velodyne");
  CHECK(moving.width == 1);
  CHECK_THROWS_AS(static_points(message, Span<const PointLabel>(labels.data(), 5)),
                  std::invalid_argument);
}

TEST_CASE("the time of a message has its nanoseconds") {
  LookAlike message;
  message.header.stamp.sec = 12;
  message.header.stamp.nanosec = 345000000;
  CHECK(message_time(message) == 12.345);
}

}  // namespace
}  // namespace dynains::test
