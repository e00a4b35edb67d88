#include "draw/gnuplot.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <sstream>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "core/text.hpp"
#include "gnuplot.hpp"
#include "pulson/core/errors.hpp"

extern char** environ;  // NOLINT(readability-redundant-declaration): only some systems declare it

namespace pulson::draw {

namespace fs = std::filesystem;

File make_scratch_file(std::string_view program) {
  File file(std::tmpfile(), &std::fclose);
  if (!file) throw InputError(fmt::format("cannot make a temporary file for {}: {}", program, std::strerror(errno)));
  fcntl(fileno(file.get()), F_SETFD, FD_CLOEXEC);
  return file;
}

bool is_on_path(std::string_view program) {
  const char* const search_path = std::getenv("PATH");
  std::istringstream folders(search_path != nullptr ? search_path : "/usr/bin:/bin");
  for (std::string folder; std::getline(folders, folder, ':');)
    if (::access((fs::path(folder) / program).c_str(), X_OK) == 0) return true;
  return false;
}

ChildProcess::ChildProcess(std::vector<std::string> arguments, int input, std::string not_found)
    : program_(arguments.front()), not_found_(std::move(not_found)), printed_(make_scratch_file(program_)) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, input, STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, fileno(printed_.get()), STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, fileno(printed_.get()), STDERR_FILENO);
  std::vector<char*> pointers;
  for (std::string& argument : arguments) pointers.push_back(argument.data());
  pointers.push_back(nullptr);
  const int failure = posix_spawnp(&child_, program_.c_str(), &actions, nullptr, pointers.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failure == ENOENT || failure == EACCES || failure == ENOTDIR) throw InputError(not_found_);
  if (failure != 0) throw InputError(fmt::format("{} could not be started: {}", program_, std::strerror(failure)));
}

ChildProcess::~ChildProcess() {
  if (child_ == 0) return;
  ::kill(child_, SIGKILL);
  while (waitpid(child_, nullptr, 0) < 0 && errno == EINTR) {
  }
}

bool ChildProcess::wait() {
  const pid_t child = std::exchange(child_, 0);
  int status = 0;
  while (waitpid(child, &status, 0) < 0)
    if (errno != EINTR) throw InputError(fmt::format("{} was lost: {}", program_, std::strerror(errno)));
  if (WIFEXITED(status) && WEXITSTATUS(status) == 127) throw InputError(not_found_);
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

std::string ChildProcess::printed() const {
  std::rewind(printed_.get());
  std::string text;
  std::array<char, 4096> buffer;
  while (const std::size_t n = std::fread(buffer.data(), 1, buffer.size(), printed_.get()))
    text.append(buffer.data(), n);
  return text;
}

namespace {

/// The last bytes of a file, fewer where it is shorter.
std::string tail_of(const fs::path& path) {
  constexpr std::streamoff kLength = 64;
  std::ifstream stream(path, std::ios::binary | std::ios::ate);
  const std::streamoff size = stream ? static_cast<std::streamoff>(stream.tellg()) : 0;
  stream.seekg(std::max<std::streamoff>(0, size - kLength));
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

/// Whether a picture has an end; of formats without a mark at the end, whether it has a beginning.
bool is_whole(const fs::path& path) {
  const std::string tail = tail_of(path);
  if (path.extension() == ".png") return tail.find("IEND") != std::string::npos;
  if (path.extension() == ".pdf") return tail.find("%%EOF") != std::string::npos;
  if (path.extension() == ".svg") return tail.find("</svg>") != std::string::npos;
  return !tail.empty();
}

}  // namespace

void require_written(std::string_view program, const TemporaryFile& file) {
  if (is_whole(file.path())) return;
  // Picture programs do not report a full disk, and leave what they had.
  std::error_code failure;
  constexpr std::uintmax_t kNearlyNothing = 65536;
  if (const fs::space_info space = fs::space(file.path().parent_path(), failure);
      !failure && space.available < kNearlyNothing)
    fail_to_write(file.named(), std::strerror(ENOSPC));
  throw InputError(fmt::format("{} did not write '{}'", program, file.named().string()));
}

namespace {

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
  const File input = make_scratch_file(kGnuplot);
  if (std::fwrite(script.data(), 1, script.size(), input.get()) != script.size() || std::fflush(input.get()) != 0)
    throw InputError(fmt::format("cannot write the script for gnuplot: {}", std::strerror(errno)));
  std::rewind(input.get());
  // -d: without the user's own start-up file. Named as a file, standard input is read three times as fast.
  ChildProcess gnuplot({kGnuplot, "-d", "/dev/stdin"}, fileno(input.get()), kNoGnuplot);
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
  for (const TemporaryFile& output : outputs_) require_written(kGnuplot, output);
  for (TemporaryFile& output : outputs_) output.put_in_place();
}

bool Gnuplot::is_installed() { return is_on_path(kGnuplot); }

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

}  // namespace pulson::draw
