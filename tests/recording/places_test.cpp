#include "dynains/recording/places.hpp"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "support/catch.hpp"
#include "support/visibility.hpp"

using namespace dynains;
using test::BeamResult;

namespace {

constexpr std::size_t kBudget = 128'000'000;

using Beam = std::function<BeamResult(const Eigen::Vector3d& position)>;

/// A sensor at rest at the origin, 10 m beside a row of places; one reference each second.
class Recorder {
 public:
  explicit Recorder(const RecordingPlacesConfig& config = {}) : places(config, store, kBudget) {}

  /// Measures `count` places in a row along y, from place `first` on, at x = `x` m.
  void measure(int count, int first = 0, float x = 10.1F, PointLabel label = PointLabel::kStatic) {
    measure_from(0.0F, count, first, x, label);
  }
  /// Measures `count` places in a row along y, from place `first` on, `x` m in front of a sensor at
  /// x = `sensor_x` m.
  void measure_from(float sensor_x, int count, int first, float x,
                    PointLabel label = PointLabel::kStatic) {
    PointBuffer points;
    for (int i = 0; i < count; ++i) {
      points.push_back(x, 0.4F * static_cast<float>(first + i) + 0.1F, 0.1F);
      points.push_back(x + 0.2F, 0.4F * static_cast<float>(first + i) + 0.3F, 0.3F);
    }
    const std::vector<PointLabel> labels(points.size(), label);
    const std::vector<Cause> causes(points.size(), Cause::kUnknown);
    const Eigen::Vector3d at(static_cast<double>(sensor_x), 0.0, 0.0);
    places.add(points, labels, causes, Pose(Eigen::Translation3d(at)), time_, scan_);
  }
  /// The first pass judges the points of places in each of these scans, 1 s apart, and those of as
  /// many places beside them.
  void judge(std::uint32_t first, const std::vector<PointLabel>& verdicts, int count = 6,
             const std::vector<PointLabel>& beside = {}) {
    for (std::size_t i = 0; i < verdicts.size(); ++i, ++first) {
      judge_places(first, verdicts[i], count, 0);
      if (!beside.empty()) judge_places(first, beside[i], count, count);
    }
  }
  /// The first pass judges the points of `count` places, from place `first` on, in one scan.
  void judge_places(std::uint32_t scan, PointLabel verdict, int count, int first) {
    scan_ = scan;
    time_ = scan;
    measure(count, first, 10.1F, verdict);
    scan_ = 0;
    time_ = 0.0;
  }
  void look(BeamResult seen, int times = 1) {
    look_by([seen](const Eigen::Vector3d&) { return seen; }, times);
  }
  void look_by(const Beam& beam, int times = 1) {
    for (int i = 0; i < times; ++i, time_ += step) {
      ++scan_;
      places.begin_test(scan_, time_, sensor);
      places.test(
          0, [&](const PointBuffer& points, std::size_t size) -> const auto& {
            visibility_ = test::visibility_by(beam, points, size, sensor);
            return visibility_;
          });
    }
  }
  std::size_t changed() {
    places.decide();
    std::size_t count = 0;
    places.for_each([&](const Eigen::Vector3d&, const RecordingPlaces::Place& place) {
      if (place.state == PlaceState::kChanged) ++count;
    });
    return count;
  }

  MemoryStore store;
  RecordingPlaces places;
  double step = 1.0;  // s
  Eigen::Vector3d sensor = Eigen::Vector3d::Zero();

