#include "paths.hpp"

#include <algorithm>
#include <cerrno>
#include <map>
#include <mutex>
#include <string_view>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "pulson/core/errors.hpp"

namespace pulson {

namespace fs = std::filesystem;

namespace {

constexpr int kMostLinks = 40;  // as Linux follows

/// The system would take the name to end at a zero byte.
bool holds_zero_byte(const fs::path& path) noexcept { return path.native().find('\0') != std::string::npos; }

bool is_link(const fs::path& path) noexcept {
  struct stat facts {};
  return !holds_zero_byte(path) && ::lstat(path.c_str(), &facts) == 0 && S_ISLNK(facts.st_mode);
}

PathKind kind_of_mode(mode_t mode) noexcept {
  if (S_ISREG(mode)) return PathKind::kFile;
  if (S_ISDIR(mode)) return PathKind::kFolder;
  if (S_ISFIFO(mode)) return PathKind::kPipe;
  if (S_ISSOCK(mode)) return PathKind::kSocket;
  return PathKind::kDevice;
}

PathKind kind_of_fault(int error, const fs::path& path) noexcept {
  switch (error) {
    case ENOENT:
      return is_link(path) ? PathKind::kDanglingLink : PathKind::kMissing;
    case ENOTDIR:
      return PathKind::kMissing;
    case ELOOP:
      return PathKind::kLinkLoop;
    case ENAMETOOLONG:
      return PathKind::kNameTooLong;
    case EACCES:
      return PathKind::kForbidden;
    default:
      return PathKind::kUnreadable;
  }
}

}  // namespace

PathKind kind_of(const fs::path& path) noexcept {
  if (holds_zero_byte(path)) return PathKind::kUnreadable;
  struct stat facts {};
  if (::stat(path.c_str(), &facts) != 0) return kind_of_fault(errno, path);
  return kind_of_mode(facts.st_mode);
}

bool is_file(const fs::path& path) noexcept { return kind_of(path) == PathKind::kFile; }

bool is_folder(const fs::path& path) noexcept { return kind_of(path) == PathKind::kFolder; }

bool is_there(const fs::path& path) noexcept { return kind_of(path) <= PathKind::kDevice; }

std::string quoted_path(const fs::path& path) {
  constexpr std::size_t kLong = 200, kKept = 60;
  const std::string& name = path.native();
  if (name.size() <= kLong) return "'" + name + "'";
  return fmt::format("'{}…{}' ({} bytes)", name.substr(0, kKept), name.substr(name.size() - kKept), name.size());
}

std::string why_no_file(const fs::path& path) {
  switch (kind_of(path)) {
    case PathKind::kFile:
    case PathKind::kMissing:
      return {};
    case PathKind::kFolder:
      return "it is a folder; a file is needed";
    case PathKind::kPipe:
      return "it is a named pipe; a file is needed";
    case PathKind::kSocket:
      return "it is a socket; a file is needed";
    case PathKind::kDevice:
      return "it is a device; a file is needed";
    case PathKind::kDanglingLink:
      return fmt::format("it is a link to {}, which is missing", quoted_path(behind_links(path)));
    case PathKind::kLinkLoop:
      return "its links form a loop";
    case PathKind::kNameTooLong:
      return "the name is too long";
    case PathKind::kForbidden:
      return "a folder on the way to it may not be read; its permissions must allow that";
    case PathKind::kUnreadable:
      break;
  }
  return holds_zero_byte(path) ? "the name holds a zero byte" : "the disk or the network failed, or the name is wrong";
}

fs::path behind_links(const fs::path& path) {
  fs::path at = path;
  for (int followed = 0; is_link(at); ++followed) {
    std::error_code error;
    const fs::path target = fs::read_symlink(at, error);
    if (error || followed == kMostLinks) return path;
    at = at.parent_path() / target;  // `target` where it is absolute
  }
  return at;
}

void remove_quietly(const fs::path& path) noexcept {
  std::error_code ignored;
  fs::remove(path, ignored);
}

std::optional<FileIdentity> identity_of(const fs::path& path) {
  if (holds_zero_byte(path)) return std::nullopt;
  std::error_code error;
  fs::path at = fs::absolute(behind_links(path), error);
  if (error) return std::nullopt;
  fs::path rest;
  for (struct stat facts{};; at = at.parent_path()) {
    if (::stat(at.empty() ? "/" : at.c_str(), &facts) == 0)
      return FileIdentity{facts.st_dev, facts.st_ino, rest.lexically_normal().string()};
    if ((errno != ENOENT && errno != ENOTDIR) || !at.has_relative_path()) return std::nullopt;
    rest = rest.empty() ? at.filename() : at.filename() / rest;
  }
}

namespace {

[[noreturn]] void fail_to_read(const std::string& name, const std::string& reason) {
  throw InputError(fmt::format("cannot read {}: {}", name, reason));
}

std::string size_text(std::uint64_t bytes) {
  if (bytes >= 1ULL << 30) return fmt::format("{} GiB", bytes >> 30);
  if (bytes >= 1ULL << 20) return fmt::format("{} MiB", bytes >> 20);
  return fmt::format("{} bytes", bytes);
}

[[noreturn]] void fail_as_too_long(const std::string& name, std::uint64_t most) {
  fail_to_read(name, "it holds more than " + size_text(most));
}

/// Of this process: a pipe there has no name in a folder, and its writer is this command's.
bool is_of_descriptors(const fs::path& path) {
  const std::string& name = path.native();
  const auto begins = [&](std::string_view prefix) { return name.rfind(prefix, 0) == 0; };
  return name == "/dev/stdin" || begins("/dev/fd/") || begins("/proc/self/fd/");
}

class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  int number() const { return number_; }

