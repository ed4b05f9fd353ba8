#include "interrupt.hpp"

#include <csignal>

namespace dynains::program {
namespace {

// A signal handler can reach nothing but a global.
volatile std::sig_atomic_t received = 0;

void remember(int signal) { received = signal; }

void handle(int signal, void (*handler)(int), int flags) {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = flags;
  sigemptyset(&action.sa_mask);
  sigaction(signal, &action, nullptr);
}

}  // namespace

InterruptGuard::InterruptGuard() {
  received = 0;
  const int flags = static_cast<int>(SA_RESTART | SA_RESETHAND);
  handle(SIGINT, remember, flags);
  handle(SIGTERM, remember, flags);
}

InterruptGuard::~InterruptGuard() {
  handle(SIGINT, SIG_DFL, 0);
  handle(SIGTERM, SIG_DFL, 0);
}

int InterruptGuard::signal() { return received; }

}  // namespace dynains::program
