#include "cohort_shapes.hpp"

#include <cctype>
#include <iterator>
#include <set>

#include <fmt/format.h>

#include "core/landmark_pairs.hpp"

namespace pulson {

std::vector<Landmarks> read_shapes(const std::vector<std::string>& addresses, const formats::ReadOptions& options,
                                   std::vector<std::string>& notes) {
  std::vector<Landmarks> all;
  for (const std::string& address : addresses) {
    formats::LandmarkFile file = read_addressed_shapes(address, options);
    notes.insert(notes.end(), file.warnings.begin(), file.warnings.end());
    std::move(file.shapes.begin(), file.shapes.end(), std::back_inserter(all));
  }
  return all;
}

void CohortNotes::add(std::vector<std::string> notes) {
  if (first_.empty())
    first_ = std::move(notes);
  else if (!notes.empty())
    ++others_;
}

std::vector<std::string> CohortNotes::lines() && {
  if (others_ > 0) first_.back() += fmt::format("; likewise for {} more shapes", others_);
  return std::move(first_);
}

void put_in_order_of(const Landmarks& first, std::vector<Landmarks>& shapes, std::vector<std::string>& notes) {
  CohortNotes of_shapes;
  for (Landmarks& shape : shapes) {
    std::vector<std::string> of_shape;
    shape = in_order_of(first, in_frame_of(first, shape, of_shape), of_shape);
    of_shapes.add(std::move(of_shape));
  }
  const std::vector<std::string> lines = std::move(of_shapes).lines();
  notes.insert(notes.end(), lines.begin(), lines.end());
}

namespace {

constexpr std::size_t kLongestName = 100;  // bytes; file systems allow 255

// Bytes of UTF-8 beyond ASCII stay.
bool may_be_in_name(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return byte >= 0x80U || std::isalnum(byte) != 0 || c == '.' || c == '_' || c == '-';
}

std::string folder_name(const Landmarks& shape, std::size_t number) {
  std::string name = shape.name.empty() ? fmt::to_string(number) : shape.name;
  for (char& c : name)
    if (!may_be_in_name(c)) c = '_';
  if (name.front() == '.' || name.front() == '-') name.front() = '_';
  std::size_t length = std::min(name.size(), kLongestName);
  while (length < name.size() && length > 0 && (static_cast<unsigned char>(name[length]) & 0xC0U) == 0x80U) --length;
  return name.substr(0, length);
}

}  // namespace

std::vector<std::string> folder_names(const std::vector<Landmarks>& shapes, const std::vector<std::string>& others) {
  std::vector<std::string> names;
  std::set<std::string> taken(others.begin(), others.end());
  for (std::size_t s = 0; s < shapes.size(); ++s) {
    const std::string name = folder_name(shapes[s], s + 1);
    std::string free = name;
    for (int k = 2; !taken.insert(free).second; ++k) free = fmt::format("{}_{}", name, k);
    names.push_back(free);
  }
  return names;
}

}  // namespace pulson
