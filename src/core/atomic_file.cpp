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

namespace {

/// Writes `contents` to `to`; messages name `path`.
void write_all(const fs::path& to, std::string_view contents, const fs::path& path) {
  std::FILE* const file = std::fopen(to.c_str(), "wb");
  if (file == nullptr) fail_to_write(path, last_error());
  const bool is_written =
      std::fwrite(contents.data(), 1, contents.size(), file) == contents.size() && std::fflush(file) == 0;
  const std::string reason = is_written ? "" : last_error();
  const bool is_closed = std::fclose(file) == 0;
  if (!is_written) fail_to_write(path, reason);
  if (!is_closed) fail_to_write(path, last_error());
}

}  // namespace

void check_output_file(const fs::path& path) { require_file_path(path); }

void write_file_atomically(const fs::path& path, std::string_view contents) {
  check_output_file(path);
  if (is_there(path) && !is_file(path)) return write_all(path, contents, path);
  TemporaryFile temporary(path, path);
  write_all(temporary.path(), contents, path);
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

namespace {

std::string contents_of(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

/// Whether the file at `path` is the one that is open.
bool is_still_at(int descriptor, const fs::path& path) {
  struct stat opened {};
  struct stat named {};
  return ::fstat(descriptor, &opened) == 0 && ::stat(path.c_str(), &named) == 0 && opened.st_dev == named.st_dev &&
         opened.st_ino == named.st_ino;
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

namespace {

constexpr std::string_view kStaged = ".part-";

/// Removes the folders of processes that are no more: their locks ended with them. Where the file system has no locks,
/// nothing is removed.
void remove_abandoned(const fs::path& folder) {
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored)) {
    if (!entry.path().filename().string().starts_with(kStaged)) continue;
    const int descriptor = ::open(entry.path().c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    if (descriptor < 0) continue;
    if (::flock(descriptor, LOCK_EX | LOCK_NB) == 0) fs::remove_all(entry.path(), ignored);
    ::close(descriptor);
  }
}

}  // namespace

StagedFiles::StagedFiles(const fs::path& folder) : folder_(folder) {
  remove_abandoned(folder);
  for (int serial = 0;; ++serial) {  // on another machine there may be a process of the same number
    staged_ = folder / fmt::format("{}{}-{}", kStaged, ::getpid(), serial);
    if (::mkdir(staged_.c_str(), 0777) != 0) {
      if (errno == EEXIST) continue;
      fail_to_write(staged_, last_error());
    }
    descriptor_ = ::open(staged_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (descriptor_ >= 0) ::flock(descriptor_, LOCK_SH);
    std::error_code ignored;
    if (descriptor_ < 0 ? fs::exists(staged_, ignored) : is_still_at(descriptor_, staged_)) return;
    if (descriptor_ >= 0) ::close(descriptor_);  // another process took it for abandoned before it was locked
  }
}

StagedFiles::~StagedFiles() {
  std::error_code ignored;
  fs::remove_all(staged_, ignored);
  if (descriptor_ >= 0) ::close(descriptor_);
}

void StagedFiles::write(const std::string& name, std::string_view contents) const {
  write_all(file(name), contents, folder_ / name);
}

void StagedFiles::commit() {
  std::vector<fs::path> moved;
  for (const fs::directory_entry& entry : fs::directory_iterator(staged_)) {
    const fs::path target = folder_ / entry.path().filename();
    std::error_code ignored;
    const fs::file_status status = fs::symlink_status(target, ignored);
    if (fs::exists(status) && !fs::is_regular_file(status))
      write_file_atomically(target, contents_of(entry.path()));
    else
      moved.push_back(entry.path());
  }
  for (const fs::path& file : moved) {
    std::error_code error;
    fs::rename(file, folder_ / file.filename(), error);
    if (error) fail_to_write(folder_ / file.filename(), error.message());
  }
}

}  // namespace pulson