 private:
  std::uint32_t scan_ = 0;
  double time_ = 0.0;  // s
  detail::Visibility visibility_;
};

RecordingPlacesConfig any_size() {
  RecordingPlacesConfig config;
  config.object_places = 1;
  return config;
}

TEST_CASE("a place that enough looks in a row passed has changed") {
  const int enough = RecordingPlacesConfig().free_looks;
  Recorder left(any_size());
  left.measure(1);
  left.look(BeamResult::kHit, 60);  // however long it stood
  left.look(BeamResult::kFree, enough);
  CHECK(left.changed() == 1);

  Recorder came(any_size());
  came.measure(1);
  came.look(BeamResult::kFree, enough);
  came.look(BeamResult::kHit, 60);
  CHECK(came.changed() == 1);

  Recorder few(any_size());
  few.measure(1);
  few.look(BeamResult::kHit, 60);
  few.look(BeamResult::kFree, enough - 1);
  CHECK(few.changed() == 0);
}

TEST_CASE("points that were too far for looks leave with a place that looks of any range passed") {
  const int enough = RecordingPlacesConfig().free_looks;
  const auto range = static_cast<float>(RecordingPlacesConfig().place_range);
  for (const float x : {range - 4.7F, range + 5.3F}) {
    CAPTURE(x);
    for (const int looks : {enough - 1, enough}) {
      Recorder mover(any_size());
      mover.measure(1, 0, x);
      mover.sensor.x() = 31.0;
      mover.look(BeamResult::kFree, looks);
      CHECK(mover.changed() == (looks == enough ? 1 : 0));
    }
  }
}

TEST_CASE("points that are too far for looks do not tell how thin a place is") {
  const int enough = RecordingPlacesConfig().free_looks;
  const auto range = static_cast<float>(RecordingPlacesConfig().place_range);
  for (const bool is_near : {false, true}) {
    Recorder pole(any_size());
    pole.measure(1, 0, range + 5.3F);
    if (is_near) pole.measure_from(range, 1, 0, 5.3F);
    pole.sensor.x() = 15.0;  // 50 m away
    pole.look(BeamResult::kFree, enough);
    CHECK(pole.changed() == (is_near ? 0 : 1));
  }
}

TEST_CASE("a hit between free looks begins a new row of them") {
  const int enough = RecordingPlacesConfig().free_looks;
  Recorder fence(any_size());
  fence.measure(1);
  for (int i = 0; i < 20; ++i) {
    fence.look(BeamResult::kFree, enough - 1);
    fence.look(BeamResult::kHit);
  }
  CHECK(fence.changed() == 0);

  Recorder hidden(any_size());
  hidden.measure(1);
  for (int i = 0; i < enough; ++i) {
    hidden.look(BeamResult::kFree);
    hidden.look(BeamResult::kUnknown);
  }
  CHECK(hidden.changed() == 1);
}

TEST_CASE("references near each other in time and place are one look") {
  Recorder repeated(any_size());
  repeated.measure(1);
  repeated.step = 0.05;
  repeated.look(BeamResult::kFree, 20);  // 0.95 s from first to last
  CHECK(repeated.changed() == 0);

  Recorder moving(any_size());
  moving.measure(1);
  moving.step = 0.05;
  moving.sensor.y() = -4.5;
  for (int i = 0; i < 4; ++i) {
    moving.look(BeamResult::kFree);
    moving.sensor.y() += RecordingPlacesConfig().look_way;
  }
  CHECK(moving.changed() == 1);
}

TEST_CASE("looks from farther away than any point of a place was measured do not count") {
  Recorder near(any_size());
  near.measure(1, 0, 18.9F);
  near.sensor.x() = 5.0;  // 14 m from the place, which was measured from 19 m
  near.look(BeamResult::kFree, 10);
  CHECK(near.changed() == 0);

  Recorder far(any_size());
  far.measure(1, 0, 20.9F);
  far.sensor.x() = 7.0;
  far.look(BeamResult::kFree, 10);
  CHECK(far.changed() == 1);
}

TEST_CASE("an object needs enough places") {
  const int enough = RecordingPlacesConfig().object_places;
  for (const int places : {enough - 1, enough}) {
    Recorder recorder;
    recorder.measure(places);
    recorder.look(BeamResult::kHit, 5);
    recorder.look(BeamResult::kFree, 10);
    CHECK(recorder.changed() == (places < enough ? 0U : static_cast<std::size_t>(places)));
  }
}

// Two places are an object, if no more places that stay touch it.
RecordingPlacesConfig with_small_objects() {
  RecordingPlacesConfig config;
  config.object_places = 2;
  config.most_contact = 1.0;
  return config;
}

// Looks pass the places before x = 10.4 m and hit the others.
BeamResult pass_near_ones(const Eigen::Vector3d& at) {
  return at.x() < 10.4 ? BeamResult::kFree : BeamResult::kHit;
}

TEST_CASE("a part of something that stays stays") {
  const RecordingPlacesConfig config = with_small_objects();
  for (const int touching : {2, 3}) {
    Recorder recorder(config);
    recorder.measure(2);                   // these leave
    recorder.measure(touching, 0, 10.5F);  // beside them
    recorder.look(BeamResult::kHit, 5);
    recorder.look_by(pass_near_ones, 10);
    CHECK(recorder.changed() == (touching == 2 ? 2U : 0U));
  }
}

TEST_CASE("places that looks from any range passed are no contact, but a part of the object") {
  const RecordingPlacesConfig config = with_small_objects();
  for (const int touching : {4, 5}) {
    Recorder recorder(config);
    recorder.measure(4);
    recorder.measure(touching, 0, 10.5F);
    recorder.look(BeamResult::kHit, 5);
    const auto passed = [&](double from, double to) {
      recorder.look_by(
          [=](const Eigen::Vector3d& at) {
            if (at.x() > 10.4) return BeamResult::kHit;
            return at.y() > from && at.y() < to ? BeamResult::kFree : BeamResult::kUnknown;
          },
          10);
    };
    passed(0.0, 0.8);
    recorder.sensor.x() = -5.0;  // too far away to tell of places alone
    passed(0.8, 1.6);
    CHECK(recorder.changed() == (touching == 4 ? 4U : 0U));
  }
}

TEST_CASE("an object across the border of tiles is one object") {
  Recorder recorder;
  const int border = kTileCells;  // places
  recorder.measure(6, border - 3);
  recorder.sensor.y() = 25.0;
  recorder.look(BeamResult::kHit, 5);
  recorder.look(BeamResult::kFree, 10);
  CHECK(recorder.changed() == 6);
  CHECK(recorder.places.object_count() == 1);
}

TEST_CASE("a changed place tells the scans that passed it") {
  Recorder recorder(any_size());
  recorder.measure(1);
  recorder.look(BeamResult::kHit, 7);
  recorder.look(BeamResult::kFree, 5);
  REQUIRE(recorder.changed() == 1);
  recorder.places.for_each([&](const Eigen::Vector3d& at, const RecordingPlaces::Place& place) {
    const ScanSpan free = recorder.places.free_scans(place);
    CHECK(free.first == 8);
    CHECK(free.last == 12);
    CHECK((at - Eigen::Vector3d(10.2, 0.2, 0.2)).norm() < 1e-9);
  });
}

constexpr PointLabel kKept = PointLabel::kStatic, kRemoved = PointLabel::kDynamic;

TEST_CASE("what the first pass saw coming has changed, if looks passed its place before") {
  for (const bool was_empty : {false, true}) {
    for (const PointLabel first : {kKept, kRemoved}) {
      Recorder recorder;
      recorder.judge(2, {first, kKept, kKept});
      recorder.look(was_empty ? BeamResult::kFree : BeamResult::kUnknown);
      recorder.look(BeamResult::kUnknown);
      recorder.look(BeamResult::kHit, 20);
      CHECK(recorder.changed() == (was_empty && first == kRemoved ? 6U : 0U));
    }
  }
}

TEST_CASE("looks from too far away tell only of places beside those that changed") {
  for (const double back : {0.0, 5.0}) {  // m: 10.1 and 15.1 m from the places
    Recorder alone;
    alone.judge(2, {kRemoved, kKept, kKept});
    alone.sensor.x() = -back;
    alone.look(BeamResult::kFree);
    alone.look(BeamResult::kHit, 5);
    CHECK(alone.changed() == (back > 0.0 ? 0U : 6U));
  }
  Recorder beside;
  beside.judge(3, {kRemoved, kKept, kKept}, 10);
  beside.look_by([](const Eigen::Vector3d& at) {
    return at.y() < 2.4 ? BeamResult::kFree : BeamResult::kUnknown;
  });
  beside.sensor.x() = -5.0;
  beside.look(BeamResult::kFree);
  beside.look(BeamResult::kHit, 5);
  CHECK(beside.changed() == 10);
}

TEST_CASE("what stands beside the way of a mover stays, even if the first pass removed it first") {
  for (const bool was_kept : {false, true}) {  // what looks passed later
    Recorder recorder;
    recorder.judge(2, {kRemoved, kRemoved, was_kept ? kKept : kRemoved}, 6,
                   {kRemoved, kRemoved, kKept});
    recorder.look_by(
        [](const Eigen::Vector3d& at) {
          return at.y() < 2.4 ? BeamResult::kFree : BeamResult::kUnknown;
        },
        6);
    CHECK(recorder.changed() == (was_kept ? 12U : 0U));
  }
}

TEST_CASE("what beams pass while others hit it is porous, and stays") {
  for (const bool is_kept_in_between : {false, true}) {
    Recorder recorder;
    recorder.judge(is_kept_in_between ? 3 : 20, {kKept, kKept, kKept});
    recorder.look(BeamResult::kFree, 8);
    CHECK(recorder.changed() == (is_kept_in_between ? 0U : 6U));
  }
}

TEST_CASE("what came and is hit at last stands since the last look that passed its place") {
  Recorder recorder;
  recorder.judge(6, {kKept, kKept, kKept});
  recorder.look(BeamResult::kFree, 5);
  recorder.look(BeamResult::kHit, 3);
  CHECK(recorder.changed() == 6);
  recorder.places.for_each([](const Eigen::Vector3d&, const RecordingPlaces::Place& place) {
    CHECK_FALSE(place.stands_since(5));
    CHECK(place.stands_since(6));
  });
  Recorder left;
  left.judge(0, {kKept, kKept, kKept});
  left.look(BeamResult::kHit, 3);
  left.look(BeamResult::kFree, 5);
  CHECK(left.changed() == 6);
  left.places.for_each([](const Eigen::Vector3d&, const RecordingPlaces::Place& place) {
    CHECK_FALSE(place.stands_since(20));
  });
}

TEST_CASE("what the first pass saw leaving has changed, if looks passed its place afterwards") {
  for (const BeamResult after : {BeamResult::kFree, BeamResult::kUnknown, BeamResult::kHit}) {
    Recorder recorder;
    recorder.judge(0, {kKept, kKept, kRemoved});
    recorder.look(BeamResult::kHit, 3);
    recorder.look(after);
    CHECK(recorder.changed() == (after == BeamResult::kFree ? 6U : 0U));
  }
}

TEST_CASE("places beside those that changed join them, if the first pass removed their points") {
  for (const int removed : {1, 2}) {
    Recorder recorder;
    const std::vector<PointLabel> came = removed == 1
                                             ? std::vector<PointLabel>{kRemoved, kKept, kKept}
                                             : std::vector<PointLabel>{kRemoved, kRemoved, kKept};
    recorder.judge(2, came, 10);
    recorder.look_by([](const Eigen::Vector3d& at) {
      return at.y() < 2.4 ? BeamResult::kFree : BeamResult::kUnknown;
    });
    recorder.look(BeamResult::kHit, 5);
    CHECK(recorder.changed() == (removed == 1 ? 6U : 10U));
  }
}

TEST_CASE("places beside those that changed join them, if enough looks passed from any range") {
  const int enough = RecordingPlacesConfig().free_looks;
  for (const int looks : {enough - 1, enough}) {
    for (const bool is_kept_in_between : {false, true}) {
      Recorder recorder;
      // 64 of 70 places join: looks passed all of them.
      recorder.judge(is_kept_in_between ? enough + 2 : 40, {kKept, kKept, kKept}, 70);
      recorder.look_by(
          [](const Eigen::Vector3d& at) {
            return at.y() < 2.4 ? BeamResult::kFree : BeamResult::kUnknown;
          },
          enough);
      recorder.sensor.x() = -5.0;  // too far away to tell of places alone
      recorder.look_by(
          [](const Eigen::Vector3d& at) {
            return at.y() < 2.4 ? BeamResult::kUnknown : BeamResult::kFree;
          },
          looks);
      const bool joins = looks == enough && !is_kept_in_between;
      CHECK(recorder.changed() == (joins ? 70U : 6U));
    }
  }
}

/// A row of places in which the first pass kept a part of the points, in `moved` of them until two
/// epochs before the end, and others beside it that looks passed.
struct AlwaysThere {
  int places = 20, beside = 6, moved = 10;
  int removed_of_kept = 6;
  std::uint32_t epochs = 4;

