#include "dynains/recording/places.hpp"

#include "support/catch.hpp"
#include "support/visibility.hpp"

using namespace dynains;
using test::BeamResult;

namespace {

constexpr std::size_t kBudget = 128'000'000;

using Beam = std::function<BeamResult(const Eigen::Vector3d& position)>;

/// A sensor at rest at the origin, 10 m beside a row of places. Epoch 1 measures them; one
/// reference each second follows, from epoch 2 on.
class Recorder {
 public:
  Recorder() { epochs_.next(sensor, -1.0); }
  /// Measures `count` places in a row along y, from place `first` on, at x = `x` m.
  void measure(int count, int first = 0, float x = 10.1F, PointLabel label = PointLabel::kStatic) {
    measure(1, count, first, x, label);
  }
  /// The first pass judges the points of six places in each epoch, from one on.
  void judge(int epoch, const std::vector<PointLabel>& verdicts) {
    for (const PointLabel verdict : verdicts) measure(epoch++, 6, 0, 10.1F, verdict);
  }
  void observe(BeamResult seen, int times = 1) {
    look_by([seen](const Eigen::Vector3d&) { return seen; }, times);
  }
  void look_by(const Beam& beam, int times = 1) {
    for (int i = 0; i < times; ++i, time_ += step) {
      places.test(
          epochs_.next(sensor, time_), sensor,
          [&](const PointBuffer& points, std::size_t size,
              const Eigen::Vector3d& origin) -> const auto& {
            visibility_ = test::visibility_by(beam, points, size, origin);
            return visibility_;
          });
    }
  }
  std::size_t changed() {
    places.decide();
    std::size_t count = 0;
    for_each_changed([&](const ChangedPlace&) { ++count; });
    return count;
  }
  template <class Visit>
  void for_each_changed(Visit&& visit) const {
    constexpr int kMaxRange = 200;  // cells
    for (int x = 0; x < kMaxRange; ++x) {
      for (int y = -kMaxRange; y < kMaxRange; ++y) {
        const ChangedPlace* const place = places.changed(voxel_key(x, y, 0));
        if (place != nullptr) visit(*place);
      }
    }
  }

  ByteStore store{std::filesystem::temp_directory_path()};
  RecordingPlaces places{store, kBudget};
  double step = 1.0;  // s
  Eigen::Vector3d sensor = Eigen::Vector3d::Zero();

 private:
  void measure(int epoch, int count, int first, float x, PointLabel label) {
    PointBuffer points;
    for (int i = 0; i < count; ++i) {
      points.push_back(x, 0.4F * static_cast<float>(first + i) + 0.1F, 0.1F);
      points.push_back(x + 0.2F, 0.4F * static_cast<float>(first + i) + 0.3F, 0.3F);
    }
    const std::vector<PointLabel> labels(points.size(), label);
    const std::vector<Cause> causes(points.size(), Cause::kUnknown);
    places.add(points, labels, causes, Pose::Identity(), static_cast<std::uint16_t>(epoch));
  }

