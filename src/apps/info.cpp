// `pulson info`: the tables of names, or what is in a landmark file.

#include <cmath>
#include <filesystem>

#include <fmt/core.h>

#include "pulson/integrators/integrator.hpp"
#include "pulson/io/landmark_files.hpp"
#include "pulson/kernels/kernel_operator.hpp"
#include "pulson/noise/noise_table.hpp"
#include "verbs.hpp"

namespace pulson {
namespace {

template <class Make>
void print_table(const NameTable<Make>& table) {
  for (const auto& row : table.rows()) {
    fmt::print("{:<18} {}\n", row.name, row.help);
    for (const ParameterInfo& parameter : row.parameters)
      fmt::print("    {:<14} {}{}\n", parameter.name, parameter.help,
                 parameter.default_text.empty() ? "" : " [" + parameter.default_text + "]");
  }
}

void print_formats() {
  for (const LandmarkFormat& format : landmark_formats()) {
    std::string extensions;
    for (const std::string& extension : format.extensions) extensions += " ." + extension;
    fmt::print("{:<6} {}\n       files{}\n", format.name, format.help, extensions);
  }
}

void print_shape(std::size_t number, const Landmarks& shape) {
  fmt::print("{:>5}  {:<24} {:>5} landmarks", number, shape.name, shape.count());
  if (shape.count() > 0) {
    const std::size_t missing = incomplete_points(shape.points).size();
    const auto [low, high] = bounding_box(shape.points);
    fmt::print(" in {}D", shape.dimension());
    for (int c = 0; c < shape.dimension() && !std::isnan(low[c]); ++c)
      fmt::print("{} {} {:.6g} to {:.6g}", c == 0 ? "," : "", "xyz"[c], low[c], high[c]);
    if (missing > 0) fmt::print(", {} missing", missing);
    if (const std::size_t groups = landmarks_by_group(shape).size(); groups > 1) fmt::print(", {} groups", groups);
    if (const auto pair = find_coincident(shape.points); pair && shape.count() > 1)
      fmt::print(", {} and {} coincide", shape.describe(pair->first), shape.describe(pair->second));
  }
  fmt::print("\n");
}

void print_file(const std::string& path) {
  const LandmarkFile file = read_landmark_file(path);
  fmt::print("{}: {} with {} shape{}\n", path, file.format, file.shapes.size(), file.shapes.size() == 1 ? "" : "s");
  for (std::size_t i = 0; i < file.shapes.size(); ++i) print_shape(i + 1, file.shapes[i]);
  for (const std::string& warning : file.warnings) fmt::print("note: {}\n", warning);
}

void print_info(const std::string& what) {
  if (what == "kernels") return print_table(kernel_table());
  if (what == "noises") return print_table(noise_table());
  if (what == "integrators") return print_table(integrator_table());
  if (what == "formats") return print_formats();
  if (!std::filesystem::exists(what))
    throw InputError("info: '" + what + "' is neither a file nor one of kernels, noises, integrators, formats");
  print_file(what);
}

}  // namespace

void add_info_verb(CLI::App& program) {
  CLI::App* verb = program.add_subcommand("info", "Print the tables of kernels, noises, … or what is in a file");
  auto what = std::make_shared<std::string>();
  verb->add_option("WHAT", *what, "kernels, noises, integrators, formats, or a landmark file")->required();
  verb->footer("Examples:\n  pulson info noises\n  pulson info wings.tps");
  verb->callback([what] { print_info(*what); });
}

}  // namespace pulson
