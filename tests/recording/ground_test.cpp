#include "dynains/recording/ground.hpp"

#include <vector>

#include "support/catch.hpp"

using namespace dynains;

TEST_CASE("ground is level if none within two cells is lower, across tiles and their storage") {
  for (const int cells : {1, 2, 3}) {
    for (const bool is_tested_first : {false, true}) {
      CAPTURE(cells, is_tested_first);
      ByteStore store;
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
