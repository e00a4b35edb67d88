#include "shards.hpp"

#include <optional>
#include <utility>

#include <fmt/format.h>

#include "core/first_names.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::records {

namespace {

std::string shard_name(const ensemble::Shard& shard) { return fmt::format("{}/{}", shard.index, shard.count); }

void require_finished(const ShardState& part) {
  if (part.done < part.all)
    throw InputError(fmt::format("'{}' is not finished: it has {} of {} {}. Part {} has to go on before it is merged",
                                 part.name, part.done, part.all, part.what, shard_name(part.shard)));
}

}  // namespace

std::vector<std::size_t> shards_in_order(const std::vector<ShardState>& parts) {
  if (parts.empty()) throw InputError("there are no parts to merge");
  const int count = parts.front().shard.count;
  std::vector<std::optional<std::size_t>> places(static_cast<std::size_t>(count));
  for (std::size_t i = 0; i < parts.size(); ++i) {
    std::optional<std::size_t>& place = places.at(static_cast<std::size_t>(parts[i].shard.index) - 1);
    if (place)
      throw InputError(fmt::format("'{}' and '{}' are both part {}; one of them is enough", parts[*place].name,
                                   parts[i].name, shard_name(parts[i].shard)));
    place = i;
    require_finished(parts[i]);
  }
  std::vector<std::size_t> order;
  std::vector<std::string> missing;
  for (int k = 0; k < count; ++k)
    if (const auto& place = places[static_cast<std::size_t>(k)])
      order.push_back(*place);
    else
      missing.push_back(shard_name({k + 1, count}));
  if (missing.empty()) return order;
  constexpr std::size_t kMostNamed = 10;
  const bool are_several = missing.size() > 1;
  throw InputError(fmt::format("part{} {} {} missing", are_several ? "s" : "",
                               text::first_of(std::move(missing), kMostNamed), are_several ? "are" : "is"));
}

}  // namespace pulson::records
