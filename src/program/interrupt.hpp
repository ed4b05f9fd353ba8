// Ctrl-C as a request that a loop looks at.
#pragma once

namespace dynains::program {

/// While one lives, in any thread, SIGINT and SIGTERM ask to stop; a second one ends the program at
/// once. A signal that the program was started to ignore, as by nohup or `&` in a script, stays
/// ignored.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

  /// Number of the signal that asked to stop, 0 if none did.
  static int signal();
};

}  // namespace dynains::program
