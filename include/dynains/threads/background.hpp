// One task at a time in another thread.
#pragma once

#include <condition_variable>
#include <exception>
#include <functional>
#include <future>
#include <mutex>
#include <thread>
#include <utility>

namespace dynains {

/// Runs tasks one after the other in one thread, which begins with the first task and ends with
/// this object: to begin a thread for each task costs more than many tasks. The destructor waits
/// for the task; its exception is lost. Not for several callers at once.
class Background {
 public:
  /// `policy`: async for another thread, deferred for the caller's thread in wait().
  explicit Background(std::launch policy = std::launch::async) : policy_(policy) {}
  Background(const Background&) = delete;
  Background& operator=(const Background&) = delete;
  ~Background() {
    if (!thread_.joinable()) return;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      ends_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }

  std::launch policy() const { return policy_; }
  /// Whether a task was begun that wait() has not returned from.
  bool is_busy() const { return is_busy_; }

  /// Begins a task. The task before must have been waited for.
  void begin(std::function<void()> task) {
    is_busy_ = true;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      task_ = std::move(task);
    }
    if (policy_ == std::launch::deferred) return;
    if (!thread_.joinable()) thread_ = std::thread([this] { run(); });
    changed_.notify_all();
  }

  /// Waits for the end of the task, if there is one, and throws its exception.
  void wait() {
    if (!is_busy_) return;
    is_busy_ = false;
    if (policy_ == std::launch::deferred) return std::exchange(task_, nullptr)();
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait(lock, [this] { return task_ == nullptr; });
    if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
  }

 private:
  void run() {
    std::unique_lock<std::mutex> lock(mutex_);
    for (;;) {
      changed_.wait(lock, [this] { return ends_ || task_ != nullptr; });
      if (task_ == nullptr) return;
      lock.unlock();
      std::exception_ptr error;
      try {
        task_();
      } catch (...) {
        error = std::current_exception();
      }
      lock.lock();
      error_ = error;
      task_ = nullptr;
      changed_.notify_all();
    }
  }

  std::launch policy_;
  bool is_busy_ = false;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::function<void()> task_;  // the thread's until it is empty again
  std::exception_ptr error_;
  bool ends_ = false;
  std::thread thread_;
};

/// Calls `here` in this thread and `there` in the thread of `other`, which is not busy, and returns
/// at the end of both. Without `other`, `there` is called after `here`. Throws the exception of
/// `here`, else that of `there`.
template <class Here, class There>
void run_both(Background* other, Here&& here, There&& there) {
  if (other == nullptr) {
    here();
    there();
    return;
  }
  other->begin([&there] { there(); });
  try {
    here();
  } catch (...) {
    try {
      other->wait();
    } catch (...) {  // the first exception is thrown
    }
    throw;
  }
  other->wait();
}

}  // namespace dynains
