#include "dynains/recording/ground.hpp"

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "support/catch.hpp"

using namespace dynains;

namespace {

/// Height of a point (m, world frame) above the ground, if it is known.
std::optional<double> rise_of(RecordingGround& ground, const std::array<float, 3>& at) {
  LocatedPoints located;
  located.add(0, at);
  located.locate(Pose::Identity());
  std::optional<double> found;
  ground.for_each_rise(located, [&](std::size_t, const WorldCell&, double rise) { found = rise; });
  return found;
}

}  // namespace

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
    const auto rise = rise_of(ground, {1000.2F, -1999.8F, 498.5F});
    CHECK(rise.has_value() == (count == 20));
    if (rise) CHECK(*rise == Approx(0.5).margin(1e-4));
    CHECK_FALSE(rise_of(ground, {1000.5F, -1999.8F, 498.5F}));
    CHECK_FALSE(rise_of(ground, {1100.2F, -1999.8F, 498.5F}));
  }
}
