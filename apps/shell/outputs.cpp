#include "outputs.hpp"

#include <fmt/format.h>

#include "core/atomic_file.hpp"
#include "draw/gnuplot.hpp"
#include "pulson/core/errors.hpp"

namespace pulson {

void OutputOptions::add_to(CLI::App& verb, const std::string& pictures) {
  verb.add_option("-o,--out", out, "folder for the results")->type_name("FOLDER")->required();
  verb.add_option("--json", json, "also write the record to this file; -: to standard output, and nothing else there")
      ->type_name("FILE");
  verb.add_flag("--no-picture", no_picture, "do not draw " + pictures);
  add_quiet_option(verb);
}

void OutputOptions::check(const std::vector<std::string>& files, const std::vector<std::string>& pictures) const {
  if (!no_picture && !Gnuplot::is_installed())
    throw InputError("gnuplot was not found; install it (Debian: gnuplot-nox) or give --no-picture");
  if (!json.empty() && json != "-") check_output_file(json);
  create_output_directory(out);
  lock = std::make_shared<FolderLock>(out);
  for (const std::string& name : files) check_output_file(file(name));
  if (no_picture) return;
  for (const std::string& name : pictures) check_output_file(file(name));
}

void OutputOptions::write_json(const std::string& record) const {
  if (json == "-")
    fmt::print("{}", record);
  else if (!json.empty())
    write_file_atomically(json, record);
}

void OutputOptions::print_written(std::vector<std::string> files, const std::vector<std::string>& pictures) const {
  if (!no_picture) files.insert(files.end(), pictures.begin(), pictures.end());
  fmt::print("wrote      {}: {}\n", out, fmt::join(files, ", "));
}

}  // namespace pulson
