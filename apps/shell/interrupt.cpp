#include "interrupt.hpp"

#include <csignal>

#include <unistd.h>

#include "terminal.hpp"

namespace pulson {
namespace {

volatile std::sig_atomic_t signalled = 0;

void note(int number) {
  signalled = 1;
  std::signal(number, SIG_DFL);
}

// Made before the signal comes: a handler may not allocate.
std::string& loss_line() {
  static std::string line;
  return line;
}

void tell_loss_and_die(int number) {
  const std::string& line = loss_line();
  [[maybe_unused]] const auto written = ::write(STDERR_FILENO, line.data(), line.size());
  std::signal(number, SIG_DFL);
  std::raise(number);
}

void handle_with(void (*handler)(int)) {
  std::signal(SIGINT, handler);
  std::signal(SIGTERM, handler);
}

}  // namespace

Interrupt::Interrupt() {
  signalled = 0;
  handle_with(note);
}

Interrupt::~Interrupt() { handle_with(SIG_DFL); }

bool Interrupt::came() { return signalled != 0; }

LossNotice::LossNotice(const std::string& loss) {
  const std::string erased = is_terminal(STDERR_FILENO) ? kEraseLine : "";
  loss_line() = erased + "pulson: " + loss + "\n";
  handle_with(tell_loss_and_die);
}

LossNotice::~LossNotice() { handle_with(SIG_DFL); }

}  // namespace pulson
