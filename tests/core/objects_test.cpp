// Moving objects as boxes with ids and velocities (RemoverConfig::objects).

#include "dynains/pipeline/object_tracks.hpp"
#include "support/catch.hpp"
#include "support/runs.hpp"

namespace dynains::test {
namespace {

constexpr double kStart = 14.0, kSpeed = -6.0;  // m, m/s, of a van along x

/// Scans of a van that something hides for half a second.
std::vector<Scan> passing_van() {
  const Scene with = yard_with(van(kStart, 3.5, {kSpeed, 0.0, 0.0}));
  const Scene without = yard();
  std::vector<Scan> scans;
  for (int i = 0; i < 40; ++i) {
    const bool is_hidden = i >= 20 && i < 25;
    scans.push_back((is_hidden ? without : with).scan(sensor_at(0.0), 0.1 * i));
  }
  return scans;
}

struct Found {
  std::uint64_t scan;
  double time;
  MovingObject object;
};

struct Listed {
  std::vector<Found> newest, final;
};

Listed list_objects(const std::vector<Scan>& scans, int threads) {
  DynaInsRemover::Config config;
  config.objects = true;
  config.threads = threads;
  DynaInsRemover remover(config);
  Listed listed;
  const auto keep = [](const ScanVerdict& verdict, std::vector<Found>& found) {
    for (const MovingObject& object : verdict.objects) {
      found.push_back({verdict.scan, verdict.time, object});
    }
  };
  for (const Scan& scan : scans) {
    const FrameResult frame = push(remover, scan);
    keep(frame.newest(), listed.newest);
    if (frame.finished) keep(*frame.finished, listed.final);
  }
  remover.flush([&](const ScanVerdict& verdict) { keep(verdict, listed.final); });
  return listed;
}

std::vector<double> numbers_of(const std::vector<Found>& found) {
  std::vector<double> numbers;
  for (const Found& row : found) {
    numbers.push_back(row.time);
    MovingObject::visit(row.object, [&](const char*, auto number) {
      numbers.push_back(static_cast<double>(number));
    });
  }
  return numbers;
}

TEST_CASE("a moving van is one object with its place, size and velocity") {
  const Listed listed = list_objects(passing_van(), 1);
  for (const auto* const found : {&listed.newest, &listed.final}) {
    CHECK(found->size() > 25);
    std::set<std::uint32_t> ids;
    std::set<std::uint64_t> seen;
    std::size_t near = 0, fast = 0;
    for (const auto& [scan, time, object] : *found) {
      CAPTURE(scan, object.id);
      ids.insert(object.id);
      CHECK(seen.insert(scan).second);
      CHECK((scan < 20 || scan >= 25));
      CHECK(object.first_scan <= scan);
      CHECK(object.last_scan >= scan);
      const Eigen::Vector2d error =
          object.centre.head<2>() - Eigen::Vector2d(kStart + kSpeed * time, 3.5);
      CHECK(error.norm() < 1.0);
      near += error.norm() < 0.5 ? 1U : 0U;
      fast += (object.velocity - Eigen::Vector2d(kSpeed, 0.0)).norm() < 1.0 ? 1U : 0U;
      CHECK(std::abs(object.length - 4.2) < 0.6);
      CHECK(std::abs(object.width - 1.8) < 0.6);
      CHECK(object.points > 10);
    }
    CHECK(ids.size() == 1);
    // Points of the wall beside the van, and hidden ends, disturb some scans.
    CHECK(10 * near >= 9 * found->size());
    CHECK(4 * fast >= 3 * found->size());
  }
  CHECK(listed.newest.front().object.id == listed.final.front().object.id);
}

/// Observes a scan of moving clusters: points from the corner `low` on, 20 x 10 in a rectangle.
struct Rectangle {
  Eigen::Vector2f low, size;  // m
  Cause cause = Cause::kFreeSpace;
};
Span<const MovingObject> observe(std::uint64_t i, const std::vector<Rectangle>& clusters,
                                 detail::ObjectTracks& tracks) {
  detail::ScanSlot scan;
  scan.scan = i;
  scan.time = 0.1 * static_cast<double>(i);
  std::vector<EvidenceVerdict::Group> groups(1);
  std::vector<std::uint32_t> cluster_of, group_of;
  for (std::uint32_t c = 0; c < clusters.size(); ++c) {
    scan.ids.push_back(c + 1);
    groups.push_back({clusters[c].cause, 1.0F});
    cluster_of.push_back(c);
    for (int k = 0; k < 200; ++k) {
      const Eigen::Array2f share(static_cast<float>(k % 20) / 19.0F,
                                 static_cast<float>(k / 20) / 9.0F);
      const Eigen::Array2f point = clusters[c].low.array() + share * clusters[c].size.array();
      scan.split.points.push_back(point.x(), point.y(), 0.0F);
      group_of.push_back(c + 1);
    }
  }
  scan.split.count = scan.split.points.size();
  return tracks.observe(scan, {groups, cluster_of, group_of, {}});
}

TEST_CASE("a van keeps the length that was seen before it drove away") {
  detail::ObjectTracks tracks(18.0, 4.5, 10, nullptr);
  for (std::uint64_t i = 0; i < 40; ++i) {
    const float rear = 2.0F + 0.8F * static_cast<float>(i);
    const float seen = i < 15 ? 5.2F : 0.3F;  // m: then its rear hides the rest
    const auto objects = observe(i, {{{rear, -0.9F}, {seen, 1.8F}}}, tracks);
    if (i < 5) continue;
    REQUIRE(objects.size() == 1);
    CHECK(objects[0].length == Approx(5.2).margin(0.2));
    CHECK(objects[0].centre.x() == Approx(rear + 2.6).margin(0.3));
  }
}

TEST_CASE(
    "a car that shows its rear alone has a usual length, and one seen from its side its own") {
  detail::ObjectTracks tracks(18.0, 4.5, 10, nullptr);
  for (std::uint64_t i = 0; i < 20; ++i) {
    const float way = 0.8F * static_cast<float>(i);
    const Rectangle ahead{{10.0F + way, -0.9F}, {0.3F, 1.8F}};
    const Rectangle beside{{-8.0F + way, 25.0F}, {3.6F, 1.8F}};
    const auto objects = observe(i, {ahead, beside}, tracks);
    if (i < 10) continue;
    REQUIRE(objects.size() == 2);
    const auto& [car, small] = std::tie(objects[0], objects[1]);
    CHECK(car.length == Approx(4.5).margin(0.1));
    CHECK(car.centre.x() == Approx(10.0F + way + 2.25F).margin(0.2));
    CHECK(small.length == Approx(3.6).margin(0.2));
    CHECK(small.centre.x() == Approx(-8.0F + way + 1.8F).margin(0.2));
  }
}

TEST_CASE("a car that comes out from behind another one is not faster than it drives") {
  detail::ObjectTracks tracks(18.0, 4.5, 10, nullptr);
  std::size_t listed = 0;
  for (std::uint64_t i = 0; i < 30; ++i) {
    const float front = 2.0F + 0.2F * static_cast<float>(i);
    const float seen = std::min(4.2F, 0.5F + static_cast<float>(i));  // m, from its front on
    const auto objects = observe(i, {{{front - seen, 8.0F}, {seen, 1.8F}}}, tracks);
    for (const MovingObject& object : objects) {
      CAPTURE(i, object.velocity.transpose());
      CHECK(object.velocity.norm() < 6.0);  // m/s; its rear seems to move at 8 m/s
      ++listed;
    }
  }
  CHECK(listed > 15);
}

TEST_CASE("parts that later scans know as one van are one object in final verdicts") {
  detail::ObjectTracks newest(18.0, 4.5, 10, nullptr), final(18.0, 4.5, 10, &newest);
  const auto seen = [](std::uint64_t i) -> std::vector<Rectangle> {
    const float rear = 2.0F + 0.8F * static_cast<float>(i);
    if (i >= 6) return {{{rear, 2.0F}, {4.2F, 1.8F}}};
    return {{{rear, 2.0F}, {1.2F, 1.8F}}, {{rear + 2.4F, 2.0F}, {1.8F, 1.8F}}};
  };
  for (std::uint64_t i = 0; i < 30; ++i) {
    observe(i, seen(i), newest);
    if (i < 10) continue;
    const auto objects = observe(i - 10, seen(i - 10), final);
    REQUIRE(objects.size() == 1);
    CHECK(objects[0].id == 1);
    const double centre = 4.1 + 0.8 * static_cast<double>(i - 10);
    CHECK(objects[0].centre.x() == Approx(centre).margin(0.5));
    CHECK(objects[0].velocity.x() == Approx(8.0).margin(0.8));
  }
}

TEST_CASE("parts that move alike are one object where beams are as far apart as they are") {
  const auto listed_at = [](float y) {
    detail::ObjectTracks tracks(18.0, 4.5, 10, nullptr);
    std::size_t listed = 0;
    for (std::uint64_t i = 0; i < 20; ++i) {
      const float rear = -8.0F + 0.8F * static_cast<float>(i);
      const Eigen::Vector2f size(1.8F, 1.8F);  // m; 0.5 m lie between both parts
      listed = observe(i, {{{rear, y}, size}, {{rear + 2.3F, y}, size}}, tracks).size();
    }
    return listed;
  };
  CHECK(listed_at(25.0F) == 1);
  CHECK(listed_at(3.0F) == 2);
}

TEST_CASE("points that were removed for others neither begin nor widen objects") {
  const auto width_with = [](Cause cause) {
    detail::ObjectTracks tracks(18.0, 4.5, 10, nullptr);
    double widest = 0.0;
    for (std::uint64_t i = 0; i < 20; ++i) {
      const float rear = 5.0F + 0.8F * static_cast<float>(i);
      const auto objects = observe(i,
                                   {{{rear, 2.0F}, {4.2F, 1.8F}},
                                    {{rear, 3.9F}, {4.2F, 0.5F}, cause},
                                    {{rear, -6.0F}, {4.2F, 1.8F}, Cause::kPresumed}},
                                   tracks);
      CHECK(objects.size() <= 1);
      for (const MovingObject& object : objects) widest = std::max(widest, object.width);
    }
    return widest;
  };
  CHECK(width_with(Cause::kFreeSpace) == Approx(2.4).margin(0.1));
  CHECK(width_with(Cause::kDynamicOccupancy) == Approx(1.8).margin(0.1));
}

TEST_CASE("vehicles abreast that move alike are no single object") {
  detail::ObjectTracks tracks(18.0, 3.0, 10, nullptr);  // objects are up to 3 m wide
  std::size_t listed = 0;
  for (std::uint64_t i = 0; i < 20; ++i) {
    const float rear = 5.0F + 0.8F * static_cast<float>(i);
    const Eigen::Vector2f size(4.2F, 1.8F);
    const auto objects =
        observe(i, {{{rear, 2.0F}, size}, {{rear, 4.05F}, size}, {{rear, 6.1F}, size}}, tracks);
    listed = objects.size();
    for (const MovingObject& object : objects) CHECK(object.width < 2.0);
  }
  CHECK(listed == 3);
}

TEST_CASE("two threads list the same objects") {
  const std::vector<Scan> scans = passing_van();
  const Listed one = list_objects(scans, 1), two = list_objects(scans, 2);
  CHECK(numbers_of(one.newest) == numbers_of(two.newest));
  CHECK(numbers_of(one.final) == numbers_of(two.final));
}

TEST_CASE("verdicts on points do not depend on the list of objects") {
  const std::vector<Scan> scans = passing_van();
  DynaInsRemover::Config config =
      GENERATE(DynaInsRemover::Config(), DynaInsRemover::Config::paper());
  DynaInsRemover without(config);
  config.objects = true;
  DynaInsRemover with(config);
  const Run a = run(without, scans), b = run(with, scans);
  CHECK(a.newest == b.newest);
  CHECK(a.final == b.final);
}

}  // namespace
}  // namespace dynains::test
