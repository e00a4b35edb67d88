#pragma once

#include <exception>
#include <filesystem>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/staged_files.hpp"
#include "html/html_report.hpp"
#include "messages.hpp"
#include "outputs.hpp"

namespace pulson {

/// Tables and arrays of a folder and the record that they belong to. The record has a last key `files`, with the size
/// and the CRC-32 of each of them.
class RecordFiles {
 public:
  /// @throws InputError if nothing can be written in `folder`
  explicit RecordFiles(const std::filesystem::path& folder) : staged_(folder) {}

  /// A table, of which as_table() is written, or an array. @throws InputError if it cannot be written
  void add(const std::string& name, std::string_view contents);

  /// Adds the record, a JSON object, after all others. @return its text, with the checksums
  std::string add_record(const std::string& name, std::string record, nlohmann::ordered_json more = {});

  StagedFiles& staged() { return staged_; }
  /// The record first.
  const std::vector<std::string>& names() const { return names_; }

 private:
  StagedFiles staged_;
  nlohmann::ordered_json checksums_ = nlohmann::ordered_json::object();
  std::vector<std::string> names_;
};

/// The results of a run: its numbers first, all or none; then what shows them, each as far as it can be made, so that
/// no picture decides over a number. A signal meanwhile is obeyed once the numbers are written: what follows is left
/// out.
///
///     RunResults results(output);
///     results.add("table.csv", …);
///     results.commit("record.json", record);
///     const auto picture = results.draw("picture", [&](const draw::PictureFiles& files) { … });
///     results.add_page([&] { return report(picture); });
///     results.finish();
class RunResults {
 public:
  /// @throws InputError if nothing can be written in the folder
  explicit RunResults(const OutputOptions& output) : output_(output), files_(output.out) {}

  void add(const std::string& name, std::string_view contents) { files_.add(name, contents); }

  /// Puts all that was added into the folder, and the record after it, then the record into the file of --json.
  /// @param more keys of the record that follow its own @param others folders that are written before, all or none
  /// @throws InputError if the folder cannot be written; it is as it was then
  void commit(const std::string& name, const std::string& record, nlohmann::ordered_json more = {},
              const std::vector<StagedFiles*>& others = {});

  /// Files of other folders that `print_written` is to name.
  void name_written(const std::vector<std::string>& names) {
    written_.insert(written_.end(), names.begin(), names.end());
  }

  /// Writes a file of numbers outside the folder, after `commit`. That this fails is reported by `finish`.
  void write_outside(const std::function<void()>& write);

  /// Draws the picture in the formats asked for, in the folder. That this fails is a warning.
  /// @return the file of it that a page can show; empty where there is none
  std::filesystem::path draw(const std::string& stem, const std::function<void(const draw::PictureFiles&)>& how);

  /// The file of a picture that was drawn, that a page can show; empty where there is none.
  std::filesystem::path shown(const std::string& stem) const;

  /// Writes report.html, with the narrow layouts of the pictures that were drawn. That this fails is a warning.
  void add_page(const std::function<html::HtmlReport()>& make);

  /// @throws InputError if a file of numbers outside the folder could not be written
  void finish() const;

  const OutputOptions& output() const { return output_; }
  /// "wrote      DIR: a, b, c", of what was written.
  void print_written() const;

 private:
  // Whether it was done; a warning where not.
  bool try_to(const std::string& names, const std::function<void()>& how);
  html::HtmlReport with_narrow_layouts(html::HtmlReport report) const;
  // No older file is to be taken for one of this run.
  void forget(const std::string& name) const;

  Interrupt until_written_;
  const OutputOptions& output_;
  RecordFiles files_;
  std::vector<std::string> written_;
  std::set<std::string> drawn_;
  std::map<std::filesystem::path, std::string> narrow_;  // a png, by the file that a page can show
  std::exception_ptr failure_;
};

}  // namespace pulson
