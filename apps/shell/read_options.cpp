#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "core/text.hpp"
#include "help_groups.hpp"
#include "options.hpp"
#include "path_options.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"

namespace pulson {
namespace {

const std::string kReadingGroup = more("Reading landmarks");
constexpr int kFewestCurvePoints = 2;
constexpr int kMostCurvePoints = 100'000;

const std::vector<std::string> kColumnKeys = {"x", "y", "z", "name", "specimen", "group", "absent"};

void add_column(std::string_view text, formats::ReadOptions& options) {
  const std::size_t equals = text.find('=');
  const std::string key(text.substr(0, equals));
  if (equals == std::string_view::npos || equals + 1 == text.size())
    throw InputError(
        fmt::format("--columns: '{}' is not of the form x=COLUMN; valid: {}", text, fmt::join(kColumnKeys, ", ")));
  if (std::find(kColumnKeys.begin(), kColumnKeys.end(), key) == kColumnKeys.end())
    throw InputError(
        fmt::format("--columns: '{}' is not the name of a kind of column{}", key, advice_on_name(key, kColumnKeys)));
  if (!options.columns.try_emplace(key, text.substr(equals + 1)).second)
    throw InputError(fmt::format("--columns: {} is given twice", key));
}

void set_columns(std::string_view text, formats::ReadOptions& options) {
  for (bool is_last = false; !is_last;) {
    const std::size_t comma = text.find(',');
    is_last = comma == std::string_view::npos;
    add_column(text.substr(0, comma), options);
    if (!is_last) text.remove_prefix(comma + 1);
  }
}

void set_format(const std::string& name, formats::ReadOptions& options) {
  const std::vector<std::string> names = formats::landmark_format_names();
  if (std::find(names.begin(), names.end(), name) == names.end())
    throw InputError(fmt::format("--format: '{}' is not a landmark format{}", name, advice_on_name(name, names)));
  options.format = name;
}

// One of `negative`, `zero`, a number, `absent:NUMBER`, `absent:NA`.
void add_missing_mark(const std::string& text, formats::ReadOptions& options) {
  constexpr std::string_view kAbsent = "absent:";
  if (text == "negative" || text == "zero") {
    (text == "zero" ? options.zero_is_missing : options.negative_is_missing) = true;
    return;
  }
  const bool is_absent = text.starts_with(kAbsent);
  const std::string code = is_absent ? text.substr(kAbsent.size()) : text;
  if (is_absent && text::is_missing(code) && !code.empty())
    options.absent_codes.push_back(text::kMissing);
  else if (is_absent && code == "zero")
    options.absent_codes.push_back(0);
  else if (text::is_number(code) && !text::is_missing(code))
    (is_absent ? options.absent_codes : options.missing_codes).push_back(parse_number(code, "--missing"));
  else
    throw InputError(fmt::format(
        "--missing is '{}'; it must be negative, zero, a number as 9999, or absent:NUMBER, absent:NA", text));
}

void add_text_option(CLI::App& verb, const std::string& name, const std::function<void(const std::string&)>& set,
                     const std::string& type, const std::string& help) {
  verb.add_option_function<std::string>(name, set, help)->type_name(type)->group(kReadingGroup);
}

}  // namespace

void add_read_options(CLI::App& verb, formats::ReadOptions& options) {
  verb.add_option_function<std::vector<std::string>>(
          "--missing",
          [&options](const std::vector<std::string>& marks) {
            for (const std::string& mark : marks) add_missing_mark(mark, options);
          },
          "negative: each landmark with a negative coordinate is missing; zero, or a number as 9999: each that has it "
          "in "
          "all coordinates; absent:9999, absent:NA: the specimen does not have those with this mark, and they are left "
          "out; several with commas between")
      ->type_name("MARK")
      ->delimiter(',')
      ->group(kReadingGroup);
  reads_column(verb.add_option("--absent", options.absent_table,
                               "landmarks that specimens do not have: a table of specimen and landmarks, or of these "
                               "columns")
                   ->type_name("FILE[:COLUMNS]")
                   ->group(kReadingGroup));
  add_text_option(
      verb, "--format", [&options](const std::string& name) { set_format(name, options); }, "NAME",
      "format of landmark files, see pulson info formats [recognised by their content]");
  add_text_option(
      verb, "--columns", [&options](const std::string& text) { set_columns(text, options); }, "NAMES",
      "columns of tables: x=COLUMN,y=COLUMN,… for x, y, z, name (of landmarks), specimen, group, absent");
  verb.add_option_function<int>(
          "--dim",
          [&options](int d) {
            if (d != 2 && d != 3) throw InputError(fmt::format("--dim is {}; it must be 2 or 3", d));
            options.dimension = d;
          },
          "2 or 3: coordinates per landmark in a table of one column, one below the other, or with columns V1, V2, ...")
      ->group(kReadingGroup);
  add_text_option(
      verb, "--landmarks",
      [&options](const std::string& text) {
        if (text.empty()) throw InputError("--landmarks is empty; it must be numbers, ranges or labels, as in 1-20,25");
        options.landmarks = text;
      },
      "LIST", "landmarks to read, in this order: numbers in the file, labels and ranges, as in 1-20,25,tip [all]");
  verb.add_option_function<int>(
          "--curves",
          [&options](int count) {
            if (count < kFewestCurvePoints || count > kMostCurvePoints)
              throw InputError(
                  fmt::format("--curves is {}; it must be from {} to {}", count, kFewestCurvePoints, kMostCurvePoints));
            options.curve_points = count;
          },
          "number of landmarks to place on each curve and outline, at equal distances along it")
      ->group(kReadingGroup);
  add_text_option(
      verb, "--scale",
      [&options](const std::string& text) {
        if (text != "apply") throw InputError("--scale is '" + text + "'; it must be apply, or left out");
        options.applies_scale = true;
      },
      "NAME", "apply: multiply coordinates by the scale of their shape, such as SCALE= of tps");
  reads_file(verb.add_option("--links", options.links,
                             "lines between landmarks for pictures: a table of two columns, labels or numbers from 1")
                 ->type_name("FILE")
                 ->group(kReadingGroup));
}

void add_order_option(CLI::App& verb, bool& by_order) {
  verb.add_flag("--by-order", by_order,
                "landmarks, and rows of tables, correspond by their order [by their names, where a file has some]")
      ->group(kReadingGroup);
}

void add_flip_option(CLI::App& verb, formats::ReadOptions& options) {
  verb.add_flag_function(
          "--flip-y,!--no-flip-y", [&options](std::int64_t count) { options.y_down = count < 0; },
          "y of the landmarks points up, in all files; --no-flip-y: down, as the rows of a picture [as each file says, "
          "else "
          "down]")
      ->group(more(kInputGroup));
}

}  // namespace pulson
