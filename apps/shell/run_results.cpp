#include "run_results.hpp"

#include <utility>
#include <variant>

#include <fmt/format.h>

#include "core/atomic_file.hpp"
#include "core/checksum.hpp"
#include "core/paths.hpp"
#include "host.hpp"
#include "pulson/core/errors.hpp"
#include "ranks.hpp"
#include "tables.hpp"

namespace pulson {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kPage = "report.html";

// The text of a JSON object, as Json::dump(2) writes it, with more keys.
std::string with_keys(std::string record, const Json& keys) {
  constexpr std::string_view kLastLine = "\n}\n", kFirstLine = "{\n";
  if (!record.ends_with(kLastLine)) throw std::logic_error("a record is a JSON object in lines");
  record.resize(record.size() - kLastLine.size());
  return record + ",\n" + keys.dump(2).substr(kFirstLine.size()) + "\n";
}

}  // namespace

void RecordFiles::add(const std::string& name, std::string_view contents) {
  std::string table;
  if (name.ends_with(".csv")) contents = table = as_table(std::string(contents));
  staged_.write(name, contents);
  checksums_[name] = {{"bytes", contents.size()}, {"crc32", crc32_text(contents)}};
  names_.push_back(name);
}

std::string RecordFiles::add_record(const std::string& name, std::string record, Json more) {
  if (!checksums_.empty()) more["files"] = checksums_;
  if (!more.empty()) record = with_keys(std::move(record), more);
  staged_.write(name, record);
  names_.insert(names_.begin(), name);
  return record;
}

void RunResults::commit(const std::string& name, const std::string& record, Json more,
                        const std::vector<StagedFiles*>& others) {
  const std::string text = files_.add_record(name, record, std::move(more));
  std::vector<StagedFiles*> folders = others;
  folders.push_back(&files_.staged());
  StagedFiles::commit_together(folders);
  written_ = files_.names();
  write_outside([&] { output_.write_json(text); });
  log_step("wrote the numbers");
}

void RunResults::write_outside(const std::function<void()>& write) {
  try {
    write();
  } catch (const std::exception&) {
    if (!failure_) failure_ = std::current_exception();
  }
}

bool RunResults::try_to(const std::string& names, const std::function<void()>& how) {
  std::string reason = "interrupted";
  try {
    if (!Interrupt::came() || ranks::are_of_mpirun()) {  // mpirun repeats its signals while results are written
      how();
      return true;
    }
  } catch (const std::bad_alloc&) {
    reason = "out of memory";
  } catch (const std::exception& error) {
    reason = error.what();
  }
  print_warning(fmt::format("{} not made: {}; the numbers are in '{}'", names, reason, output_.out));
  return false;
}

void RunResults::forget(const std::string& name) const {
  const fs::path file = output_.file(name);
  if (is_file(file) && behind_links(file) == file) remove_quietly(file);
}

fs::path RunResults::draw(const std::string& stem, const std::function<void(const draw::PictureFiles&)>& how) {
  if (output_.no_picture || makes_numbers_only()) return {};
  draw::PictureFiles files = output_.picture_files(output_.file(stem));
  std::string narrow;
  files.narrow = &narrow;
  std::vector<std::string> names;
  for (const fs::path& file : {files.png, files.svg, files.pdf})
    if (!file.empty()) names.push_back(file.filename().string());
  if (!try_to(fmt::format("the picture {} was", fmt::join(names, ", ")), [&] { how(files); })) {
    for (const std::string& name : names) forget(name);
    return {};
  }
  written_.insert(written_.end(), names.begin(), names.end());
  drawn_.insert(stem);
  log_step(fmt::format("drew {}", stem));
  note_missing_font();
  fs::path file = shown(stem);
  if (!narrow.empty()) narrow_[file] = std::move(narrow);
  return file;
}

fs::path RunResults::shown(const std::string& stem) const {
  return drawn_.contains(stem) ? output_.shown_picture(output_.file(stem)) : fs::path();
}

html::HtmlReport RunResults::with_narrow_layouts(html::HtmlReport report) const {
  for (html::ReportSection& section : report.sections)
    for (auto& block : section.blocks) {
      auto* picture = std::get_if<html::ReportPicture>(&block);
      const auto* file = picture == nullptr ? nullptr : std::get_if<fs::path>(&picture->picture);
      if (file == nullptr) continue;
      if (const auto found = narrow_.find(*file); found != narrow_.end())
        picture->narrow = {html::MediaType::kPng, found->second};
    }
  return report;
}

void RunResults::add_page(const std::function<html::HtmlReport()>& make) {
  if (makes_numbers_only()) return;
  if (try_to("the page report.html was",
             [&] { write_file_atomically(output_.file(kPage), html_report(with_narrow_layouts(make()))); }))
    written_.emplace_back(kPage);
  else
    forget(kPage);
}

void RunResults::finish() const {
  log_step("wrote the results");
  if (!failure_) return;
  try {
    std::rethrow_exception(failure_);
  } catch (const Error& error) {
    throw InputError(fmt::format("{}; all other results are in '{}'", error.what(), output_.out));
  }
}

void RunResults::print_written() const {
  print_text("wrote      {}: {}\n", output_.out, fmt::format("{}", fmt::join(written_, ", ")));
}

}  // namespace pulson
