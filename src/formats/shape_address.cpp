#include "shape_address.hpp"

#include <algorithm>
#include <charconv>
#include <utility>

#include <fmt/format.h>

#include "core/paths.hpp"
#include "core/text.hpp"
#include "held_shapes.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/formats/landmark_files.hpp"
#include "shape_options.hpp"

namespace pulson::formats {
namespace {

constexpr std::string_view kIdPrefix = "id=";

struct Address {
  std::string path;
  std::string selector;  // what follows '#', empty where there is no '#'
  bool has_selector = false;
};

/// The path may hold '#' itself: it is the longest part before a '#', or the whole, that is there; else the part before
/// the last '#'.
Address split_address(const std::string& address) {
  if (address == "-") return {std::string(text::kStandardInput), "", false};
  const auto exists = [](const std::string& path) {
    return path == text::kStandardInput || held_shapes(path) || is_there(path);
  };
  const std::size_t last = address.rfind('#');
  if (last == std::string::npos || exists(address)) return {address, "", false};
  std::size_t hash = last;
  while (hash != std::string::npos && hash > 0 && !exists(address.substr(0, hash))) hash = address.rfind('#', hash - 1);
  if (hash == std::string::npos || hash == 0) hash = last;
  return {address.substr(0, hash), address.substr(hash + 1), true};
}

/// At most 10 of the items.
std::string list_some(const std::vector<std::string>& items) {
  constexpr std::size_t kMost = 10;
  const std::size_t shown = std::min(kMost, items.size());
  const std::string list = fmt::format("{}", fmt::join(items.begin(), items.begin() + shown, ", "));
  return items.size() > shown ? fmt::format("{}, ... ({} in all)", list, items.size()) : list;
}

std::string describe_count(const Address& address, const LandmarkFile& file) {
  return address.path + " has " + text::counted(file.shapes.size(), "shape");
}

std::size_t find_only(const Address& address, const LandmarkFile& file) {
  if (file.shapes.size() == 1) return 0;
  throw InputError(fmt::format("{}; choose one as {}#1 or {}#id={}", describe_count(address, file), address.path,
                               address.path, file.shapes.front().name));
}

std::vector<std::string> names_in(const LandmarkFile& file) {
  std::vector<std::string> names;
  names.reserve(file.shapes.size());
  for (const Landmarks& shape : file.shapes) names.push_back(shape.name);
  return names;
}

/// "; did you mean a.tps#id=NAME?" where there is such a name, or one like it.
std::string advice_on_id(const Address& address, const LandmarkFile& file) {
  const std::vector<std::string> names = names_in(file);
  const bool is_name = std::find(names.begin(), names.end(), address.selector) != names.end();
  const std::string near = is_name ? address.selector : nearest_name(address.selector, names);
  return near.empty() ? "" : fmt::format("; did you mean '{}#{}{}'?", address.path, kIdPrefix, near);
}

std::size_t find_number(const Address& address, const LandmarkFile& file) {
  std::size_t number = 0;
  const char* const end = address.selector.data() + address.selector.size();
  const auto [stop, error] = std::from_chars(address.selector.data(), end, number);
  if (stop != end || error == std::errc::invalid_argument)
    throw InputError(
        fmt::format("'{}' follows '#' in the address of a shape in {}; a number from 1 or id=NAME is needed{}",
                    address.selector, address.path, advice_on_id(address, file)));
  if (error == std::errc() && number >= 1 && number <= file.shapes.size()) return number - 1;
  throw InputError(fmt::format("{}, counted from 1; there is no #{}", describe_count(address, file), address.selector));
}

[[noreturn]] void fail_unknown_name(const Address& address, const LandmarkFile& file, const std::string& name) {
  const std::vector<std::string> names = names_in(file);
  const std::string near = nearest_name(name, names);
  const std::string advice = near.empty() ? "it has " + list_some(names) : "did you mean '" + near + "'?";
  throw InputError(fmt::format("{} has no shape named '{}'; {}", address.path, name, advice));
}

std::size_t find_name(const Address& address, const LandmarkFile& file) {
  const std::string name = address.selector.substr(kIdPrefix.size());
  std::vector<std::string> numbers;
  std::size_t found = 0;
  for (std::size_t i = 0; i < file.shapes.size(); ++i) {
    if (file.shapes[i].name != name) continue;
    found = i;
    numbers.push_back(fmt::format("#{}", i + 1));
  }
  if (numbers.empty()) fail_unknown_name(address, file, name);
  if (numbers.size() > 1)
    throw InputError(fmt::format("{} has {} shapes named '{}': {}; choose one by its number", address.path,
                                 numbers.size(), name, list_some(numbers)));
  return found;
}

std::size_t find_shape(const Address& address, const LandmarkFile& file) {
  if (!address.has_selector) return find_only(address, file);
  return address.selector.starts_with(kIdPrefix) ? find_name(address, file) : find_number(address, file);
}

}  // namespace

std::string file_of_address(const std::string& address) { return split_address(address).path; }

LandmarkFile read_addressed_shapes(const std::string& address_text, const ReadOptions& options) {
  const Address address = split_address(address_text);
  LandmarkFile file = read_all_shapes(address.path, options);
  if (address.has_selector) {
    Landmarks shape = std::move(file.shapes[find_shape(address, file)]);
    shape.source = address_text;
    file.shapes.clear();
    file.shapes.push_back(std::move(shape));
  }
  apply_to_shapes(options, file);
  return file;
}

Landmarks read_landmarks(const std::string& address_text, std::vector<std::string>* warnings,
                         const ReadOptions& options) {
  const Address address = split_address(address_text);
  LandmarkFile file = read_all_shapes(address.path, options);
  Landmarks chosen = std::move(file.shapes[find_shape(address, file)]);
  chosen.source = address_text;
  file.shapes.clear();
  file.shapes.push_back(std::move(chosen));
  apply_to_shapes(options, file);
  Landmarks shape = std::move(file.shapes.front());
  if (shape.count() == 0) throw InputError(address_text + ": this shape has no landmarks");
  if (warnings != nullptr) warnings->insert(warnings->end(), file.warnings.begin(), file.warnings.end());
  return shape;
}

}  // namespace pulson::formats
