#include "messages.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <set>

#include <fmt/core.h>
#include <fmt/ranges.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "core/text.hpp"
#include "host.hpp"
#include "options.hpp"
#include "ranks.hpp"

namespace pulson {

namespace {

bool shows_colours(int descriptor) {
  const char* const forbidden = std::getenv("NO_COLOR");
  if (forbidden != nullptr && *forbidden != '\0') return false;
  const char* const kind = std::getenv("TERM");
  return kind != nullptr && *kind != '\0' && std::string_view(kind) != "dumb" && is_terminal(descriptor);
}

std::string_view code_of(Style style) {
  switch (style) {
    case Style::kError:
      return "\x1b[1;31m";
    case Style::kWarning:
      return "\x1b[33m";
    case Style::kNote:
      return "\x1b[2m";
  }
  return "";
}

}  // namespace

bool is_terminal(int descriptor) { return ::isatty(descriptor) != 0; }

std::size_t terminal_width(int descriptor, std::size_t otherwise) {
  winsize size{};
  if (!is_terminal(descriptor) || ::ioctl(descriptor, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return otherwise;
  return size.ws_col;
}

std::string painted(Style style, std::string_view text, int descriptor) {
  if (!shows_colours(descriptor)) return std::string(text);
  return std::string(code_of(style)) + std::string(text) + "\x1b[0m";
}

std::size_t columns(std::string_view text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), begins_character));
}

std::string first_columns(std::string_view text, std::size_t count) {
  std::size_t end = 0;
  for (std::size_t seen = 0; end < text.size(); ++end)
    if (begins_character(text[end]) && seen++ == count) break;
  return std::string(text.substr(0, end));
}

namespace {

using Clock = std::chrono::steady_clock;

const Clock::time_point kBegin = Clock::now();
Verbosity chosen_verbosity = Verbosity::kNormal;

// Where it cannot be written, nothing can be reported.
void write_to_stderr(std::string_view text) noexcept { std::fwrite(text.data(), 1, text.size(), stderr); }

void print_message(Style style, std::string_view name, std::string_view text) {
  if (!ranks::is_first()) return;
  std::string line = in_option_words(text);
  if (host() != nullptr) {
    host()->message(style, line);
    return;
  }
  std::fflush(stdout);
  std::replace_if(
      line.begin(), line.end(), [](char c) { return c == '\n' || c == '\r' || c == '\t'; }, ' ');
  write_to_stderr(fmt::format("{} {}\n", painted(style, name, STDERR_FILENO), shown(line)));
}

}  // namespace

std::string padded(const std::string& text, std::size_t width) {
  const std::size_t letters = columns(text);  // fmt would count bytes
  return text + std::string(width > letters ? width - letters : 1, ' ');
}

void print_table(const std::vector<std::vector<std::string>>& rows) {
  std::vector<std::size_t> widths(rows.front().size());
  for (const auto& row : rows)
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], columns(row[i]) + 2);
  for (const auto& row : rows) {
    std::string line;
    for (std::size_t i = 0; i < row.size(); ++i) line += padded(row[i], widths[i]);
    line.erase(line.find_last_not_of(' ') + 1);
    print_text("{}\n", line);
  }
}

std::string joined_words(const std::vector<std::string>& words) {
  if (words.size() < 2) return words.empty() ? std::string() : words.front();
  return fmt::format("{} and {}", fmt::join(words.begin(), words.end() - 1, ", "), words.back());
}

std::string counted(std::int64_t count, std::string_view noun, std::string_view rest) {
  return fmt::format("{}{}{}", text::counted(static_cast<std::size_t>(count), noun), rest.empty() ? "" : " ", rest);
}

Verbosity verbosity() { return chosen_verbosity; }
void forget_verbosity() { chosen_verbosity = Verbosity::kNormal; }

void add_quiet_option(CLI::App& verb) {
  verb.add_flag_callback(
      "-q,--quiet", [] { chosen_verbosity = Verbosity::kQuiet; }, "print warnings and errors only");
}

