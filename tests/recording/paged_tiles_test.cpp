#include "dynains/recording/paged_tiles.hpp"

#include <cstddef>
#include <cstdint>
#include <map>
#include <random>
#include <utility>

#include "support/catch.hpp"

using namespace dynains;

namespace {

/// Counts the bytes that come and go.
class CountingStore : public MemoryStore {
 public:
  std::uint64_t append(Span<const std::uint8_t> bytes) override {
    ++appended;
    return MemoryStore::append(bytes);
  }
  std::size_t appended = 0;
};

}  // namespace

TEST_CASE("tiles hold what was put into them, for any budget") {
  for (const std::size_t budget : {std::size_t{0}, std::size_t{20000}, std::size_t{1} << 30U}) {
    CAPTURE(budget);
    CountingStore store;
    PagedTiles<VoxelTile<int>> tiles(store, budget);
    std::map<std::pair<TileIndex, VoxelKey>, int> expected;
    std::mt19937 random(7);
    for (int i = 0; i < 3000; ++i) {
      const TileIndex index = {static_cast<std::int64_t>(random() % 5) - 2,
                               static_cast<std::int64_t>(random() % 5) - 2};
      const VoxelKey key = voxel_key(static_cast<std::int64_t>(random() % 20), 0, 0);
      const int value = static_cast<int>(random() % 1000);
      auto& tile = tiles.at(index);
      tile.values[tile.add(key)] = value;
      expected[{index, key}] = value;
      if (i % 10 == 0) tiles.free_far(tiles.middle(index), 0.0);
    }
    CHECK((store.appended > 0) == (budget < 1U << 30U));
    CHECK(tiles.size() == expected.size());
    for (const auto& [at, value] : expected) {
      const auto* const tile = tiles.find(at.first);
      REQUIRE(tile != nullptr);
      REQUIRE(tile->find(at.second) != nullptr);
      CHECK(*tile->find(at.second) == value);
    }
    CHECK(tiles.find({9, 9}) == nullptr);
  }
}

TEST_CASE("tiles that are near stay in memory, and unchanged ones are stored once") {
  CountingStore store;
  PagedTiles<VoxelTile<int>> tiles(store, 0);
  for (std::int64_t x = 0; x < 4; ++x) {
    auto& tile = tiles.at({x, 0});
    tile.values[tile.add(1)] = 5;
  }
  const auto* const near = &tiles.at({0, 0});
  const Eigen::Vector3d sensor(kTileEdge - 5.0, 5.0, 0.0);
  tiles.free_far(sensor, 5.1);  // the border of the second tile is 5 m away
  CHECK(near->values.size() == 1);
  CHECK(store.appended == 2);
  tiles.free_far(sensor, 4.9);
  CHECK(store.appended == 3);
  REQUIRE(tiles.find({3, 0})->find(1) != nullptr);
  CHECK(*tiles.find({3, 0})->find(1) == 5);
  tiles.free_far(sensor, 4.9);
  CHECK(store.appended == 3);
  tiles.at({3, 0}).values[0] = 6;
  tiles.free_far(sensor, 4.9);
  CHECK(store.appended == 4);
  CHECK(*tiles.find({3, 0})->find(1) == 6);
}
