#include "dynains/recording/ground.hpp"

#include <cstddef>
#include <optional>
#include <vector>

#include "support/catch.hpp"

using namespace dynains;

TEST_CASE("the ground of a cell is the mean of its ground points, if there are enough") {
  for (const int count : {19, 20}) {
    MemoryStore store;
    RecordingGround ground(store, 0);
    Pose T_world_sensor = Pose::Identity();
    T_world_sensor.translation() = Eigen::Vector3d(1000.0, -2000.0, 500.0);
    for (int i = 0; i < count; ++i) {
      PointBuffer points;
      points.push_back(0.1F, 0.1F, i % 2 == 0 ? -2.02F : -1.98F);
      points.push_back(0.1F, 0.1F, 3.0F);
      const std::vector<PointLabel> labels = {PointLabel::kGround, PointLabel::kStatic};
      ground.add(points, labels, T_world_sensor);
    }
    const Eigen::Vector3d above(1000.2, -1999.8, 498.5);
    const std::optional<double> rise = ground.rise(above);
    REQUIRE(rise.has_value() == (count == 20));
    CHECK(ground.is_level(above) == (count == 20));
    if (rise) CHECK(*rise == Approx(0.5).margin(1e-4));
    CHECK_FALSE(ground.rise({1000.5, -1999.8, 498.5}));
    CHECK_FALSE(ground.rise({1100.2, -1999.8, 498.5}));
  }
}

TEST_CASE("ground is level if none within two cells is lower, across tiles and their storage") {
  for (const int cells : {1, 2, 3}) {
    for (const bool is_tested_first : {false, true}) {
      CAPTURE(cells, is_tested_first);
      MemoryStore store;
      RecordingGround ground(store, 0);
      const float border = static_cast<float>(kTileEdge);
      const float tested = border + (is_tested_first ? -0.2F : 0.2F);
      const float low = tested + (is_tested_first ? 0.4F : -0.4F) * static_cast<float>(cells);
      PointBuffer points;
      for (int i = 0; i < 20; ++i) {
        points.push_back(low, 0.1F, -2.0F);
        points.push_back(tested, 0.1F, -1.0F);
      }
      const std::vector<PointLabel> labels(points.size(), PointLabel::kGround);
      ground.add(points, labels, Pose::Identity());
      ground.free_far(Eigen::Vector3d(1000.0, 0.0, 0.0));
      const Eigen::Vector3d above(static_cast<double>(tested), 0.1, -0.9);
      CHECK(ground.rise(above).value() == Approx(0.1).margin(1e-4));
      CHECK(ground.is_level(above) == (cells > 2));
    }
  }
}
