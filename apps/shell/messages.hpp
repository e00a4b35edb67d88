#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/App.hpp>

#include "printing.hpp"

namespace pulson {

/// What takes the line away on which a terminal's cursor is.
inline constexpr char kEraseLine[] = "\r\x1b[K";

bool is_terminal(int descriptor);

/// Columns of the terminal behind `descriptor`; `otherwise` where it is none.
std::size_t terminal_width(int descriptor, std::size_t otherwise);

enum class Style { kError, kWarning, kNote };

/// `text` in the style's colour where `descriptor` is a terminal that shows colours and nobody set NO_COLOR
/// (no-color.org), else as it is.
std::string painted(Style style, std::string_view text, int descriptor);

/// Characters of UTF-8 text, each of which is taken to be a column wide.
std::size_t columns(std::string_view text);

/// The first `count` characters of UTF-8 text, or all.
std::string first_columns(std::string_view text, std::size_t count);

/// The text with blanks up to the width in columns, at least one.
std::string padded(const std::string& text, std::size_t width);

/// Prints rows, one or more, each column as wide as its widest cell.
void print_table(const std::vector<std::vector<std::string>>& rows);

/// "a, b and c".
std::string joined_words(const std::vector<std::string>& words);

/// "1 pair of landmarks", "2 pairs of landmarks".
std::string counted(std::int64_t count, std::string_view noun, std::string_view rest = {});

/// How much the program prints: results and notes; warnings and errors only; or every step as well.
enum class Verbosity { kQuiet, kNormal, kVerbose };

Verbosity verbosity();
/// It is normal again.
void forget_verbosity();

/// `--quiet`, which every verb has.
void add_quiet_option(CLI::App& verb);
/// `--verbose`, which every verb has.
void add_verbose_option(CLI::App& verb);

// All go to standard error, one line each, and standard output is written out before.

/// "pulson: ", for what ends the program.
void print_error(std::string_view text);
/// "warning: ", always.
void print_warning(std::string_view text);
/// "note: ", unless quiet.
void print_note(std::string_view text);
void print_notes(const std::vector<std::string>& notes);
/// Each note once, in order: a file that holds both shapes says the same of each.
std::vector<std::string> without_repeats(const std::vector<std::string>& notes);
/// A step taken and the seconds since the program began, where that is asked for.
void log_step(std::string_view text);

/// Of a clock that is never set.
double seconds_now();

/// A line of progress on a terminal, rewritten in place; nothing in a pipe, nothing in the first second, nothing where
/// --quiet is given. It goes away at the end, and where Ctrl-C ends the program.
class Progress {
 public:
  Progress();
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Where nobody knows how much is left. With --verbose the line is kept, on a terminal or not.
  void show(const std::string& text);
  /// A bar, the percentage and the time left, where the part that is done is known, from 0 to 1. A part that is less
  /// than the last one starts anew.
  void show(double fraction, const std::string& text);
  /// Takes the line away, so that something else can be printed.
  void clear();

 private:
  bool is_time_to_draw();
  void draw(const std::string& text);
  /// Seconds left, smoothed.
  double left(double fraction);

  double started_;
  double shown_ = 0;     ///< when; 0 where there is no line now
  double begun_;         ///< of the work that the fractions are of
  double fraction_ = 2;  ///< the last one; more than all, so that the first begins
  double first_ = 0;     ///< the one at `begun_`: work that was done before
  double left_ = -1;     ///< seconds, as last estimated; negative: not yet
  double estimated_ = 0;
  bool on_terminal_;
};

/// "45 s", "3 min", "1.5 h"
std::string duration_text(double seconds);

/// While there is one, Ctrl-C and the signal to terminate are noted and not obeyed at once, so that work can be put in
/// order. A second signal ends the program.
class Interrupt {
 public:
  Interrupt();
  ~Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;

  /// @throws HostStopped where a host that keeps nothing ends the work
  static bool came();
};

/// While there is one, Ctrl-C and the signal to terminate print a line on standard error that says what is lost, before
/// they end the program. One at a time. An Interrupt that begins meanwhile takes over from it.
class LossNotice {
 public:
  /// @param loss as in "interrupted: the search is lost"
  explicit LossNotice(const std::string& loss);
  ~LossNotice();
  LossNotice(const LossNotice&) = delete;
  LossNotice& operator=(const LossNotice&) = delete;
};

}  // namespace pulson
