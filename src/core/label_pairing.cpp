#include "pulson/core/label_pairing.hpp"

#include <map>
#include <optional>

#include <fmt/core.h>

namespace pulson {
namespace {

using Places = std::map<std::string, int>;

/// Where each label stands; nothing where they do not name all landmarks, each by another name.
std::optional<Places> places_of(const Landmarks& shape) {
  if (shape.labels.empty()) return std::nullopt;
  Places places;
  for (std::size_t a = 0; a < shape.labels.size(); ++a)
    if (shape.labels[a].empty() || !places.try_emplace(shape.labels[a], static_cast<int>(a)).second)
      return std::nullopt;
  return places;
}

Landmarks in_order(const Landmarks& shape, const std::vector<int>& order) {
  Landmarks result = shape;
  result.points = shape.points(Eigen::all, order);
  for (std::size_t a = 0; a < order.size(); ++a) {
    const auto from = static_cast<std::size_t>(order[a]);
    result.labels[a] = shape.labels[from];
    if (!shape.groups.empty()) result.groups[a] = shape.groups[from];
    if (!shape.numbers.empty()) result.numbers[a] = shape.numbers[from];
  }
  return result;
}

}  // namespace

Landmarks paired_by_labels(const Landmarks& first, const Landmarks& other, std::vector<std::string>& notes) {
  const std::optional<Places> wanted = places_of(first), given = places_of(other);
  if (!wanted || !given || first.labels == other.labels) return other;
  std::vector<int> order;
  std::string elsewhere;
  for (std::size_t a = 0; a < first.labels.size(); ++a) {
    const auto found = given->find(first.labels[a]);
    if (found == given->end()) continue;
    order.push_back(found->second);
    if (elsewhere.empty() && found->second != static_cast<int>(a)) elsewhere = first.labels[a];
  }
  if (elsewhere.empty()) return other;
  if (order.size() == wanted->size() && wanted->size() == given->size()) {
    notes.push_back(
        fmt::format("{}: its landmarks stand in another order than those of {}; they are paired by their labels",
                    other.source, first.source));
    return in_order(other, order);
  }
  notes.push_back(fmt::format(
      "{} and {}: the landmark '{}' stands at different places and other labels differ; landmarks are paired "
      "by their order",
      first.source, other.source, elsewhere));
  return other;
}

}  // namespace pulson
