#include "mend.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "audit/facts.hpp"
#include "core/atomic_file.hpp"
#include "core/shape_frames.hpp"
#include "formats/shape_address.hpp"
#include "pulson/core/errors.hpp"
#include "shell/cohort_shapes.hpp"
#include "shell/messages.hpp"
#include "shell/path_options.hpp"
#include "shell/tables.hpp"

namespace pulson {
namespace {

namespace fs = std::filesystem;
using audit::Finding;
using audit::Problem;

bool is_same_place(const Points& a, Eigen::Index i, const Points& b, Eigen::Index j) {
  for (Eigen::Index axis = 0; axis < a.rows(); ++axis)
    if (!(a(axis, i) == b(axis, j) || (std::isnan(a(axis, i)) && std::isnan(b(axis, j))))) return false;
  return true;
}

// The landmark, its own first, that was at this place and belongs to the shape as given; -1: none.
int landmark_at(const JudgedShape& judged, const Points& corrected, int landmark) {
  const auto was_there = [&](int other) {
    return judged.columns[static_cast<std::size_t>(other)] >= 0 &&
           is_same_place(corrected, landmark, judged.shape.points, other);
  };
  if (was_there(landmark)) return landmark;
  for (int other = 0; other < judged.shape.count(); ++other)
    if (was_there(other)) return other;
  return -1;
}

// That of the last finding which mends the shape: it has those before it.
const Finding* mending(const AuditResults& results, std::size_t specimen) {
  const Finding* last = nullptr;
  for (const Finding& finding : results.audit.findings)
    if (static_cast<std::size_t>(finding.specimen) == specimen && finding.corrected.size() > 0) last = &finding;
  return last;
}

std::vector<std::size_t> judged_files(const std::vector<AuditedFile>& files, const AuditResults& results) {
  std::set<std::size_t> judged;
  for (std::size_t i = results.is_of_cohort ? 0 : 1; i < results.shapes.size(); ++i)
    for (std::size_t f = 0; f < files.size(); ++f)
      if (const std::size_t place = results.shapes[i].given;
          files[f].first <= place && place < files[f].first + files[f].contents.shapes.size())
        judged.insert(f);
  return {judged.begin(), judged.end()};
}

bool names_folder(const std::string& path) { return path.ends_with('/') || is_folder(path); }

std::string mended_text(const Finding& finding, const Landmarks& shape) {
  const std::string names = some_names(shape, finding.landmarks);
  const std::string_view noun = finding.landmarks.size() == 1 ? "landmark" : "landmarks";
  const auto is_missing = [&](int landmark) { return finding.corrected.col(landmark).hasNaN(); };
  switch (finding.problem) {
    case Problem::kExchanged:
      return fmt::format("landmarks {} exchanged",
                         finding.landmarks.size() == 2
                             ? fmt::format("{} and {}", landmark_name(shape, finding.landmarks[0]),
                                           landmark_name(shape, finding.landmarks[1]))
                             : names);
    case Problem::kMoved:
    case Problem::kZero:
      if (std::any_of(finding.landmarks.begin(), finding.landmarks.end(), is_missing))
        return fmt::format("{} {} set as missing", noun, names);
      return fmt::format("{} {} moved{}", noun, names, finding.slip.empty() ? "" : ": " + finding.slip);
    case Problem::kReversed:
      if (finding.landmarks.size() == 1) return fmt::format("order reversed, from landmark {}", names);
      return fmt::format("landmarks {} reversed", names);
    case Problem::kShifted:
      if (finding.landmarks.size() == 1) return fmt::format("order begins at landmark {}", names);
      return fmt::format("landmarks {} shifted", names);
    case Problem::kMirrored:
      return "mirrored";
    case Problem::kUndigitised:
      return "all landmarks set as missing";
    case Problem::kUnit:
      return fmt::format("divided by {:.4g}", finding.factor);
    case Problem::kAxes:
      return "axes exchanged";
    case Problem::kUnordered:
    case Problem::kForeign:
      break;
  }
  return std::string(problem_name(finding.problem));
}

}  // namespace

std::vector<Landmarks> shapes_of(const std::vector<AuditedFile>& files) {
  std::vector<Landmarks> all;
  for (const AuditedFile& file : files) all.insert(all.end(), file.contents.shapes.begin(), file.contents.shapes.end());
  return all;
}

Points mended_points(const Landmarks& given, const JudgedShape& judged, const Points& corrected) {
  Landmarks moved = judged.shape;
  moved.points = corrected;
  std::vector<std::string> notes;
  const Points back = in_frame_of(given, moved, notes).points;
  Points mended = given.points;
  for (int a = 0; a < judged.shape.count(); ++a) {
    const int column = judged.columns[static_cast<std::size_t>(a)];
    const int from = landmark_at(judged, corrected, a);
    if (column >= 0)
      mended.col(column) = from >= 0 ? given.points.col(judged.columns[static_cast<std::size_t>(from)]) : back.col(a);
    else if (!corrected.col(a).hasNaN())
      throw InputError(
          fmt::format("{}: it has no landmark {}, which would get a position", given.source, judged.shape.describe(a)));
  }
  return mended;
}

MendedFiles::MendedFiles(const std::string& fix, const std::vector<AuditedFile>& files, const AuditResults& results) {
  const std::vector<std::size_t> judged = judged_files(files, results);
  const bool in_folder = names_folder(fix);
  if (!in_folder && judged.size() > 1)
    throw InputError(
        fmt::format("--fix {0}: {1} files are judged, and each has its own copy: --fix {0}/ is a folder for them", fix,
                    judged.size()));
  if (in_folder) create_output_directory(fix);
  for (const std::size_t f : judged) {
    Copy copy{f, fix, {}, {}};
    if (in_folder) copy.path /= fs::path(formats::file_of_address(files[f].address)).filename();
    copy.format = formats::landmark_format_to_write(copy.path).name;
    if (in_folder)
      check_result_file(copy.path, "--fix");
    else
      check_output_file(copy.path);
    copies_.push_back(std::move(copy));
  }
}

void MendedFiles::mend(std::vector<AuditedFile> files, const AuditResults& results, std::vector<std::string>& notes) {
  for (std::size_t i = 0; i < results.shapes.size(); ++i) {
    const Finding* finding = mending(results, i);
    if (finding == nullptr) continue;
    const JudgedShape& judged = results.shapes[i];
    for (AuditedFile& file : files)
      if (const std::size_t place = judged.given - file.first; place < file.contents.shapes.size())
        file.contents.shapes[place].points = mended_points(file.contents.shapes[place], judged, finding->corrected);
  }
  for (Copy& copy : copies_) {
    formats::LandmarkFile& contents = files[copy.file].contents;
    const formats::LandmarkFormat& format = formats::landmark_format_to_write(copy.path, copy.format);
    prepare_to_write(format, contents, notes);
    formats::WrittenLandmarks written = text_to_write(copy.path, contents, format);
    copy.text = std::move(written.text);
    copy.shapes = contents.shapes.size();
    notes.insert(notes.end(), written.losses.begin(), written.losses.end());
  }
}

void MendedFiles::write() const {
  for (const Copy& copy : copies_) write_file_atomically(copy.path, copy.text);
}

void MendedFiles::print(const AuditResults& results) const {
  for (const FindingRow& row : finding_rows(results))
    if (row.finding->corrected.size() > 0)
      print_text("mended     {}: {}\n", row.shape().name, mended_text(*row.finding, row.shape()));
    else
      print_text("not mended {}: {}\n", row.shape().name, problem_name(row.finding->problem));
  for (const Copy& copy : copies_)
    print_text("wrote      {}: {}, {}\n", copy.path.string(), counted(copy.shapes, "shape"), copy.format);
}

}  // namespace pulson
