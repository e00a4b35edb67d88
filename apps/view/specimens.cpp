#include "specimens.hpp"

#include <algorithm>
#include <system_error>

#include <fmt/format.h>

#include "core/paths.hpp"
#include "core/text.hpp"
#include "formats/formats.hpp"
#include "formats/shape_address.hpp"
#include "formats/shape_options.hpp"
#include "page_pictures.hpp"
#include "pulson/core/errors.hpp"
#include "shell/messages.hpp"
#include "shell/path_options.hpp"
#include "shell/picture_sizes.hpp"
#include "warp/picture_files.hpp"

namespace pulson {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kSessionEnd = ".pulson.json";
constexpr std::size_t kShownFirst = 2;  // specimens whose pictures the page shows when it opens

bool is_session(const std::string& path) { return path.ends_with(kSessionEnd); }

fs::path session_beside(const std::string& file) {
  const fs::path path = file;
  return path.parent_path() / (formats::file_stem(path) + std::string(kSessionEnd));
}

std::string picture_stem(const std::string& path) { return text::image_stem(fs::path(path).filename().string()); }

// The picture that a shape was placed on: the one given of its name, else the one that its file names.
std::string picture_for(const Landmarks& shape, std::vector<std::string>& pictures) {
  for (const std::string& wanted : {text::image_stem(shape.image), shape.name}) {
    const auto found = std::find_if(pictures.begin(), pictures.end(), [&](const std::string& path) {
      return !wanted.empty() && picture_stem(path) == wanted;
    });
    if (found == pictures.end()) continue;
    std::string path = *found;
    pictures.erase(found);
    return path;
  }
  const std::optional<fs::path> beside = picture_beside(shape);
  return beside ? beside->string() : "";
}

std::vector<Landmarks> shapes_of_files(const ViewFiles& files, const ViewArguments& arguments,
                                       std::vector<std::string>& notes) {
  std::vector<Landmarks> shapes = files.shapes;
  for (const std::string& file : files.landmarks) {
    formats::LandmarkFile read = read_landmark_file(file, arguments.reading);
    // Here positions are pixels of the picture, and the scale goes into the exported file.
    std::erase(read.warnings, file + ": " + formats::note_of_scales(read.shapes));
    notes.insert(notes.end(), read.warnings.begin(), read.warnings.end());
    for (Landmarks& shape : read.shapes) {
      if (shape.dimension() != 2 && shape.count() > 0)
        throw InputError(
            fmt::format("{}: its landmarks have {} coordinates; view places landmarks on pictures, in the "
                        "plane",
                        shape.source, shape.dimension()));
      if (shape.count() == 0) shape.points.resize(2, 0);
      shapes.push_back(std::move(shape));
    }
  }
  return shapes;
}

// Those that are shown are read as a whole, so that a broken one is named at once.
Picture picture_of(const std::string& path, std::int64_t max_pixels, std::size_t specimen) {
  return specimen < kShownFirst ? read_picture(path, max_pixels) : outlined_picture(path, max_pixels);
}

std::vector<PlacedShape> placed_shapes(const ViewFiles& files, const ViewArguments& arguments,
                                       std::vector<std::string>& rest, std::vector<std::string>& notes) {
  std::vector<Landmarks> shapes = shapes_of_files(files, arguments, notes);
  std::vector<std::string> pictures(shapes.size());
  for (std::size_t i = 0; i < shapes.size(); ++i) pictures[i] = picture_for(shapes[i], rest);
  // Names that say nothing, as leaves.csv beside IMG_1.jpg: the one shape is of the one picture.
  if (shapes.size() == 1 && rest.size() == 1 && pictures[0].empty()) pictures[0] = rest[0], rest.clear();
  std::vector<PlacedShape> placed;
  for (std::size_t i = 0; i < shapes.size(); ++i)
    placed.push_back(pictures[i].empty() ? shape_without_picture(std::move(shapes[i]))
                                         : shape_on_picture(std::move(shapes[i]), pictures[i],
                                                            picture_of(pictures[i], arguments.max_pixels, i), notes));
  return placed;
}

bool shows(const view::ViewDocument& document, const std::string& picture) {
  return std::any_of(document.specimens.begin(), document.specimens.end(),
                     [&](const auto& specimen) { return specimen.picture == picture; });
}

// A session beside results that were made anew, of other shapes, cannot go on.
void require_same_shapes(const view::ViewDocument& document, const std::vector<Landmarks>& shapes,
                         const view::SavedDocument& saved) {
  for (const Landmarks& shape : shapes)
    if (const std::string address = path_from(saved.folder(), shape.source); !document.shapes.contains(address))
      throw InputError(fmt::format("{} is a session of other shapes than these results, without {}; move it away",
                                   saved.path().string(), address));
}

bool has_shapes_of(const view::ViewDocument& document, const std::string& file) {
  return std::any_of(document.shapes.begin(), document.shapes.end(),
                     [&](const auto& shape) { return formats::file_of_address(shape.first) == file; });
}

// What the session of the document has not got yet.
ViewFiles new_files(const ViewFiles& files, const view::ViewDocument& document, const view::SavedDocument& saved) {
  require_same_shapes(document, files.shapes, saved);
  ViewFiles wanted = files;
  wanted.shapes.clear();
  std::erase_if(wanted.landmarks,
                [&](const std::string& file) { return has_shapes_of(document, path_from(saved.folder(), file)); });
  std::erase_if(wanted.pictures,
                [&](const std::string& file) { return shows(document, path_from(saved.folder(), file)); });
  return wanted;
}

void add_pictures(const std::vector<std::string>& pictures, const fs::path& folder, std::int64_t max_pixels,
                  view::ViewDocument& document) {
  Progress progress;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const std::string name = path_from(folder, pictures[i]);
    if (shows(document, name)) continue;
    progress.show(static_cast<double>(i) / static_cast<double>(pictures.size()), "reading pictures");
    const PagePicture picture =
        page_picture(pictures[i], picture_of(pictures[i], max_pixels, document.specimens.size()));
    view::ViewSpecimen specimen{picture_stem(pictures[i]), name, picture.width, picture.height};
    specimen.landmarks.resize(document.landmarks.size());
    document.specimens.push_back(std::move(specimen));
  }
}

}  // namespace

