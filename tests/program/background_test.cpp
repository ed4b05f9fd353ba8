#include "dynains/threads/background.hpp"

#include <thread>

#include "support/catch.hpp"

namespace dynains {

TEST_CASE("background tasks run one after the other in one other thread") {
  Background background;
  std::vector<std::thread::id> threads;
  for (int i = 0; i < 100; ++i) {
    background.begin([&] { threads.push_back(std::this_thread::get_id()); });
    CHECK(background.is_busy());
    background.wait();
    CHECK_FALSE(background.is_busy());
  }
  REQUIRE(threads.size() == 100);
  CHECK(threads == std::vector<std::thread::id>(100, threads.front()));
  CHECK(threads.front() != std::this_thread::get_id());
}

TEST_CASE("the exception of a background task comes to the one who waits, once") {
  const auto policy = GENERATE(std::launch::async, std::launch::deferred);
  Background background(policy);
  background.wait();
  background.begin([] { throw std::runtime_error("no disk"); });
  CHECK_THROWS_WITH(background.wait(), "no disk");
  CHECK_NOTHROW(background.wait());
  int done = 0;
  background.begin([&] { ++done; });
  background.wait();
  CHECK(done == 1);
}

TEST_CASE("both tasks end before run_both() does, and the exception of this thread comes first") {
  Background other;
  Background* const thread = GENERATE(true, false) ? &other : nullptr;
  std::thread::id here, there;
  const auto id = [] { return std::this_thread::get_id(); };
  run_both(
      thread, [&] { here = id(); }, [&] { there = id(); });
  CHECK(here == id());
  CHECK((there == id()) == (thread == nullptr));
  const auto fail = [](const char* text) { throw std::runtime_error(text); };
  CHECK_THROWS_WITH(run_both(
                        thread, [&] { fail("here"); }, [&] { fail("there"); }),
                    "here");
  int done = 0;
  CHECK_THROWS_WITH(run_both(
                        thread, [&] { ++done; }, [&] { fail("there"); }),
                    "there");
  run_both(
      thread, [] {}, [&] { ++done; });
  CHECK(done == 2);
}

}  // namespace dynains
