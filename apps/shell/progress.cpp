#include "progress.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>

#include <fmt/core.h>
#include <unistd.h>

#include "messages.hpp"
#include "terminal.hpp"

namespace pulson {
namespace {

constexpr double kSilence = 1;     // seconds at the start
constexpr double kInterval = 0.1;  // seconds between two lines
constexpr double kMemory = 3;      // seconds over which the time left is smoothed
constexpr std::size_t kBar = 20;

void erase_and_die(int number) {
  [[maybe_unused]] const auto written = ::write(STDERR_FILENO, kEraseLine, sizeof kEraseLine - 1);
  std::signal(number, SIG_DFL);
  std::raise(number);
}

// Only where nobody else listens: verbs that put their work in order clear the line themselves.
void replace_handler(void (*expected)(int), void (*handler)(int)) {
  for (const int number : {SIGINT, SIGTERM}) {
    struct sigaction action {};
    if (::sigaction(number, nullptr, &action) == 0 && action.sa_handler == expected) std::signal(number, handler);
  }
}

std::string bar(double fraction) {
  const auto full = static_cast<std::size_t>(std::lround(fraction * kBar));
  return '[' + std::string(full, '#') + std::string(kBar - full, '.') + ']';
}

}  // namespace

double seconds_now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::string duration_text(double seconds) {
  if (seconds < 90) return fmt::format("{:.0f} s", seconds);
  if (seconds < 5400) return fmt::format("{:.0f} min", seconds / 60);
  return fmt::format("{:.1f} h", seconds / 3600);
}

Progress::Progress()
    : started_(seconds_now()),
      begun_(started_),
      on_terminal_(is_terminal(STDERR_FILENO) && verbosity() != Verbosity::kQuiet) {}

Progress::~Progress() { clear(); }

void Progress::clear() {
  if (shown_ == 0) return;
  fmt::print(stderr, "{}", kEraseLine);
  std::fflush(stderr);
  shown_ = 0;
  replace_handler(erase_and_die, SIG_DFL);
}

bool Progress::is_time_to_draw() {
  const double time = seconds_now();
  return on_terminal_ && time - started_ >= kSilence && time - shown_ >= kInterval;
}

void Progress::draw(const std::string& text) {
  if (shown_ == 0) replace_handler(SIG_DFL, erase_and_die);
  shown_ = seconds_now();
  constexpr std::size_t kUsual = 80;
  const std::size_t width = terminal_width(STDERR_FILENO, kUsual);
  fmt::print(stderr, "{}{}", kEraseLine, first_columns(text, std::max<std::size_t>(width, 2) - 1));
  std::fflush(stderr);
}

void Progress::show(const std::string& text) {
  if (verbosity() == Verbosity::kVerbose) {
    clear();
    log_step(text);
  } else if (is_time_to_draw()) {
    draw(text);
  }
}

double Progress::left(double fraction) {
  const double time = seconds_now();
  const double estimate = (time - begun_) * (1 - fraction) / (fraction - first_);
  if (left_ < 0) {
    left_ = estimate;
  } else {
    const double passed = time - estimated_;
    const double weight = 1 - std::exp(-passed / kMemory);
    left_ = (1 - weight) * std::max(0.0, left_ - passed) + weight * estimate;
  }
  estimated_ = time;
  return left_;
}

void Progress::show(double fraction, const std::string& text) {
  fraction = std::clamp(fraction, 0.0, 1.0);
  if (fraction < fraction_) {
    begun_ = seconds_now();
    first_ = fraction;
    left_ = -1;
  }
  fraction_ = fraction;
  if (!is_time_to_draw()) return;
  const std::string rest = fraction > first_ ? duration_text(left(fraction)) + " left" : "";
  draw(fmt::format("{} {:3.0f} % {:>10}  {}", bar(fraction), 100 * fraction, rest, text));
}

}  // namespace pulson
