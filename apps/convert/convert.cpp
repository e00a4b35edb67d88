// `pulson convert`: landmarks from one format to another.

#include <cmath>
#include <filesystem>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "core/atomic_file.hpp"
#include "core/landmark_pairs.hpp"
#include "core/paths.hpp"
#include "core/shape_frames.hpp"
#include "formats/shape_address.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/formats/landmark_files.hpp"
#include "shell/cohort_shapes.hpp"
#include "shell/messages.hpp"
#include "shell/options.hpp"
#include "shell/path_options.hpp"
#include "shell/picture_sizes.hpp"
#include "shell/tables.hpp"
#include "shell/verbs.hpp"

namespace pulson {
namespace {

struct ConvertArguments {
  std::vector<std::string> inputs;
  std::string output;
  std::string format;
  std::string axes;
  std::string from_axes;
  std::optional<double> height;
  formats::ReadOptions reading;
};

/// Calls change(points) for all of a file.
template <class Change>
void change_all_points(formats::LandmarkFile& file, const Change& change) {
  for (Landmarks& shape : file.shapes) change_points(shape, change);
}

void check_axes(const std::string& option, const std::string& axes) {
  if (!axes.empty() && axes != "LPS" && axes != "RAS")
    throw InputError(option + " is '" + axes + "'; it must be LPS or RAS");
}

/// L, P point against R, A.
void convert_axes(const ConvertArguments& arguments, const std::string& input, formats::LandmarkFile& file) {
  if (!arguments.from_axes.empty()) file.axes = arguments.from_axes;
  if (arguments.axes.empty()) return;
  if (file.axes != "LPS" && file.axes != "RAS")
    throw InputError(fmt::format("--axes {}: {} does not say whether its axes are LPS or RAS; give --from-axes",
                                 arguments.axes, input));
  if (file.axes != arguments.axes)
    change_all_points(file, [](Points& points) { points.topRows(std::min<Eigen::Index>(2, points.rows())) *= -1; });
  file.axes = arguments.axes;
}

void flip_y(const ConvertArguments& arguments, const std::string& input, formats::LandmarkFile& file) {
  const double height = arguments.height.value_or(0);
  if (!arguments.height) return;
  if (!std::isfinite(height)) throw InputError(fmt::format("--flip-y is {}; it must be finite", height));
  change_all_points(file, [&](Points& points) {
    if (points.rows() < 2) throw InputError(input + ": --flip-y needs y; this is 1D");
    points.row(1) = height - points.row(1).array();
  });
  for (Landmarks& shape : file.shapes) {
    shape.frame.y_down = !shape.frame.y_down;
    shape.frame.says_y = true;
    if (height >= 1 && height <= 1e9 && height == std::floor(height)) shape.frame.height = static_cast<int>(height);
  }
}

/// One property of two files that are joined: what one of them says holds for both.
void join_property(std::string& ours, const std::string& theirs, const std::string& input, std::string_view what,
                   std::string_view hint) {
  if (!ours.empty() && !theirs.empty() && ours != theirs)
    throw InputError(
        fmt::format("{}: its {} are {}, those of the previous files {}{}", input, what, theirs, ours, hint));
  if (ours.empty()) ours = theirs;
}

/// The shapes of all inputs, one file after the other.
formats::LandmarkFile read_inputs(const ConvertArguments& arguments) {
  formats::LandmarkFile all;
  for (const std::string& input : arguments.inputs) {
    formats::LandmarkFile file = read_addressed_shapes(input, arguments.reading);
    log_step(fmt::format("read {}: {}", input, file.format));
    convert_axes(arguments, input, file);
    flip_y(arguments, input, file);
    join_property(all.axes, file.axes, input, "axes", "; --axes converts all to the same axes");
    join_property(all.units, file.units, input, "units", "");
    std::move(file.shapes.begin(), file.shapes.end(), std::back_inserter(all.shapes));
    std::move(file.warnings.begin(), file.warnings.end(), std::back_inserter(all.warnings));
  }
  return all;
}

/// Whether a last file that is there looks like another input: `*.csv` and `a.txt b.txt` without an output would lose
/// it, `a.json#2 a.json` its other shapes.
bool may_be_input(const std::vector<std::string>& inputs, const std::filesystem::path& last) {
  if (!is_there(last)) return false;
  if (inputs.size() > 1) return true;
  return std::filesystem::path(formats::file_of_address(inputs.front())).extension() == last.extension();
}

/// A file is not converted in place: what the new format cannot hold would be lost with the only copy.
void add_paths(const ConvertArguments& arguments) {
  for (const std::string& input : arguments.inputs) run_paths().reads(formats::file_of_address(input), "FILES");
  run_paths().writes(arguments.output, "OUT");
}

/// The last of the files is the output where --out names none.
void find_output(ConvertArguments& arguments) {
  if (!arguments.output.empty()) {
    for (const std::string& input : arguments.inputs) run_paths().reads(formats::file_of_address(input), "FILES");
    return;  // --out is known already
  }
  if (arguments.inputs.size() < 2) throw InputError("convert needs two files or more: IN [IN ...] OUT");
  arguments.output = arguments.inputs.back();
  arguments.inputs.pop_back();
  add_paths(arguments);
  if (may_be_input(arguments.inputs, arguments.output))
    throw InputError(fmt::format("'{}' exists and may be meant as an input; --out {} replaces it", arguments.output,
                                 arguments.output));
}

void convert(ConvertArguments arguments) {
  find_output(arguments);
  check_axes("--axes", arguments.axes);
  check_axes("--from-axes", arguments.from_axes);
  const formats::LandmarkFormat& format = formats::landmark_format_to_write(arguments.output, arguments.format);
  check_output_file(arguments.output);
  formats::LandmarkFile file = read_inputs(arguments);
  std::vector<std::string> notes = std::move(file.warnings);
  // Where y is mirrored, the height of the picture is needed, which may be beside the file.
  for (Landmarks& shape : file.shapes)
    if (format.y_down && shape.dimension() == 2 && shape.frame.y_down != *format.y_down) find_picture_size(shape);
  prepare_to_write(format, file, notes);
  const Interrupt until_written;
  for (std::string& loss : write_landmarks(arguments.output, file, format.name)) notes.push_back(std::move(loss));
  print_notes(notes);
  if (verbosity() != Verbosity::kQuiet)
    print_text("wrote {}: {} shape{}, {}\n", arguments.output, file.shapes.size(), file.shapes.size() == 1 ? "" : "s",
               format.name);
}

}  // namespace

void add_convert_verb(CLI::App& program) {
  CLI::App* verb =
      program.add_subcommand("convert", "Convert landmark files to another format, or join several into one");
  auto arguments = std::make_shared<ConvertArguments>();
  reads_and_writes(
      verb->add_option("FILES", arguments->inputs,
                       "IN [IN ...] OUT: landmark files, or single shapes as FILE#3 or FILE#id=NAME, which are joined; "
                       "then the file to write, which is none of them"))
      ->required();
  writes_file(verb->add_option("-o,--out", arguments->output, "file to write or replace; all FILES are then inputs"));
  verb->add_option("--to", arguments->format, "format of OUT, see pulson info formats [by the extension of OUT]")
      ->type_name("FORMAT");
  verb->add_option("--axes", arguments->axes, "LPS or RAS: axes of OUT; x and y change sign where IN has the other")
      ->type_name("NAME");
  verb->add_option("--from-axes", arguments->from_axes, "LPS or RAS: axes of IN, overriding what the file says")
      ->type_name("NAME");
  verb->add_option("--flip-y", arguments->height,
                   "y becomes HEIGHT - y, as between rows of an image of this height and tps, where y points up")
      ->type_name("HEIGHT");
  add_read_options(*verb, arguments->reading);
  add_table_option(*verb);
  add_quiet_option(*verb);
  verb->footer(
      "A note on standard error lists what OUT cannot hold.\n"
      "Examples:\n  pulson convert wings.tps wings.json\n  pulson convert a.fcsv b.mrk.json --axes RAS\n"
      "  pulson convert skull_1.fcsv skull_2.fcsv skull_3.fcsv skulls.tps\n"
      "Exit codes: 0 done, 2 bad input.");
  verb->callback([arguments] { convert(*arguments); });
}

}  // namespace pulson
