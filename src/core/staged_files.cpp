#include "staged_files.hpp"

#include <cerrno>
#include <memory>
#include <ranges>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "atomic_file.hpp"
#include "paths.hpp"
#include "pulson/core/errors.hpp"

namespace pulson {

namespace fs = std::filesystem;

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

void rename_file(const fs::path& from, const fs::path& to, const fs::path& named) {
  std::error_code error;
  fs::rename(from, to, error);
  if (error) fail_to_write(named, error.message());
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
  for (const std::string& name : names_) fs::remove(staged_ / name, ignored);
  if (!fs::remove(staged_, ignored)) fs::remove_all(staged_, ignored);  // which opens the folder, and may fail
  if (descriptor_ >= 0) ::close(descriptor_);
}

void StagedFiles::write(const std::string& name, std::string_view contents) {
  write_bytes(staged_ / name, contents, folder_ / name);
  names_.push_back(name);
}

// Files that take their places one after the other, and what was there before.
class StagedFiles::Moves {
 public:
  explicit Moves(const std::vector<StagedFiles*>& folders) {
    for (const StagedFiles* folder : folders)
      for (const std::string& name : folder->names_) add(*folder, name);
  }

  Moves(const Moves&) = delete;
  Moves& operator=(const Moves&) = delete;
  ~Moves() {
    std::error_code ignored;
    for (const Move& move : moves_)
      if (!move.before.empty()) fs::remove(move.before, ignored);
  }

  void make() {
    for (const auto& [from, to] : devices_) write_bytes(to, read_file(from), to);
    try {
      for (Move& move : moves_) {
        keep(move);
        rename_file(move.from, move.to, move.named);
        move.is_made = true;
      }
    } catch (...) {
      take_back();
      throw;
    }
  }

 private:
  struct Move {
    fs::path from;
    fs::path to;
    fs::path named;     // what messages call `to`
    fs::path before{};  // what was there; empty where nothing was
    bool is_made = false;
  };

  void add(const StagedFiles& folder, const std::string& name) {
    const fs::path from = folder.staged_ / name, to = folder.folder_ / name;
    const fs::path behind = behind_links(to);
    if (is_there(to) && !is_file(to)) {
      devices_.emplace_back(from, to);
    } else if (behind != to) {  // perhaps on another file system: a copy beside it is renamed
      const TemporaryFile& copy = *copies_.emplace_back(std::make_unique<TemporaryFile>(to, to));
      write_bytes(copy.path(), read_file(from), to);
      moves_.push_back({copy.path(), behind, to});
    } else {
      moves_.push_back({from, to, to});
    }
  }

  // A second name of what is there, or, where the file system has none, a copy of it.
  static void keep(Move& move) {
    if (!is_there(move.to)) return;
    const fs::path before = move.from.parent_path() / fmt::format(".old-{}", move.from.filename().string());
    if (::link(move.to.c_str(), before.c_str()) != 0) write_bytes(before, read_file(move.to), move.named);
    move.before = before;
  }

  void take_back() {
    std::error_code ignored;
    for (const Move& move : moves_ | std::views::reverse) {
      if (move.is_made && move.before.empty())
        fs::remove(move.to, ignored);
      else if (move.is_made)
        fs::rename(move.before, move.to, ignored);
    }
  }

  std::vector<Move> moves_;
  std::vector<std::pair<fs::path, fs::path>> devices_;
  std::vector<std::unique_ptr<TemporaryFile>> copies_;
};

void StagedFiles::commit() { commit_together({this}); }

void StagedFiles::commit_together(const std::vector<StagedFiles*>& folders) { Moves(folders).make(); }

}  // namespace pulson
