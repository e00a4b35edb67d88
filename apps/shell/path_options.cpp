#include "path_options.hpp"

#include <algorithm>
#include <fstream>
#include <map>
#include <stdexcept>

#include <fmt/format.h>

#include "core/atomic_file.hpp"
#include "formats/formats.hpp"
#include "formats/shape_address.hpp"
#include "path_uses.hpp"
#include "pulson/core/errors.hpp"

namespace pulson {

namespace {

std::map<const CLI::Option*, PathUse>& uses() {
  static std::map<const CLI::Option*, PathUse> all;
  return all;
}

CLI::Option* declare(CLI::Option* option, PathUse use, const char* type) {
  uses()[option] = use;
  return option->type_name(type);
}

// The path in the value of an option that is read.
std::filesystem::path read_path(PathUse use, const std::string& value) {
  if (use == PathUse::kShape) return formats::file_of_address(value);
  if (use == PathUse::kColumn && !std::filesystem::exists(value)) return value.substr(0, value.rfind(':'));
  return value;
}

}  // namespace

CLI::Option* reads_file(CLI::Option* option) { return declare(option, PathUse::kFile, "FILE"); }
CLI::Option* reads_shape(CLI::Option* option) { return declare(option, PathUse::kShape, "SHAPE"); }
CLI::Option* reads_column(CLI::Option* option) { return declare(option, PathUse::kColumn, "FILE.csv:COLUMN"); }
CLI::Option* writes_file(CLI::Option* option) { return declare(option, PathUse::kResult, "FILE"); }
CLI::Option* writes_folder(CLI::Option* option) { return declare(option, PathUse::kFolder, "FOLDER"); }
CLI::Option* reads_and_writes(CLI::Option* option) { return declare(option, PathUse::kBoth, "FILE"); }

bool declares_use(const CLI::Option* option) { return uses().contains(option); }

std::optional<PathUse> path_use(const CLI::Option* option) {
  const auto found = uses().find(option);
  return found == uses().end() ? std::nullopt : std::optional(found->second);
}

void require_declared_paths(const CLI::App& program) {
  for (const CLI::App* verb : program.get_subcommands({}))
    for (const CLI::Option* option : verb->get_options()) {
      const std::string type = option->get_type_name();
      const bool may_be_path =
          type == "TEXT" || type == "SHAPE" || type.starts_with("FILE") || type.starts_with("FOLD");
      if (may_be_path && option->get_type_size() != 0 && !declares_use(option))
        throw std::logic_error(fmt::format("{} of {} must declare a type, or what happens to its file",
                                           option->get_name(), verb->get_name()));
    }
}

void RunPaths::add_options_of(const CLI::App& verb) {
  for (const CLI::Option* option : verb.get_options()) {
    const auto found = uses().find(option);
    if (found == uses().end()) continue;
    for (const std::string& value : option->results()) {
      const bool is_written = found->second == PathUse::kResult || found->second == PathUse::kFolder;
      if (found->second == PathUse::kBoth || (is_written && value == "-")) continue;
      if (is_written)
        writes(value, option->get_name());
      else
        reads(read_path(found->second, value), option->get_name());
    }
  }
}

void RunPaths::reads(const std::filesystem::path& path, const std::string& what) {
  if (!is_file(path)) return;  // a word such as `mean`, or what the reader refuses
  const std::optional<FileIdentity> identity = identity_of(path);
  for (const Entry& output : outputs_)
    if (output.identity == identity)
      throw InputError(fmt::format("{} would replace {}, which is an input ({}); give it another name", output.what,
                                   quoted_path(output.path), what));
  inputs_.push_back({path, what, identity});
}

void RunPaths::writes(const std::filesystem::path& path, const std::string& what) {
  if (is_there(path) && !is_file(path) && !is_folder(path)) return;  // /dev/null can hold all of them
  const std::optional<FileIdentity> identity = identity_of(path);
  if (!identity) return;  // the check of the file itself refuses it
  for (const Entry& input : inputs_)
    if (input.identity == identity)
      throw InputError(fmt::format("{} would replace {}, which is an input ({}); give it another name", what,
                                   quoted_path(path), input.what));
  for (const Entry& output : outputs_)
    if (output.identity == identity)
      throw InputError(fmt::format("{} and {} would both write {}; give one of them another name", output.what, what,
                                   quoted_path(path)));
  outputs_.push_back({path, what, identity});
}

namespace {

bool begins_as_image(const std::filesystem::path& path) {
  if (!is_file(path)) return false;
  std::string begin(512, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(begin.data(), std::ssize(begin));
  begin.resize(static_cast<std::size_t>(file.gcount()));
  return formats::is_image(begin);
}

}  // namespace

void refuse_pictures(const CLI::App& verb) {
  std::vector<std::string> pictures;
  for (const CLI::Option* option : verb.get_options()) {
    const auto found = uses().find(option);
    if (found == uses().end() || found->second != PathUse::kShape) continue;
    for (const std::string& value : option->results())
      if (begins_as_image(read_path(PathUse::kShape, value))) pictures.push_back(value);
  }
  if (pictures.size() < 2) return;  // the reader of one names it
  throw InputError(
      fmt::format("{} are images; landmarks are needed, which docs/photographs.md says how to place; `warp` takes an "
                  "image, with a registration of landmarks",
                  fmt::join(pictures, ", ")));
}

RunPaths& run_paths() {
  static RunPaths paths;
  return paths;
}

void forget_path_options() {
  uses().clear();
  run_paths() = {};
}

void check_result_file(const std::filesystem::path& path, const std::string& what) {
  check_output_file(path);
  run_paths().writes(path, what);
}

}  // namespace pulson