 private:
  int number_;
};

}  // namespace

std::string read_descriptor(int descriptor, const std::string& name, std::uint64_t most) {
  constexpr std::size_t kPiece = 1 << 16;
  struct stat facts {};
  if (::fstat(descriptor, &facts) != 0) fail_to_read(name, std::generic_category().message(errno));
  const auto size = S_ISREG(facts.st_mode) ? static_cast<std::uint64_t>(facts.st_size) : 0;
  if (size > most) fail_as_too_long(name, most);
  std::string contents;
  contents.resize(size + kPiece);  // a file may grow, and those of /proc have the size 0
  std::size_t length = 0;
  for (;;) {
    const ssize_t count = ::read(descriptor, contents.data() + length, contents.size() - length);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail_to_read(name, std::generic_category().message(errno));
    if (count == 0) break;
    length += static_cast<std::size_t>(count);
    if (length > most) fail_as_too_long(name, most);
    if (length == contents.size()) contents.resize(2 * length);
  }
  contents.resize(length);
  return contents;
}

namespace {

/// What a pipe held is kept: some files are read twice.
std::string read_pipe(int descriptor, const struct stat& facts, const std::string& name, std::uint64_t most) {
  static std::mutex mutex;
  static std::map<ino_t, std::string> kept;
  const std::lock_guard lock(mutex);
  if (const auto found = kept.find(facts.st_ino); found != kept.end()) return found->second;
  ::fcntl(descriptor, F_SETFL, 0);  // waits for its writer
  return kept[facts.st_ino] = read_descriptor(descriptor, name, most);
}

}  // namespace

std::string read_file(const fs::path& path, std::uint64_t most) {
  const std::string name = quoted_path(path);
  const auto is_readable = [&](PathKind kind) {
    return kind == PathKind::kFile || (kind == PathKind::kPipe && is_of_descriptors(path));
  };
  // Before it is opened, as that can wait for ever, or move a tape.
  if (const PathKind kind = kind_of(path); !is_readable(kind) && kind != PathKind::kMissing)
    fail_to_read(name, why_no_file(path));
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
  if (file.number() < 0) fail_to_read(name, std::generic_category().message(errno));
  struct stat facts {};
  if (::fstat(file.number(), &facts) != 0 || !is_readable(kind_of_mode(facts.st_mode)))
    fail_to_read(name, "it is no file");
  if (S_ISFIFO(facts.st_mode)) return read_pipe(file.number(), facts, name, std::min(most, kMostPiped));
  return read_descriptor(file.number(), name, most);
}

}  // namespace pulson
