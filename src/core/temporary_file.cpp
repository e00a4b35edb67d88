#include "temporary_file.hpp"

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <system_error>
#include <utility>

#include <unistd.h>

#include "pulson/core/errors.hpp"

namespace pulson {

namespace fs = std::filesystem;

void fail_to_write(const fs::path& path, const std::string& reason) {
  throw InputError("cannot write '" + path.string() + "': " + reason);
}

std::string last_error() { return std::generic_category().message(errno); }

void require_file_path(const fs::path& path) {
  std::error_code ignored;
  if (path.filename().empty() || fs::is_directory(path, ignored))
    fail_to_write(path, "it is a folder; a file is needed");
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  if (!fs::is_directory(folder, ignored)) fail_to_write(path, "there is no folder '" + folder.string() + "'");
}

TemporaryFile::TemporaryFile(fs::path target, fs::path named) : target_(std::move(target)), named_(std::move(named)) {
  static std::atomic<unsigned> serial{0};
  path_ = target_.parent_path() / ("." + target_.stem().string() + "." + std::to_string(::getpid()) + "-" +
                                   std::to_string(serial++) + ".part" + target_.extension().string());
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

}  // namespace pulson
