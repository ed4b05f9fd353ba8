#include "interrupt.hpp"

namespace dynains::program {
namespace {

// A signal handler can reach nothing but a global.
volatile std::sig_atomic_t received = 0;

void remember(int signal) { received = signal; }

/// Returns the action before.
struct sigaction listen_to(int signal) {
  struct sigaction before {};
  sigaction(signal, nullptr, &before);
  if (before.sa_handler == SIG_IGN) return before;
  struct sigaction action {};
  action.sa_handler = remember;
  action.sa_flags = static_cast<int>(SA_RESTART | SA_RESETHAND);
  sigemptyset(&action.sa_mask);
  sigaction(signal, &action, nullptr);
  return before;
}

}  // namespace

InterruptGuard::InterruptGuard() {
  received = 0;
  interrupt_before_ = listen_to(SIGINT);
  termination_before_ = listen_to(SIGTERM);
}

InterruptGuard::~InterruptGuard() {
  sigaction(SIGINT, &interrupt_before_, nullptr);
  sigaction(SIGTERM, &termination_before_, nullptr);
}

int InterruptGuard::signal() { return received; }

}  // namespace dynains::program
