// Independent results, computed in two threads.
#pragma once

#include <atomic>
#include <cstddef>
#include <exception>
#include <optional>
#include <utility>
#include <vector>

#include "dynains/threads/background.hpp"

namespace dynains {

/// `make(i)` for each i below `count`, in this order. Throws the first exception in this order.
template <class Make>
auto in_two_threads(std::size_t count, Make&& make) {
  using Result = decltype(make(count));
  std::vector<std::optional<Result>> made(count);
  std::vector<std::exception_ptr> errors(count);
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < count; i = next++) {
      try {
        made[i].emplace(make(i));
      } catch (...) {
        errors[i] = std::current_exception();
      }
    }
  };
  Background other;
  run_both(count > 1 ? &other : nullptr, work, work);
  std::vector<Result> results;
  results.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    if (errors[i]) std::rethrow_exception(errors[i]);
    results.push_back(std::move(*made[i]));
  }
  return results;
}

}  // namespace dynains