void add_verbose_option(CLI::App& verb) {
  CLI::Option* verbose = verb.add_flag_callback(
      "-v,--verbose", [] { chosen_verbosity = Verbosity::kVerbose; }, "log each step with its time, on standard error");
  if (CLI::Option* quiet = verb.get_option_no_throw("--quiet")) verbose->excludes(quiet);
}

void print_error(std::string_view text) { print_message(Style::kError, "pulson:", text); }

void print_warning(std::string_view text) { print_message(Style::kWarning, "warning:", text); }

void print_note(std::string_view text) {
  if (chosen_verbosity != Verbosity::kQuiet) print_message(Style::kNote, "note:", text);
}

void print_notes(const std::vector<std::string>& notes) {
  for (const std::string& note : without_repeats(notes)) print_note(note);
}

std::vector<std::string> without_repeats(const std::vector<std::string>& notes) {
  std::set<std::string> seen;
  std::vector<std::string> kept;
  for (const std::string& note : notes)
    if (seen.insert(note).second) kept.push_back(note);
  return kept;
}

void log_step(std::string_view text) {
  if (chosen_verbosity != Verbosity::kVerbose) return;
  const double seconds = std::chrono::duration<double>(Clock::now() - kBegin).count();
  print_message(Style::kNote, fmt::format("{:8.3f} s", seconds), text);
}

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
      on_terminal_(ranks::is_first() && is_terminal(STDERR_FILENO) && verbosity() != Verbosity::kQuiet) {}

Progress::~Progress() { clear(); }

void Progress::clear() {
  if (shown_ == 0) return;
  write_to_stderr(kEraseLine);
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
  write_to_stderr(kEraseLine + first_columns(shown(text), std::max<std::size_t>(width, 2) - 1));
  std::fflush(stderr);
}

namespace {

volatile std::sig_atomic_t signalled = 0;
int interrupts = 0;  // those that live, whose owners look themselves whether one came

// Tells the host, where there is one. @return whether there is @throws HostStopped
bool tell_host(double fraction, const std::string& text) {
  if (host() == nullptr) return false;
  if (interrupts == 0 && host()->interrupted()) throw HostStopped();
  host()->progress(fraction, text);
  return true;
}

}  // namespace

void Progress::show(const std::string& text) {
  if (tell_host(-1, text)) return;
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
  if (tell_host(fraction, text)) return;
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

namespace {

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

/// Of what mpirun sends before it kills: SIGCONT, a second later SIGTERM, a second later SIGKILL. The first says
/// already that the run is to end, and the second says nothing new.
void note_end_of_ranks(int number, siginfo_t* info, void* /*context*/) {
  if (number == SIGCONT && info->si_pid != ::getppid()) return;  // from a shell or a scheduler: go on
  signalled = 1;
}

void handle_signals_of_mpirun() {
  struct sigaction action {};
  action.sa_sigaction = note_end_of_ranks;
  action.sa_flags = SA_SIGINFO | SA_RESTART;
  for (const int number : {SIGCONT, SIGTERM}) ::sigaction(number, &action, nullptr);
}

}  // namespace

Interrupt::Interrupt() {
  ++interrupts;
  signalled = 0;
  if (host() != nullptr) return;
  handle_with(note);
  if (ranks::are_of_mpirun()) handle_signals_of_mpirun();
}

Interrupt::~Interrupt() {
  --interrupts;
  if (host() != nullptr) return;
  if (ranks::are_of_mpirun() && signalled != 0) return;  // SIGTERM is still to come, while the results are written
  handle_with(SIG_DFL);
  if (ranks::are_of_mpirun()) std::signal(SIGCONT, SIG_DFL);
}

bool Interrupt::came() {
  if (host() == nullptr) return signalled != 0;
  if (host()->interrupted() && host()->numbers_only) throw HostStopped();  // nothing is kept
  return host()->interrupted();
}

LossNotice::LossNotice(const std::string& loss) {
  if (host() != nullptr) return;
  const std::string erased = is_terminal(STDERR_FILENO) ? kEraseLine : "";
  loss_line() = erased + "pulson: " + shown(loss) + "\n";
  handle_with(tell_loss_and_die);
}

LossNotice::~LossNotice() {
  if (host() == nullptr) replace_handler(tell_loss_and_die, SIG_DFL);
}

}  // namespace pulson