  std::size_t standing() const {
    Recorder recorder;
    for (std::uint32_t epoch = 0; epoch < epochs; ++epoch) {
      const int begin = epoch + 2 < epochs ? 0 : moved;
      recorder.judge_places(10 * epoch, kKept, places - begin, begin);
      for (int i = 0; i < removed_of_kept; ++i) {
        recorder.judge_places(10 * epoch, kRemoved, places, 0);
      }
    }
    recorder.measure(beside, 0, 10.5F);
    recorder.look_by([](const Eigen::Vector3d& at) {
      return at.x() < 10.4 ? BeamResult::kHit : BeamResult::kFree;
    });
    CHECK(recorder.changed() == 0);
    std::size_t count = 0;
    recorder.places.for_each([&](const Eigen::Vector3d&, const RecordingPlaces::Place& place) {
      if (place.stands()) ++count;
    });
    return count;
  }
};

TEST_CASE("what is always there stands if it is large and kept, did not move, and is not passed") {
  CHECK(AlwaysThere{}.standing() == 20);
  CHECK(AlwaysThere{19, 5, 0}.standing() == 0);
  CHECK(AlwaysThere{20, 7, 10}.standing() == 0);
  CHECK(AlwaysThere{20, 6, 11}.standing() == 0);
  CHECK(AlwaysThere{20, 6, 0, 9}.standing() == 20);
  CHECK(AlwaysThere{20, 6, 0, 10}.standing() == 0);
  CHECK(AlwaysThere{20, 6, 0, 9, 3}.standing() == 0);
}

TEST_CASE("a point touches what changed, if fewer places beside it stay") {
  for (const int staying : {2, 3}) {  // of 3 x 3 x 3 places around the point, 3 have changed
    Recorder recorder;
    recorder.measure(6);
    recorder.measure(staying, 1, 10.9F);
    recorder.look(BeamResult::kHit, 5);
    recorder.look_by(pass_near_ones, 10);
    REQUIRE(recorder.changed() == 6);
    const Eigen::Vector3d between(10.6, 1.0, 0.2);
    const RecordingPlace* const beside = recorder.places.changed_beside(cell_at(between));
    REQUIRE((beside != nullptr) == (staying == 2));
    if (beside != nullptr) CHECK(beside->state == PlaceState::kChanged);
    CHECK(recorder.places.changed_beside(cell_at({9.4, 1.0, 0.2})) == nullptr);
  }
}

TEST_CASE("parameters of places have bounds") {
  RecordingPlacesConfig config;
  config.free_looks = 0;
  MemoryStore store;
  CHECK_THROWS_AS(RecordingPlaces(config, store, kBudget), ConfigError);
}

}  // namespace
