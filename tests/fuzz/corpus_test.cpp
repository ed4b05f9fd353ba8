// Runs the fuzzing targets on their seeds and on mutations of these, without a fuzzer.

#include "support/catch.hpp"
#include "support/random.hpp"
#include "targets.hpp"

namespace dynains::fuzz {
namespace {

void run(const Target& target, const std::string& input) {
  target.run({reinterpret_cast<const std::uint8_t*>(input.data()), input.size()});
}

/// The input with some bytes changed, removed or doubled, or with its end cut off.
std::string mutated(std::string input, test::Random& random) {
  const std::size_t changes = 1 + random.index(4);
  for (std::size_t i = 0; i < changes && !input.empty(); ++i) {
    const std::size_t at = random.index(input.size());
    const std::size_t count = 1 + random.index(std::min<std::size_t>(input.size() - at, 8));
    switch (random.index(5)) {
      case 0:
        input[at] = static_cast<char>(random.index(256));
        break;
      case 1:
        input.erase(at, count);
        break;
      case 2:
        input.insert(at, input.substr(at, count));
        break;
      case 3:
        input.resize(at);
        break;
      default:
        input[at] = "0123456789-.enai \n"[random.index(18)];
    }
  }
  return input;
}

TEST_CASE("Seeds and their mutations give a value or an exception of this project") {
  for (const Target& target : targets()) {
    INFO(target.name);
    test::Random random(7);
    for (const std::string& seed : target.seeds) {
      REQUIRE_NOTHROW(run(target, seed));
      for (int i = 0; i < 300; ++i) {
        const std::string input = mutated(seed, random);
        CAPTURE(input);
        REQUIRE_NOTHROW(run(target, input));
      }
    }
  }
}

TEST_CASE("A failed requirement is detected") {
  CHECK_THROWS_AS(require(false, "never"), std::logic_error);
  CHECK_THROWS_AS(target("none"), std::out_of_range);
}

}  // namespace
}  // namespace dynains::fuzz
