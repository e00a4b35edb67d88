#include "read_options.hpp"

#include <algorithm>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "misspelt.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"

namespace pulson {
namespace {

constexpr const char* kGroup = "Reading landmarks";
constexpr int kFewestCurvePoints = 2;
constexpr int kMostCurvePoints = 100'000;

const std::vector<std::string> kColumnKeys = {"x", "y", "z", "name", "specimen", "group"};

void add_column(std::string_view text, ReadOptions& options) {
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

void set_columns(std::string_view text, ReadOptions& options) {
  for (bool is_last = false; !is_last;) {
    const std::size_t comma = text.find(',');
    is_last = comma == std::string_view::npos;
    add_column(text.substr(0, comma), options);
    if (!is_last) text.remove_prefix(comma + 1);
  }
}

void set_format(const std::string& name, ReadOptions& options) {
  std::vector<std::string> names;
  for (const LandmarkFormat& format : landmark_formats()) names.push_back(format.name);
  if (std::find(names.begin(), names.end(), name) == names.end())
    throw InputError(fmt::format("--format: '{}' is not a landmark format{}", name, advice_on_name(name, names)));
  options.format = name;
}

void add_text_option(CLI::App& verb, const std::string& name, const std::function<void(const std::string&)>& set,
                     const std::string& type, const std::string& help) {
  verb.add_option_function<std::string>(name, set, help)->type_name(type)->group(kGroup);
}

}  // namespace

void add_read_options(CLI::App& verb, ReadOptions& options) {
  add_text_option(
      verb, "--missing",
      [&options](const std::string& text) {
        if (text != "negative") throw InputError("--missing is '" + text + "'; it must be negative, or left out");
        options.negative_is_missing = true;
      },
      "NAME", "negative: each landmark with a negative coordinate is missing");
  add_text_option(
      verb, "--format", [&options](const std::string& name) { set_format(name, options); }, "NAME",
      "format of landmark files, see pulson info formats [recognised by their content]");
  add_text_option(
      verb, "--columns", [&options](const std::string& text) { set_columns(text, options); }, "NAMES",
      "columns of tables: x=COLUMN,y=COLUMN,… for x, y, z, name (of landmarks), specimen, group");
  verb.add_option_function<int>(
          "--dim",
          [&options](int d) {
            if (d != 2 && d != 3) throw InputError(fmt::format("--dim is {}; it must be 2 or 3", d));
            options.dimension = d;
          },
          "2 or 3: coordinates per landmark in a table of one column, one below the other")
      ->group(kGroup);
  add_text_option(
      verb, "--landmarks",
      [&options](const std::string& text) {
        if (text.empty()) throw InputError("--landmarks is empty; it must be numbers, ranges or labels, as in 1-20,25");
        options.landmarks = text;
      },
      "LIST", "landmarks to read, in this order: numbers in the file, ranges and labels, as in 1-20,25,tip [all]");
  verb.add_option_function<int>(
          "--curves",
          [&options](int count) {
            if (count < kFewestCurvePoints || count > kMostCurvePoints)
              throw InputError(
                  fmt::format("--curves is {}; it must be from {} to {}", count, kFewestCurvePoints, kMostCurvePoints));
            options.curve_points = count;
          },
          "number of landmarks to place on each curve and outline, at equal distances along it")
      ->group(kGroup);
  add_text_option(
      verb, "--scale",
      [&options](const std::string& text) {
        if (text != "apply") throw InputError("--scale is '" + text + "'; it must be apply, or left out");
        options.applies_scale = true;
      },
      "NAME", "apply: multiply coordinates by the scale of their shape, such as SCALE= of tps");
}

void add_flip_option(CLI::App& verb, ReadOptions& options) {
  verb.add_flag_function(
      "--flip-y,!--no-flip-y", [&options](std::int64_t count) { options.y_down = count > 0; },
      "draw y downwards, as in the rows of an image [if the landmark files are of images]");
}

}  // namespace pulson
