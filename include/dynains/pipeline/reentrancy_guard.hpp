// Detects two calls on one object at the same time.
#pragma once

#include <atomic>

#include "dynains/errors.hpp"

namespace dynains::detail {

/// Admits one call at a time. A second one, from another thread or from within the first, throws
/// before it changes anything. The next call sees the writes of the last one, also from another
/// thread.
class ReentrancyGuard {
 public:
  ReentrancyGuard() = default;
  ~ReentrancyGuard() = default;
  // Objects are moved between calls only.
  ReentrancyGuard(ReentrancyGuard&&) noexcept {}
  ReentrancyGuard& operator=(ReentrancyGuard&&) noexcept { return *this; }

  /// One call, from construction to destruction. Throws UsageError during another one.
  class Guard {
   public:
    explicit Guard(ReentrancyGuard& owner) : owner_(owner) {
      if (owner_.at_work_.exchange(true, std::memory_order_acquire)) {
        throw UsageError(
            "DynaInsRemover: push, flush, reset and reserve must not be called while one of them "
            "is at work; take one object for each thread, or a lock");
      }
    }
    ~Guard() { owner_.at_work_.store(false, std::memory_order_release); }
    Guard(const Guard&) = delete;
    Guard& operator=(const Guard&) = delete;

   private:
    ReentrancyGuard& owner_;
  };

 private:
  std::atomic<bool> at_work_{false};
};

}  // namespace dynains::detail
