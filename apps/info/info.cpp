// `pulson info`: the tables of names, or what is in a landmark file.

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>

#include <fmt/core.h>

#include "file.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/formats/landmark_files.hpp"
#include "pulson/integrators/integrator.hpp"
#include "pulson/kernels/kernel_operator.hpp"
#include "pulson/noise/noise_table.hpp"
#include "shell/messages.hpp"
#include "shell/misspelt.hpp"
#include "shell/read_options.hpp"
#include "shell/verbs.hpp"

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

/// ".csv .tsv", or "-" where only the content identifies the format
std::string list_extensions(const LandmarkFormat& format) {
  std::string list;
  for (const std::string& extension : format.extensions) list += (list.empty() ? "." : " .") + extension;
  return list.empty() ? "-" : list;
}

void print_formats() {
  std::size_t names = 0;
  std::size_t extensions = 0;
  for (const LandmarkFormat& format : landmark_formats()) {
    names = std::max(names, format.name.size());
    extensions = std::max(extensions, list_extensions(format).size());
  }
  for (const LandmarkFormat& format : landmark_formats())
    fmt::print("{:<{}}  {:<13}  {:<{}}  {}\n", format.name, names, format.write != nullptr ? "read, written" : "read",
               list_extensions(format), extensions, format.help);
}

void print_info(const std::string& what, const FileInfoOptions& options) {
  if (what == "kernels") return print_table(kernel_table());
  if (what == "noises") return print_table(noise_table());
  if (what == "integrators") return print_table(integrator_table());
  if (what == "formats") return print_formats();
  if (what != "-" && !std::filesystem::exists(what) && what.find('#') == std::string::npos)
    throw InputError("info: '" + what + "' is neither a file nor one of kernels, noises, integrators, formats" +
                     suggestion(what, {"kernels", "noises", "integrators", "formats"}));
  print_file_info(what, options);
}

}  // namespace

void add_info_verb(CLI::App& program) {
  CLI::App* verb = program.add_subcommand("info", "Print the tables of kernels, noises, … or the contents of a file");
  auto what = std::make_shared<std::string>();
  auto options = std::make_shared<FileInfoOptions>();
  verb->add_option("WHAT", *what, "kernels, noises, integrators, formats, or a landmark file")->required();
  verb->add_flag("--all", options->all, "list all shapes of the file, not only the first 20");
  verb->add_option("--json", options->json,
                   "also write the contents as JSON to this file; -: to standard output, without the text")
      ->type_name("FILE");
  add_quiet_option(*verb);
  add_read_options(*verb, options->reading);
  verb->footer(
      "Examples:\n  pulson info noises\n  pulson info wings.tps\n"
      "Exit codes: 0 done, 2 bad input.");
  verb->callback([what, options] { print_info(*what, *options); });
}

}  // namespace pulson