std::string path_from(const fs::path& folder, const fs::path& path) {
  std::error_code error;
  const fs::path relative = fs::proximate(path, folder, error);
  return error ? path.string() : relative.string();
}

ViewFiles::ViewFiles(const ViewArguments& arguments) {
  for (const std::string& file : arguments.files) {
    if (is_session(file)) {
      if (!document.empty())
        throw InputError(fmt::format("{} and {} are two sessions; view opens one", document.string(), file));
      document = file;
    } else if (is_picture_file(file)) {
      pictures.push_back(file);
    } else {
      landmarks.push_back(file);
    }
    if (!is_file(file))
      throw InputError(is_there(file) ? fmt::format("cannot read {}: {}", quoted_path(file), why_no_file(file))
                                      : fmt::format("cannot read {}: there is no such file", quoted_path(file)));
  }
  if (!document.empty()) return;
  if (!landmarks.empty())
    document = session_beside(landmarks.front());
  else if (!pictures.empty())
    document = session_beside(pictures.front());
  else
    document = "landmarks.pulson.json";
}

ViewFiles::ViewFiles(const ViewedResults& results)
    : shapes(results.shapes), document(results.folder.string() + std::string(kSessionEnd)) {}

PagePicture page_picture(const std::string& path, const Picture& picture) {
  PagePicture page{path, picture.image.width(), picture.image.height()};
  if (picture.orientation() > 4) std::swap(page.width, page.height);
  return page;
}

void open_session(const ViewFiles& files, const ViewArguments& arguments, view::SavedDocument& saved,
                  std::vector<std::string>& notes) {
  const bool goes_on = saved.load();
  view::ViewDocument document = saved.document();
  const ViewFiles wanted = goes_on ? new_files(files, document, saved) : files;
  std::vector<std::string> pictures = wanted.pictures;
  std::vector<PlacedShape> shapes = placed_shapes(wanted, arguments, pictures, notes);
  for (PlacedShape& placed : shapes) {
    if (!placed.picture.empty()) placed.picture = path_from(saved.folder(), placed.picture);
    placed.opened.shape.source = path_from(saved.folder(), placed.opened.shape.source);
  }
  if (goes_on)
    notes.push_back(fmt::format("{} goes on where it was, after {}", saved.path().string(),
                                counted(document.revision, "saved change")));
  add_shapes(shapes, document);
  if (document.opened.empty() && !wanted.landmarks.empty())
    document.opened = path_from(saved.folder(), wanted.landmarks.front());
  add_pictures(pictures, saved.folder(), arguments.max_pixels, document);
  saved.change([&](view::ViewDocument& next) { next = document; });
}

}  // namespace pulson
