#pragma once

#include <filesystem>
#include <mutex>
#include <string>
#include <string_view>

#include "core/atomic_file.hpp"
#include "document.hpp"

namespace pulson::view {

/// A document and its file, which always hold the same. Thread-safe.
class SavedDocument {
 public:
  /// Holds a lock on the file, so that no second program writes it. @throws InputError where another one does
  explicit SavedDocument(std::filesystem::path path);

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path folder() const;

  /// Whether there is a file, from which the document then is. @throws InputError where it is none of ours
  bool load();

  ViewDocument document() const;

  enum class Outcome { kSaved, kConflict };
  /// Replaces the document, where its revision is that of `base`, and writes the file. The revision rises by one.
  /// @throws InputError where it cannot be written; then nothing changes
  Outcome replace(ViewDocument document, std::int64_t base);

  /// Changes it in place, whatever the revision. @throws InputError as replace
  template <class Change>
  void change(const Change& how) {
    const std::lock_guard lock(mutex_);
    ViewDocument next = document_;
    how(next);
    save(std::move(next));
  }

 private:
  void save(ViewDocument next);

  std::filesystem::path path_;
  FolderLock lock_;
  mutable std::mutex mutex_;
  ViewDocument document_;
};

}  // namespace pulson::view
