#include "held_shapes.hpp"

#include <functional>
#include <map>
#include <utility>

namespace pulson::formats {
namespace {

std::map<std::string, LandmarkFile, std::less<>>& all_held() {
  static std::map<std::string, LandmarkFile, std::less<>> all;
  return all;
}

}  // namespace

HeldShapes::HeldShapes(std::string name, LandmarkFile file) : name_(std::move(name)) {
  all_held()[name_] = std::move(file);
}

HeldShapes::~HeldShapes() {
  if (!name_.empty()) all_held().erase(name_);
}

HeldShapes::HeldShapes(HeldShapes&& other) noexcept : name_(std::exchange(other.name_, {})) {}

const LandmarkFile* held_shapes(const std::filesystem::path& name) {
  if (all_held().empty()) return nullptr;
  const auto found = all_held().find(name.string());
  return found == all_held().end() ? nullptr : &found->second;
}

}  // namespace pulson::formats
