#include "saved_document.hpp"

#include "core/paths.hpp"

namespace pulson::view {
namespace {

std::filesystem::path folder_of(const std::filesystem::path& path) {
  return path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
}

}  // namespace

SavedDocument::SavedDocument(std::filesystem::path path)
    : path_(std::move(path)), lock_(folder_of(path_), path_.filename().string()) {
  check_output_file(path_);
}

std::filesystem::path SavedDocument::folder() const { return folder_of(path_); }

bool SavedDocument::load() {
  if (!is_file(path_)) return false;
  const std::lock_guard lock(mutex_);
  document_ = document_of_json(path_.string(), read_file(path_, kMostText));
  return true;
}

ViewDocument SavedDocument::document() const {
  const std::lock_guard lock(mutex_);
  return document_;
}

SavedDocument::Outcome SavedDocument::replace(ViewDocument document, std::int64_t base) {
  const std::lock_guard lock(mutex_);
  if (base != document_.revision) return Outcome::kConflict;
  save(std::move(document));
  return Outcome::kSaved;
}

void SavedDocument::save(ViewDocument next) {
  next.revision = document_.revision + 1;
  write_file_atomically(path_, json_of_document(next));
  document_ = std::move(next);
}

}  // namespace pulson::view
