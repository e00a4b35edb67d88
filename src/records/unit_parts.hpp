#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "pulson/core/landmarks.hpp"
#include "pulson/ensemble/ensemble.hpp"

namespace pulson::records {

/// A run of independent units of work, such as simulations or fits, or a shard of one: unit u, from 0, is of shard
/// u mod n + 1 of n.
struct UnitRun {  // NOLINT(bugprone-exception-escape): moving Json throws nothing
  std::string verb;
  std::string settings;            ///< all options on which results depend, as a configuration file
  std::vector<Landmarks> shapes;   ///< what was read
  std::vector<std::string> notes;  ///< on these
  nlohmann::ordered_json facts{};  ///< what was computed once for all units
  ensemble::Shard shard{};
  int units = 0;                                  ///< of all shards
  std::map<int, nlohmann::ordered_json> results;  ///< of the units that are done
  int threads = 1;
  double seconds = 0;

  /// The units of the shard.
  std::vector<int> own_units() const;
  bool partial() const { return results.size() < own_units().size(); }
};

/// The CRC-32 of all on which the results depend, as eight hexadecimal digits; the same for all shards of a run.
std::string unit_fingerprint(const UnitRun& run);

/// A binary text (CBOR), numbers exact, that ends with its checksum.
std::string unit_part(const UnitRun& run);

/// Whether `bytes` begin as unit_part() does.
bool is_unit_part(std::string_view bytes);

/// What unit_part() wrote. @throws InputError if it is damaged; `name` is the file's
UnitRun read_unit_part(std::string_view bytes, std::string_view name);

/// The results and seconds of `part` go to `run`. @throws InputError that names what differs where `part` is of another
/// run or shard
void resume_units(UnitRun& run, UnitRun part, std::string_view name);

/// The whole run of these shards, in any order. `names` are their files'. @throws InputError that names the shard which
/// is missing, there twice, not finished or of another run
UnitRun merge_units(std::vector<UnitRun> parts, const std::vector<std::string>& names);

}  // namespace pulson::records
