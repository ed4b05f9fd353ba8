#include "dynains/simd/short_numbers.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/points.hpp"
#include "support/catch.hpp"
#include "support/random.hpp"

namespace dynains::test {
namespace {

TEST_CASE("a list of short numbers returns the numbers that it was given") {
  detail::ShortNumbers list;
  std::vector<std::uint32_t> copy;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    INFO("seed " << seed);
    Random random(seed);
    std::vector<std::uint32_t> numbers(random.index(400));
    const std::size_t numbers_per_run = 1 + random.index(100);
    std::uint32_t upper = 0;
    for (std::uint32_t& number : numbers) {
      if (random.index(numbers_per_run) == 0) {
        upper = static_cast<std::uint32_t>(random.index(3)) * 0x7FFFU;
      }
      number = upper << 16U | static_cast<std::uint32_t>(random.index(0x10000));
      if (random.index(10) == 0) number = kNoCluster;
    }
    list.assign(numbers);
    REQUIRE(list.size() == numbers.size());
    list.copy_to(copy);
    REQUIRE(copy == numbers);
  }
}

TEST_CASE("a number that differs in bit 16 or above begins a run, at any place") {
  detail::ShortNumbers list;
  std::vector<std::uint32_t> copy;
  for (const std::uint32_t bit : {0U, 15U, 16U, 31U}) {
    for (std::size_t at = 0; at < 200; ++at) {
      std::vector<std::uint32_t> numbers(200, 0xFFFFU);
      numbers[at] ^= 1U << bit;
      list.assign(numbers);
      list.copy_to(copy);
      REQUIRE(copy == numbers);
    }
  }
}

}  // namespace
}  // namespace dynains::test
