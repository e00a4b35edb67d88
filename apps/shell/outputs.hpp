#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <CLI/App.hpp>

#include "core/atomic_file.hpp"
#include "messages.hpp"
#include "pulson/draw/pictures.hpp"

namespace pulson {

/// Whether pictures can be that wide, in mm, at that resolution of png. @throws InputError if not
void check_picture_size(const std::optional<double>& width, double dpi);

/// Whether the extension is that of a drawing with captions: png, svg, pdf.
bool is_drawing_file(const std::filesystem::path& file);

/// A drawing as one file, in the format of its extension.
draw::PictureFiles drawing_as(const std::filesystem::path& file, const std::optional<double>& width, double dpi);

/// After a picture was drawn: a note, once, where its texts are in another font than they should be.
void note_missing_font();

/// `-o`, `--json`, `--no-picture` and `--quiet` of verbs that write their results into a folder.
struct OutputOptions {
  std::string out;
  std::string json;
  bool no_picture = false;
  std::string pictures = "png,svg";            ///< formats
  std::optional<double> width;                 ///< mm
  double dpi = 96;                             ///< of png
  mutable std::shared_ptr<FolderLock> lock{};  ///< of the folder, from `check` on

  /// `drawn` is what help calls the pictures: `paths.png and .svg`.
  void add_to(CLI::App& verb, const std::string& drawn);
  /// `-o` and `--json` alone. @return the option of the folder, which need not be given
  CLI::Option* add_files_to(CLI::App& verb);

  /// Of the picture that is `stem` without its extension, in the formats asked for.
  draw::PictureFiles picture_files(const std::filesystem::path& stem) const;
  /// The one of them that a page can show; empty where there is none.
  std::filesystem::path shown_picture(const std::filesystem::path& stem) const;

  std::filesystem::path file(const std::string& name) const { return std::filesystem::path(out) / name; }
  /// Whether the summary is to be printed.
  bool prints() const { return json != "-" && verbosity() != Verbosity::kQuiet; }

  /// All that can be known to fail before the work is done; locks the folder. @param stems of the pictures' names
  /// @throws InputError
  void check(const std::vector<std::string>& files, const std::vector<std::string>& stems) const;
  /// The same where only `name` is written in the folder: other processes may write other files there.
  void check_only(const std::string& name) const;
  /// Writes the record to --json, where that was asked for.
  void write_json(const std::string& record) const;

 private:
  std::vector<std::string> formats() const;
  /// Names of the pictures' files.
  std::vector<std::string> picture_names(const std::vector<std::string>& stems) const;
};

}  // namespace pulson
