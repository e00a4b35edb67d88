#include <algorithm>
#include <set>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "core/atomic_file.hpp"
#include "core/csv_table.hpp"
#include "core/text.hpp"
#include "formats/formats.hpp"
#include "formats/frame_text.hpp"
#include "formats/landmark_writers.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/formats/landmark_files.hpp"

namespace pulson::formats {
namespace {

/// Which columns follow the coordinates.
struct LastColumns {
  bool groups = false;
  bool absent = false;
};

LastColumns last_columns(const std::vector<Landmarks>& shapes) {
  LastColumns columns;
  for (const Landmarks& shape : shapes) {
    columns.groups = columns.groups || !shape.groups.empty();
    columns.absent = columns.absent || !shape.absent.empty();
  }
  return columns;
}

/// The header's end: `x[,y[,z]][,group][,absent]`
void end_header(text::CsvTable& table, int dimension, const LastColumns& last) {
  for (int axis = 0; axis < dimension; ++axis) table.word(text::kAxisLetters.substr(static_cast<std::size_t>(axis), 1));
  if (last.groups) table.word("group");
  if (last.absent) table.word("absent");
  table.end_row();
}

/// A row's end, from the coordinates on.
void end_row(text::CsvTable& table, const Landmarks& shape, int a, const LastColumns& last) {
  table.numbers(shape.points.col(a));
  if (last.groups) table.word(shape.groups.empty() ? "" : shape.groups[static_cast<std::size_t>(a)]);
  if (last.absent) table.word(std::binary_search(shape.absent.begin(), shape.absent.end(), a) ? "1" : "0");
  table.end_row();
}

std::string comment_of_frame(const Landmarks& shape) {
  const std::string frame = shape.dimension() == 2 ? frame_text(shape.frame) : "";
  return frame.empty() ? "" : fmt::format("# {} {}\n", kFrameComment, frame);
}

}  // namespace

std::string landmarks_csv(const Landmarks& shape) {
  text::CsvTable table;
  if (!shape.labels.empty()) table.word("label");
  const LastColumns last = last_columns({shape});
  end_header(table, shape.dimension(), last);
  for (int i = 0; i < shape.count(); ++i) {
    if (!shape.labels.empty()) table.word(shape.labels[static_cast<std::size_t>(i)]);
    end_row(table, shape, i, last);
  }
  return comment_of_frame(shape) + std::move(table).take();
}

void write_landmarks_csv(const std::filesystem::path& path, const Landmarks& shape) {
  write_file_atomically(path, landmarks_csv(shape));
}

namespace {

/// Shapes made fit for the table, one by one.
class TableShapes {
 public:
  TableShapes(const std::string& path, const LandmarkFile& file)
      : target_{path, "csv"}, count_(file.shapes.size()), losses_(losses_of(target_, file, held_by(file))) {
    require_shapes(target_, file);
    for (const Landmarks& shape : file.shapes) add(shape);
    if (shapes_.empty()) require_landmarks(target_, file.shapes.front());
    require_equal_dimensions();
    if (has_bytes_) losses_.push_back(cannot_hold(target_, "texts that are not UTF-8 or hold zero bytes"));
    if (empty_ > 0) losses_.push_back(cannot_hold(target_, "shapes without landmarks", empty_, count_));
    keep_common_frame();
    if (const std::string comment = comment_of_frame(shapes_.front()); !comment.empty())
      losses_.push_back(
          fmt::format("{}: its first line says how its points lie on their picture: {} (R's read.csv skips "
                      "it with comment.char = \"#\")",
                      target_.path, text::in_quotes(comment.substr(0, comment.size() - 1))));
    if (unlabelled_ > 0) losses_.push_back(cannot_hold(target_, "labels that repeat", unlabelled_, count_));
  }

  const std::vector<Landmarks>& shapes() const { return shapes_; }
  std::vector<std::string>& losses() { return losses_; }

  /// Names that differ, as a long table needs them.
  void make_names_unique() {
    std::set<std::string> taken;
    for (const Landmarks& shape : shapes_) taken.insert(shape.name);
    std::set<std::string> seen;
    std::size_t renamed = 0;
    for (std::size_t i = 0; i < shapes_.size(); ++i) {
      std::string& name = shapes_[i].name;
      if (!name.empty() && seen.insert(name).second) continue;
      while (name.empty() || !taken.insert(name).second) name += fmt::format("#{}", i + 1);
      ++renamed;
    }
    if (renamed > 0)
      losses_.push_back(cannot_hold(target_, "names that are empty or repeat, which end in #number", renamed, count_));
  }

