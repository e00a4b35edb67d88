#include "interrupt.hpp"

#include <csignal>

namespace pulson {
namespace {

volatile std::sig_atomic_t signalled = 0;

void note(int number) {
  signalled = 1;
  std::signal(number, SIG_DFL);
}

}  // namespace

Interrupt::Interrupt() {
  signalled = 0;
  std::signal(SIGINT, note);
  std::signal(SIGTERM, note);
}

Interrupt::~Interrupt() {
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
}

bool Interrupt::came() { return signalled != 0; }

}  // namespace pulson
