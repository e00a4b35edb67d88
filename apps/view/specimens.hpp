#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "arguments.hpp"
#include "opened_shapes.hpp"
#include "results.hpp"
#include "view/saved_document.hpp"
#include "warp/picture_files.hpp"

namespace pulson {

/// What the command line names, sorted.
struct ViewFiles {
  std::vector<std::string> pictures, landmarks;
  std::vector<Landmarks> shapes;   ///< of a folder of results
  std::filesystem::path document;  ///< where the session is kept

  /// @throws InputError where a file is missing, or there are two sessions
  explicit ViewFiles(const ViewArguments& arguments);
  /// The shapes of results; the session is NAME.pulson.json beside their folder.
  explicit ViewFiles(const ViewedResults& results);
};

/// A picture that the page may show.
struct PagePicture {
  std::string path;
  int width = 0;  ///< as displayed
  int height = 0;
};

PagePicture page_picture(const std::string& path, const Picture& picture);

/// Fills the document by the files, or goes on with that of an earlier session, to which new pictures and landmark
/// files are added; those that it has already are not read again.
void open_session(const ViewFiles& files, const ViewArguments& arguments, view::SavedDocument& document,
                  std::vector<std::string>& notes);

/// `path` as a document in `folder` names it.
std::string path_from(const std::filesystem::path& folder, const std::filesystem::path& path);

}  // namespace pulson
