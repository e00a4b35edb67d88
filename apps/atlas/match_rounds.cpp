#include "match_rounds.hpp"

#include <fmt/format.h>

#include "core/atomic_file.hpp"
#include "core/paths.hpp"
#include "core/state_bytes.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "shell/messages.hpp"
#include "shell/ranks.hpp"
#include "shell/units.hpp"

namespace pulson {
namespace {

using Json = nlohmann::ordered_json;

std::string bytes_of(const std::vector<double>& numbers) {
  StateWriter state;
  state(numbers);
  return state.take();
}

/// Of all lists that are there, one after the other.
std::vector<double> doubles_of(std::string_view bytes) {
  StateReader state(bytes);
  std::vector<double> all, list;
  while (!state.at_end()) {
    state(list);
    all.insert(all.end(), list.begin(), list.end());
  }
  return all;
}

/// What rank 0 has, on all ranks.
std::string from_first(std::string_view bytes) { return ranks::gather(ranks::is_first() ? bytes : std::string_view()); }

/// The numbers of each item, which are as many, in the order of the items; each rank had every R-th.
std::vector<double> in_order(const std::vector<double>& gathered, int count) {
  const std::size_t length = gathered.size() / static_cast<std::size_t>(count);
  std::vector<double> ordered(gathered.size());
  std::size_t from = 0;
  for (int rank = 0; rank < ranks::size(); ++rank)
    for (int i = rank; i < count; i += ranks::size(), from += length)
      std::copy_n(gathered.begin() + static_cast<std::ptrdiff_t>(from), length,
                  ordered.begin() + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(i) * length));
  return ordered;
}

}  // namespace

MatchRounds::MatchRounds(records::UnitRun run, const std::filesystem::path& file, bool saved)
    : run_(std::move(run)), file_(file), begin_(seconds_now()), saved_(begin_) {
  if (saved) resume_units(run_, read_saved(file), file.string());
  before_ = run_.seconds;
  const std::vector<double> rounds = doubles_of(from_first(bytes_of({static_cast<double>(run_.results.size())})));
  saved_rounds_ = static_cast<int>(rounds.front());
}

std::vector<double> MatchRounds::made_here(int count, const Match& match) const {
  const int own = count > ranks::rank() ? (count - 1 - ranks::rank()) / ranks::size() + 1 : 0;
  std::vector<Eigen::VectorXd> made(static_cast<std::size_t>(own));
  parallel_for(own, [&](int k) { made[static_cast<std::size_t>(k)] = match(ranks::rank() + k * ranks::size()); });
  std::vector<double> numbers;
  for (const Eigen::VectorXd& numbers_of_one : made)
    numbers.insert(numbers.end(), numbers_of_one.begin(), numbers_of_one.end());
  return numbers;
}

void MatchRounds::share(int count, const Match& match, const Store& store) {
  std::vector<double> all;
  if (round_ < saved_rounds_) {
    const auto found = run_.results.find(round_);  // on rank 0 alone
    std::string_view bytes;
    if (found != run_.results.end()) {
      const auto& binary = found->second.get_binary();
      bytes = {reinterpret_cast<const char*>(binary.data()), binary.size()};
    }
    all = doubles_of(from_first(bytes));
    if (all.size() % static_cast<std::size_t>(count) != 0 || all.empty())
      throw InputError(fmt::format("'{}' is damaged: remove it and start again", file_.string()));
  } else {
    try {
      const std::string stops = ranks::gather(Interrupt::came() ? "1" : "0");
      if (stops.find('1') != std::string::npos) throw ranks::Interrupted();
      all = in_order(doubles_of(ranks::gather(bytes_of(made_here(count, match)))), count);
    } catch (const ranks::Interrupted&) {
      save();
      throw;
    }
    if (ranks::is_first()) {
      const std::string bytes = bytes_of(all);
      run_.results[round_] = Json::binary({bytes.begin(), bytes.end()});
      run_.seconds = before_ + seconds_now() - begin_;
    }
  }
  ++round_;
  const auto length = static_cast<Eigen::Index>(all.size()) / count;
  for (int i = 0; i < count; ++i) store(i, Eigen::Map<const Eigen::VectorXd>(all.data() + i * length, length));
  constexpr double kSecondsBetween = 10;
  if (seconds_now() - saved_ < kSecondsBetween) return;
  saved_ = seconds_now();
  save();
}

void MatchRounds::save() const {
  if (ranks::is_first()) write_file_atomically(file_, unit_part(run_));
}

}  // namespace pulson
