#pragma once

#include <string>
#include <vector>

#include "pulson/ensemble/ensemble.hpp"

namespace pulson::records {

/// A shard's file, and how far it has come.
struct ShardState {
  std::string name;
  ensemble::Shard shard;
  std::int64_t done = 0;
  std::int64_t all = 0;
  std::string what;  ///< is counted: `paths`
};

/// The index of each shard of one run in `parts`, in the order of the shards. @throws InputError that names the shard
/// which is missing, there twice or not finished
std::vector<std::size_t> shards_in_order(const std::vector<ShardState>& parts);

}  // namespace pulson::records
