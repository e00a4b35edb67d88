#include "draw/gnuplot.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>

#include <fmt/format.h>

#include "child_process.hpp"
#include "core/text.hpp"
#include "pulson/core/errors.hpp"

namespace pulson {
namespace {

namespace fs = std::filesystem;

constexpr const char* kGnuplot = "gnuplot";
constexpr const char* kNoGnuplot =
    "gnuplot was not found; install it (Debian: gnuplot-nox) or put the folder that holds it on PATH";

/// gnuplot prints the offending line, a caret and then `"/dev/stdin" line N: message`, which is what a user can act on.
std::string gnuplot_error(const std::string& text) {
  const std::string mark = "\"/dev/stdin\" ";
  const std::size_t place = text.find(mark);
  const std::size_t begin = place == std::string::npos ? text.find_first_not_of(" \t\n^") : place + mark.size();
  if (begin == std::string::npos) return "it printed no message";
  return text.substr(begin, text.find('\n', begin) - begin);
}

void run_script(const std::string& script) {
  const picture::File input = picture::make_scratch_file(kGnuplot);
  if (std::fwrite(script.data(), 1, script.size(), input.get()) != script.size() || std::fflush(input.get()) != 0)
    throw InputError(fmt::format("cannot write the script for gnuplot: {}", std::strerror(errno)));
  std::rewind(input.get());
  // -d: without the user's own start-up file. Named as a file, standard input is read three times as fast.
  picture::ChildProcess gnuplot({kGnuplot, "-d", "/dev/stdin"}, fileno(input.get()), kNoGnuplot);
  if (!gnuplot.wait()) throw InputError("gnuplot failed: " + gnuplot_error(gnuplot.printed()));
}

}  // namespace

Gnuplot::Gnuplot() = default;
Gnuplot::~Gnuplot() = default;

void Gnuplot::command(std::string_view text) {
  script_ += text;
  script_ += '\n';
}

std::string Gnuplot::add_block(std::string_view rows) {
  std::string name = fmt::format("$block{}", blocks_++);
  script_ += fmt::format("{} << END_OF_BLOCK\n{}", name, rows);
  script_ += rows.ends_with('\n') ? "END_OF_BLOCK\n" : "\nEND_OF_BLOCK\n";
  return name;
}

void Gnuplot::set_output(const fs::path& file) {
  // An absolute name cannot begin with '|' or '~', which gnuplot would take for a command or a home folder.
  require_file_path(file);
  const fs::path absolute = fs::absolute(file);
  const std::string name = absolute.string();
  if (std::any_of(name.begin(), name.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20; }))
    throw InputError(fmt::format("cannot write '{}': the name holds a control character", file.string()));

  const fs::path& temporary = outputs_.emplace_back(absolute, file).path();
  std::string doubled;
  for (const char c : temporary.string()) doubled += c == '\'' ? "''" : std::string(1, c);
  command("set output '" + doubled + "'");
}

void Gnuplot::run() {
  command("unset output");
  run_script(script_);
  for (const TemporaryFile& output : outputs_) picture::require_written(kGnuplot, output);
  for (TemporaryFile& output : outputs_) output.put_in_place();
}

bool Gnuplot::is_installed() { return picture::is_on_path(kGnuplot); }

std::string Gnuplot::quoted(std::string_view text) {
  std::string result = "'";
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = utf8_length(text, i);
    const auto byte = static_cast<unsigned char>(text[i]);
    if (length == 0) {
      result += '?';
    } else if (byte < 0x20 || byte == 0x7F) {
      result += ' ';
    } else if (byte == '\'') {
      result += "''";
    } else {
      result += text.substr(i, length);
    }
    i += std::max<std::size_t>(length, 1);
  }
  return result + "'";
}

}  // namespace pulson
