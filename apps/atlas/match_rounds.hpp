#pragma once

#include <filesystem>
#include <functional>

#include "pulson/cohort/atlas.hpp"
#include "records/unit_parts.hpp"
#include "shell/messages.hpp"

namespace pulson {

/// The matches of an atlas, round by round: shared out among the ranks, and saved every so often, so that a search
/// which is resumed takes the rounds that are there and comes to the same bits. While there is one, signals are noted.
class MatchRounds {
 public:
  /// @param run all on which the matches depend @param saved on rank 0, whether there is `file`, which is read then
  /// @throws InputError where that is of another run
  MatchRounds(records::UnitRun run, const std::filesystem::path& file, bool saved);

  using Match = std::function<Eigen::VectorXd(int)>;
  using Store = std::function<void(int, const Eigen::VectorXd&)>;
  /// AtlasOptions::share. @throws ranks::Interrupted after a signal, on all ranks; what there is is saved then
  void share(int count, const Match& match, const Store& store);

  /// Rounds that are saved.
  std::size_t rounds() const { return run_.results.size(); }

 private:
  std::vector<double> made_here(int count, const Match& match) const;
  void save() const;

  const Interrupt interrupt_;
  records::UnitRun run_;
  std::filesystem::path file_;
  double begin_;
  double saved_;
  double before_ = 0;     // seconds of the search that is resumed
  int saved_rounds_ = 0;  // known to all ranks
  int round_ = 0;
};

}  // namespace pulson
