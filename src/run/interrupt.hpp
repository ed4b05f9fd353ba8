// Ctrl-C as a request that a loop polls.
#pragma once

namespace dynains::run {

/// A signal ended the work early; finished results are written.
struct Interrupted {
  int signal;
};

/// Effect of a second signal. The first one asks to stop.
enum class SecondSignal { kEndsProcess, kAsksAgain };

/// While one lives, in any thread, SIGINT and SIGTERM ask to stop. A signal that the program was
/// started to ignore, as by nohup or `&` in a script, stays ignored.
class InterruptGuard {
 public:
  /// `second` of the first of several guards counts.
  explicit InterruptGuard(SecondSignal second = SecondSignal::kEndsProcess);
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

  /// Number of the signal that asked to stop, 0 if none did.
  static int signal();
  /// Throws Interrupted if a signal asked to stop.
  static void check() {
    if (signal() != 0) throw Interrupted{signal()};
  }
};

}  // namespace dynains::run
