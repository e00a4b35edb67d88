#include "atomic_file.hpp"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "paths.hpp"
#include "pulson/core/errors.hpp"

namespace pulson {

namespace fs = std::filesystem;

void fail_to_write(const fs::path& path, const std::string& reason) {
  throw InputError("cannot write " + quoted_path(path) + ": " + reason);
}

std::string last_error() { return std::generic_category().message(errno); }

void require_file_path(const fs::path& path) {
  const PathKind kind = kind_of(path);
  if (path.filename().empty() || kind == PathKind::kFolder) fail_to_write(path, "it is a folder; a file is needed");
  if (kind == PathKind::kSocket || kind > PathKind::kDanglingLink) fail_to_write(path, why_no_file(path));
  const fs::path target = behind_links(path);
  const fs::path folder = target.has_parent_path() ? target.parent_path() : fs::path(".");
  if (!is_folder(folder))
    fail_to_write(path, (target == path ? "" : "it is a link to " + quoted_path(target) + ", and ") +
                            ("there is no folder " + quoted_path(folder)));
}

TemporaryFile::TemporaryFile(const fs::path& target, fs::path named)
    : target_(behind_links(target)), named_(std::move(named)) {
  static std::atomic<unsigned> serial{0};
  path_ = target_.parent_path() /
          fmt::format(".{}.{}-{}.part{}", target_.stem().string(), ::getpid(), serial++, target_.extension().string());
  std::FILE* const file = std::fopen(path_.c_str(), "wbx");
  if (file == nullptr) fail_to_write(named_, last_error());
  std::fclose(file);
}

TemporaryFile::TemporaryFile(TemporaryFile&& other) noexcept
    : target_(std::move(other.target_)), named_(std::move(other.named_)), path_(std::exchange(other.path_, {})) {}

TemporaryFile::~TemporaryFile() {
  std::error_code ignored;
  if (!path_.empty()) fs::remove(path_, ignored);
}

void TemporaryFile::put_in_place() {
  std::error_code error;
  fs::rename(path_, target_, error);
  if (error) fail_to_write(named_, error.message());
  path_.clear();
}

void write_bytes(const fs::path& to, std::string_view contents, const fs::path& named) {
  const int descriptor = ::open(to.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (descriptor < 0) fail_to_write(named, last_error());
  std::string reason;
  while (!contents.empty() && reason.empty()) {
    const ssize_t written = ::write(descriptor, contents.data(), contents.size());
    if (written >= 0)
      contents.remove_prefix(static_cast<std::size_t>(written));
    else if (errno != EINTR)
      reason = last_error();
  }
  if (::close(descriptor) != 0 && reason.empty()) reason = last_error();
  if (!reason.empty()) fail_to_write(named, reason);
}

void check_output_file(const fs::path& path) { require_file_path(path); }

void write_file_atomically(const fs::path& path, std::string_view contents) {
  check_output_file(path);
  if (is_there(path) && !is_file(path)) return write_bytes(path, contents, path);
  TemporaryFile temporary(path, path);
  write_bytes(temporary.path(), contents, path);
  temporary.put_in_place();
}

namespace {

// The folders that this program made, those within first; the empty ones go when it ends.
class MadeFolders {
 public:
  MadeFolders() = default;
  MadeFolders(const MadeFolders&) = delete;
  MadeFolders& operator=(const MadeFolders&) = delete;
  ~MadeFolders() {
    std::error_code not_empty;
    for (const fs::path& folder : folders_) fs::remove(folder, not_empty);
  }
  /// Those of `path` that are not there yet.
  void expect(const fs::path& path) {
    std::error_code error;
    for (fs::path folder = fs::absolute(path, error); folder.has_relative_path() && !is_there(folder);
         folder = folder.parent_path())
      folders_.push_back(folder);
  }

 private:
  std::vector<fs::path> folders_;
};

}  // namespace

void create_output_directory(const fs::path& path) {
  const std::string failure = "cannot use " + quoted_path(path) + " as the folder for output: ";
  if (is_there(path) && !is_folder(path)) throw InputError(failure + "it is a file");
  if (const PathKind kind = kind_of(path); kind >= PathKind::kDanglingLink)
    throw InputError(failure + why_no_file(path));
  std::error_code error;
  static MadeFolders made;
  made.expect(path);
  fs::create_directories(path, error);
  if (error) throw InputError(failure + error.message());
  if (::access(path.c_str(), W_OK | X_OK) != 0) throw InputError(failure + last_error());
}

bool is_still_at(int descriptor, const fs::path& path) {
  struct stat opened {};
  struct stat named {};
  return ::fstat(descriptor, &opened) == 0 && ::stat(path.c_str(), &named) == 0 && opened.st_dev == named.st_dev &&
         opened.st_ino == named.st_ino;
}

namespace {

std::string contents_of(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

/// "another pulson (process 4711)", by the number that it wrote into its lock.
std::string describe_holder(const fs::path& lock) {
  const std::string number = contents_of(lock);
  const std::size_t digits = std::min(number.find_first_not_of("0123456789"), number.size());
  return digits == 0 ? "another pulson" : "another pulson (process " + number.substr(0, digits) + ")";
}

}  // namespace

FolderLock::FolderLock(const fs::path& folder, const std::string& file)
    : path_(folder / ("." + (file.empty() ? "pulson" : file) + ".lock")) {
  for (;;) {
    const int descriptor = ::open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
    if (descriptor < 0) fail_to_write(path_, last_error());
    const bool is_held = ::flock(descriptor, LOCK_EX | LOCK_NB) == 0;
    if (!is_held && errno == EWOULDBLOCK) {
      ::close(descriptor);
      const std::string what = file.empty() ? "into '" + folder.string() : "'" + (folder / file).string();
      throw InputError(describe_holder(path_) + " writes " + what +
                       "' at present; wait until it ends, or choose another folder");
    }
    if (is_held && !is_still_at(descriptor, path_)) {  // its holder ended, and removed it, in between
      ::close(descriptor);
      continue;
    }
    descriptor_ = descriptor;
    const std::string number = std::to_string(::getpid()) + "\n";
    if (::ftruncate(descriptor, 0) != 0 || ::write(descriptor, number.data(), number.size()) < 0) {
      // The number is for messages alone, and what is written next reports a full disk.
    }
    return;
  }
}

FolderLock::~FolderLock() {
  ::unlink(path_.c_str());
  ::close(descriptor_);
}

}  // namespace pulson