 private:
  static HeldParts held_by(const LandmarkFile& file) {
    return {.names = file.shapes.size() > 1, .labels = true, .groups = true, .frames = true, .absent = true};
  }

  void add(const Landmarks& shape) {
    if (shape.count() == 0) {
      ++empty_;
      return;
    }
    Landmarks& kept = shapes_.emplace_back();
    kept.points = shape.points;
    kept.frame = shape.frame;
    kept.absent = shape.absent;
    kept.name = as_text(shape.name);
    for (const std::string& label : shape.labels) kept.labels.push_back(as_text(label));
    for (const std::string& group : shape.groups) kept.groups.push_back(as_text(group));
    if (!has_repeated_label(kept)) return;
    ++unlabelled_;
    kept.labels.clear();
  }

  /// In UTF-8, without zero bytes.
  std::string as_text(std::string text) {
    if (is_utf8(text) && text.find('\0') == std::string::npos) return text;
    has_bytes_ = true;
    std::replace(text.begin(), text.end(), '\0', ' ');
    return is_utf8(text) ? text : utf8_of_windows_1252(text);
  }

  static bool has_repeated_label(const Landmarks& shape) {
    std::set<std::pair<std::string_view, std::string_view>> seen;
    for (std::size_t i = 0; i < shape.labels.size(); ++i) {
      const std::string_view group = shape.groups.empty() ? std::string_view() : shape.groups[i];
      if (!shape.labels[i].empty() && !seen.insert({group, shape.labels[i]}).second) return true;
    }
    return false;
  }

  /// A table has one frame: of shapes that differ in more than the direction of y it keeps that alone.
  void keep_common_frame() {
    const Frame first = shapes_.front().frame;
    const auto is_same = [&](const Landmarks& shape) { return are_same_frames(shape.frame, first); };
    if (std::all_of(shapes_.begin(), shapes_.end(), is_same)) return;
    for (Landmarks& shape : shapes_) {
      if (shape.frame.y_down != first.y_down)
        throw InputError(
            fmt::format("{}: a table counts y in one direction; y of {} points {} and of {} {}: convert one "
                        "with `mirror_y`",
                        target_.path, text::in_quotes(shapes_.front().name), first.y_down ? "down" : "up",
                        text::in_quotes(shape.name), first.y_down ? "up" : "down"));
      shape.frame = Frame{.y_down = first.y_down, .says_y = first.says_y};
    }
    losses_.push_back(cannot_hold(target_, "frames that differ between shapes: sizes of pictures, units per pixel"));
  }

  void require_equal_dimensions() const {
    const int dimension = shapes_.front().dimension();
    for (const Landmarks& shape : shapes_)
      if (shape.dimension() != dimension)
        throw InputError(fmt::format("{}: {} is in {}D and {} in {}D; the shapes of a table need the same dimension",
                                     target_.path, text::in_quotes(shapes_.front().name), dimension,
                                     text::in_quotes(shape.name), shape.dimension()));
  }

  Target target_;
  std::size_t count_;
  std::vector<Landmarks> shapes_;
  std::vector<std::string> losses_;
  bool has_bytes_ = false;
  std::size_t empty_ = 0;
  std::size_t unlabelled_ = 0;
};

std::string long_table(const std::vector<Landmarks>& shapes) {
  const bool has_labels = std::any_of(shapes.begin(), shapes.end(), [](const auto& s) { return !s.labels.empty(); });
  const LastColumns last = last_columns(shapes);
  text::CsvTable table;
  table.word("specimen");
  if (has_labels) table.word("landmark");
  end_header(table, shapes.front().dimension(), last);
  for (const Landmarks& shape : shapes) {
    for (int i = 0; i < shape.count(); ++i) {
      const auto place = static_cast<std::size_t>(i);
      table.word(shape.name);
      if (has_labels) table.word(shape.labels.empty() ? std::to_string(i + 1) : shape.labels[place]);
      end_row(table, shape, i, last);
    }
  }
  return comment_of_frame(shapes.front()) + std::move(table).take();
}

}  // namespace

WrittenLandmarks write_csv(const std::string& path, const LandmarkFile& file) {
  TableShapes table(path, file);
  if (file.shapes.size() > 1) {
    table.make_names_unique();
    return {long_table(table.shapes()), std::move(table.losses())};
  }
  return {landmarks_csv(table.shapes().front()), std::move(table.losses())};
}

}  // namespace pulson::formats
