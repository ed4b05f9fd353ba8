#include "dynains/adapters/point_cloud2.hpp"

#include "adapters/message.hpp"
#include "support/catch.hpp"
#include "support/runs.hpp"

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
  // Offsets of x, y and z, type, bytes of a point, rows, bytes after each row, other byte order.
  for (const Layout& layout : {
           Layout(),                        // as most drivers lay it out
           Layout{9, 17, 3, kFloat32, 21},  // not aligned, another order
           Layout{0, 8, 16, kFloat64, 26}, Layout{0, 4, 8, kFloat32, 16, 1, 0, true},
           Layout{2, 10, 18, kFloat64, 30, 1, 0, true}, Layout{0, 4, 8, kFloat32, 16, 2},
           Layout{0, 4, 8, kFloat32, 16, 3, 5},
           Layout{0, 4, 8, kFloat32, 12},  // coordinates and nothing else
       }) {
    CAPTURE(layout.x, int(layout.type), layout.point_step, layout.height, layout.swapped);
    CHECK(points_of(PointCloud2View(make_message<LookAlike>(kPoints, layout))) == kPoints);
  }
}

TEST_CASE("a message may mix floats and doubles") {
  LookAlike message = make_message<LookAlike>({{1, 2, 0}}, {0, 4, 8, kFloat32, 16});
  message.fields[0].datatype = kFloat64;  // z
  const double z = -3.25;
  std::memcpy(&message.data[8], &z, sizeof z);
  CHECK(PointCloud2View(message).point(0) == Eigen::Vector3f(1, 2, -3.25F));
}

TEST_CASE("values that drivers often leave out are not needed") {
  LookAlike row = make_message<LookAlike>(kPoints);
  row.row_step = 0;  // of a single row
  CHECK(points_of(PointCloud2View(row)) == kPoints);
  LookAlike unpadded = make_message<LookAlike>(kPoints, {0, 4, 8, kFloat32, 16, 2, 7});
  unpadded.data.resize(unpadded.data.size() - 7);  // the last row
  CHECK(points_of(PointCloud2View(unpadded)) == kPoints);
  LookAlike empty;
  CHECK(PointCloud2View(empty).size() == 0);
  empty.height = 64;  // an organized scan without columns
  CHECK(PointCloud2View(empty).size() == 0);
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
  const auto refusal_of = [](auto&& change) {
    LookAlike message = make_message<LookAlike>(kPoints);
    change(message);
    return refusal(message);
  };
  CHECK(refusal_of([](LookAlike& m) { m.fields[3].name = "Y"; }) ==
        "PointCloud2: no field 'y', only: z, ring, x, Y");
  CHECK(refusal_of([](LookAlike& m) { m.fields[2].datatype = kUint16; }) ==
        "PointCloud2: field 'x' has datatype 4, expected 7 (FLOAT32) or 8 (FLOAT64)");
  CHECK(refusal_of([](LookAlike& m) { m.fields[0].offset = 13; }) ==
        "PointCloud2: field 'z' ends at byte 17 of a point of 16 bytes");
  CHECK(refusal_of([](LookAlike& m) { m.fields[0].offset = 12; }) == "accepted");
  // The sum of offset and size has more than 32 bits.
  CHECK_THAT(refusal_of([](LookAlike& m) { m.fields[0].offset = 0xffffffff; }),
             ContainsSubstring("ends at byte 4294967299"));
  CHECK(refusal_of([](LookAlike& m) { m.data.pop_back(); }) ==
        "PointCloud2: data has 95 bytes, 6 x 1 points of 16 bytes need more");
  for (const std::uint32_t width : {1U, 2U}) {  // numbers that no data can back
    CHECK_THAT(refusal_of([&](LookAlike& m) {
                 m.height = m.row_step = m.point_step = 0xffffffff;
                 m.width = width;
               }),
               ContainsSubstring(width == 1 ? "data has 96 bytes" : "must fit 32 bits"));
  }
  CHECK(refusal_of([](LookAlike& m) {  // rows that overlap
          m.height = 2;
          m.width = 3;
          m.row_step = 47;
        }) == "PointCloud2: row_step = 47 must be at least width * point_step = 48");
}

TEST_CASE("labels of messages are those of the points in them") {
  const std::vector<Scan> scans = drive(oncoming(), 6, 5.0);
  const std::vector<Verdict> expected = run_paper(scans).final;
  CHECK(share(scans, expected, PointLabel::kDynamic).labelled > 0);

  DynaInsRemover remover(DynaInsRemover::Config::paper());
  LookAlike message;
  const auto to_message = [&](const std::vector<Eigen::Vector3f>& points) {
    message = make_message<LookAlike>(points, {2, 6, 10, kFloat32, 19});
    return PointCloud2View(message);
  };
  CHECK((run(remover, scans, to_message).final == expected));
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
