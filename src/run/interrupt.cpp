#include "interrupt.hpp"

#include <csignal>
#include <cstddef>
#include <mutex>

namespace dynains::run {
namespace {

// A signal handler can reach nothing but a global.
volatile std::sig_atomic_t received = 0;

// A signal has one action in the process. All guards share these actions.
struct Actions {
  std::mutex mutex;
  std::size_t guards = 0;
  struct sigaction interrupt_before {};
  struct sigaction termination_before {};
};

Actions& actions() {
  static Actions result;
  return result;
}

void remember(int signal) { received = signal; }

/// Returns the action before.
struct sigaction listen_to(int signal, SecondSignal second) {
  struct sigaction before {};
  sigaction(signal, nullptr, &before);
  if (before.sa_handler == SIG_IGN) return before;
  struct sigaction action {};
  action.sa_handler = remember;
  action.sa_flags = SA_RESTART;
  if (second == SecondSignal::kEndsProcess) action.sa_flags |= static_cast<int>(SA_RESETHAND);
  sigemptyset(&action.sa_mask);
  sigaction(signal, &action, nullptr);
  return before;
}

}  // namespace

InterruptGuard::InterruptGuard(SecondSignal second) {
  Actions& all = actions();
  const std::lock_guard<std::mutex> lock(all.mutex);
  if (all.guards++ > 0) return;
  received = 0;
  all.interrupt_before = listen_to(SIGINT, second);
  all.termination_before = listen_to(SIGTERM, second);
}

InterruptGuard::~InterruptGuard() {
  Actions& all = actions();
  const std::lock_guard<std::mutex> lock(all.mutex);
  if (--all.guards > 0) return;
  sigaction(SIGINT, &all.interrupt_before, nullptr);
  sigaction(SIGTERM, &all.termination_before, nullptr);
}

int InterruptGuard::signal() { return received; }

}  // namespace dynains::run
