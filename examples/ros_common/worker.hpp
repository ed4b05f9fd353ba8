// A thread that works whenever it is woken, so that callbacks of ROS return at once.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

namespace dynains_ros {

/// Calls `step()`, which must not throw, again and again. It returns how long the thread waits for
/// wake() before the next call. The destructor waits for the end of the present call.
class Worker {
 public:
  using Wait = std::chrono::milliseconds;

  explicit Worker(std::function<Wait()> step)
      : step_(std::move(step)), thread_([this] { run(); }) {}
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;
  ~Worker() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      must_stop_ = true;
    }
    changed_.notify_one();
    thread_.join();
  }

  void wake() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      is_woken_ = true;
    }
    changed_.notify_one();
  }

 private:
  void run() {
    Wait wait{0};
    while (true) {
      {
        std::unique_lock<std::mutex> lock(mutex_);
        changed_.wait_for(lock, wait, [this] { return is_woken_ || must_stop_; });
        if (must_stop_) return;
        is_woken_ = false;
      }
      wait = step_();
    }
  }

  std::function<Wait()> step_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_woken_ = false;
  bool must_stop_ = false;
  std::thread thread_;  // last: it uses all members above
};

/// Sends values in a thread of its own, because `send(Value)`, which must not throw, may be slow.
/// A new value replaces one that still waits.
template <class Value>
class Outbox {
 public:
  explicit Outbox(std::function<void(Value)> send)
      : send_(std::move(send)), worker_([this] { return step(); }) {}

  void post(Value value) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      newest_ = std::move(value);
    }
    worker_.wake();
  }

 private:
  Worker::Wait step() {
    std::optional<Value> value;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      value.swap(newest_);
    }
    if (value) send_(std::move(*value));
    return std::chrono::hours(1);
  }

  std::function<void(Value)> send_;
  std::mutex mutex_;
  std::optional<Value> newest_;
  Worker worker_;  // last: it uses all members above
};

}  // namespace dynains_ros