  Epochs epochs_;
  double time_ = 0.0;  // s
  detail::Visibility visibility_;
};

constexpr int kEnough = RecordingPlace::kFreeObservations;
constexpr int kObject = 6;  // places

/// What beams tell of all places, and how often in a row.
using Observations = std::vector<std::pair<BeamResult, int>>;

/// Number of changed places of an object after these observations.
std::size_t changed_after(const Observations& observations, int places = kObject) {
  Recorder recorder;
  recorder.measure(places);
  for (const auto& [seen, times] : observations) recorder.observe(seen, times);
  return recorder.changed();
}

TEST_CASE("a place that enough observations in a row passed has changed") {
  // However long it stood, and whether it left or came.
  CHECK(changed_after({{BeamResult::kHit, 60}, {BeamResult::kFree, kEnough}}) == 6);
  CHECK(changed_after({{BeamResult::kFree, kEnough}, {BeamResult::kHit, 60}}) == 6);
  CHECK(changed_after({{BeamResult::kHit, 60}, {BeamResult::kFree, kEnough - 1}}) == 0);
}

TEST_CASE("a hit between free observations begins a new row of them") {
  Observations fence, hidden;
  for (int i = 0; i < 20; ++i) {
    fence.insert(fence.end(), {{BeamResult::kFree, kEnough - 1}, {BeamResult::kHit, 1}});
  }
  CHECK(changed_after(fence) == 0);
  for (int i = 0; i < kEnough; ++i) {
    hidden.insert(hidden.end(), {{BeamResult::kFree, 1}, {BeamResult::kUnknown, 1}});
  }
  CHECK(changed_after(hidden) == 6);
}

TEST_CASE("references near each other in time and place are one observation") {
  Recorder repeated;
  repeated.measure(kObject);
  repeated.step = 0.05;
  repeated.observe(BeamResult::kFree, 20);  // 0.95 s from first to last
  CHECK(repeated.changed() == 0);

  Recorder moving;
  moving.measure(kObject);
  moving.step = 0.05;
  moving.sensor.y() = -4.5;
  for (int i = 0; i < 4; ++i) {
    moving.observe(BeamResult::kFree);
    moving.sensor.y() += Epochs::kWay;
  }
  CHECK(moving.changed() == 6);
}

TEST_CASE("an object needs enough places") {
  const Observations leaves = {{BeamResult::kHit, 5}, {BeamResult::kFree, 10}};
  CHECK(changed_after(leaves, kObject - 1) == 0);
  CHECK(changed_after(leaves, kObject) == kObject);
}

TEST_CASE("a part of something that stays stays") {
  for (const int more : {1, 2}) {  // than places that leave
    Recorder recorder;
    recorder.measure(kObject);                 // these leave
    recorder.measure(kObject + 2, -1, 10.5F);  // beside them
    recorder.measure(more, 0, 9.7F);           // and before them
    recorder.observe(BeamResult::kHit, 5);
    recorder.look_by(
        [](const Eigen::Vector3d& at) {
          return at.x() < 10.0 || at.x() > 10.4 ? BeamResult::kHit : BeamResult::kFree;
        },
        10);
    CHECK(recorder.changed() == (more == 1 ? 6U : 0U));  // 9 and 10 places touch 6
  }
}

TEST_CASE("an object across the border of tiles has changed as a whole") {
  Recorder recorder;
  const int border = 1 << kTileShift;  // places
  recorder.measure(6, border - 3);
  recorder.sensor.y() = 25.0;
  recorder.observe(BeamResult::kHit, 5);
  recorder.observe(BeamResult::kFree, 10);
  CHECK(recorder.changed() == 6);
}

constexpr PointLabel kKept = PointLabel::kStatic, kRemoved = PointLabel::kDynamic;

TEST_CASE("what the first pass saw coming has changed, if observations passed its place before") {
  for (const bool was_empty : {false, true}) {
    for (const PointLabel first : {kKept, kRemoved}) {
      Recorder recorder;
      recorder.judge(3, {first, kKept, kKept});
      recorder.observe(was_empty ? BeamResult::kFree : BeamResult::kUnknown);
      recorder.observe(BeamResult::kUnknown);
      recorder.observe(BeamResult::kHit, 20);
      CHECK(recorder.changed() == (was_empty && first == kRemoved ? 6U : 0U));
    }
  }
}

TEST_CASE("what beams pass while others hit it is porous, and stays") {
  for (const bool is_kept_in_between : {false, true}) {
    Recorder recorder;
    recorder.judge(is_kept_in_between ? 4 : 21, {kKept, kKept, kKept});
    recorder.observe(BeamResult::kFree, 8);
    CHECK(recorder.changed() == (is_kept_in_between ? 0U : 6U));
  }
}

TEST_CASE("what came stands since the last observation that passed its place") {
  Recorder recorder;
  recorder.judge(7, {kKept, kKept, kKept});
  recorder.observe(BeamResult::kFree, 5);
  recorder.observe(BeamResult::kHit, 3);
  CHECK(recorder.changed() == 6);
  recorder.for_each_changed([](const ChangedPlace& place) {
    CHECK_FALSE(place.stands_since(6));
    CHECK(place.stands_since(7));
  });
  Recorder left;
  left.judge(1, {kKept, kKept, kKept});
  left.observe(BeamResult::kHit, 3);
  left.observe(BeamResult::kFree, 5);
  CHECK(left.changed() == 6);
  left.for_each_changed([](const ChangedPlace& place) { CHECK_FALSE(place.stands_since(9)); });
}

TEST_CASE(
    "what the first pass saw leaving has changed, if observations passed its place afterwards") {
  for (const BeamResult after : {BeamResult::kFree, BeamResult::kUnknown, BeamResult::kHit}) {
    Recorder recorder;
    recorder.judge(1, {kKept, kKept, kRemoved});
    recorder.observe(BeamResult::kHit, 3);
    recorder.observe(after);
    CHECK(recorder.changed() == (after == BeamResult::kFree ? 6U : 0U));
  }
}

TEST_CASE("ground is level if none within two cells is lower, across tiles and their storage") {
  for (const int cells : {1, 2, 3}) {
    for (const bool is_tested_first : {false, true}) {
      CAPTURE(cells, is_tested_first);
      ByteStore store(std::filesystem::temp_directory_path());
      RecordingPlaces places(store, 0);
      const float border = static_cast<float>(kTileEdge);
      const float tested = border + (is_tested_first ? -0.2F : 0.2F);
      const float low = tested + (is_tested_first ? 0.4F : -0.4F) * static_cast<float>(cells);
      PointBuffer points;
      for (int i = 0; i < 20; ++i) {
        points.push_back(low, 0.1F, -2.0F);
        points.push_back(tested, 0.1F, -1.0F);
      }
      const std::vector<PointLabel> labels(points.size(), PointLabel::kGround);
      const std::vector<Cause> causes(points.size(), Cause::kGround);
      places.add(points, labels, causes, Pose::Identity(), 1);
      places.free_far(Eigen::Vector3d(1000.0, 0.0, 0.0));
      const Eigen::Vector3d above(static_cast<double>(tested), 0.1, -0.9);
      CHECK(places.rise(above).value() == Approx(0.1).margin(1e-4));
      CHECK(places.is_level(above) == (cells > 2));
    }
  }
}

}  // namespace
