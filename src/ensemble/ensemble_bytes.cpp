// Sums of an ensemble as bytes: in checkpoints, and on their way to another process.

#include <algorithm>
#include <iterator>
#include <utility>

#include "core/state_bytes.hpp"
#include "pulson/ensemble/ensemble.hpp"

namespace pulson::ensemble {

namespace {

// Each of these describes both directions, see StateWriter.

template <class State, class Moments>
void pass_moments(State& state, Moments& list) {
  state.list(list, [&](auto& moments) { state(moments.count, moments.mean, moments.squares); });
}

template <class State, class Nodes>
void pass_nodes(State& state, Nodes& nodes) {
  state.list(nodes, [&](auto& node) {
    state(node.first_block, node.level);
    pass_moments(state, node.moments);
    pass_moments(state, node.pair_moments);
  });
}

// Without the empty bins at both ends, which are most: how many there are, the first of the others, and these.

void pass_bins(StateWriter& state, const std::vector<std::uint64_t>& counts) {
  const auto is_filled = [](std::uint64_t count) { return count > 0; };
  const auto first = std::find_if(counts.begin(), counts.end(), is_filled);
  const auto last = std::find_if(counts.rbegin(), std::make_reverse_iterator(first), is_filled);
  state(static_cast<std::int64_t>(counts.size()), static_cast<std::int64_t>(first - counts.begin()),
        std::vector<std::uint64_t>(first, last.base()));
}

void pass_bins(StateReader& state, std::vector<std::uint64_t>& counts) {
  constexpr std::int64_t kMostBins = 1 << 16;  // of 16 bits, as lanes number them
  std::int64_t size = 0, first = 0;
  std::vector<std::uint64_t> filled;
  state(size, first, filled);
  if (size < 0 || size > kMostBins || first < 0 || first > size || std::ssize(filled) > size - first)
    StateReader::fail();
  counts.assign(static_cast<std::size_t>(size), 0);
  std::copy(filled.begin(), filled.end(), counts.begin() + first);
}

/// All but the tree.
template <class State, class Sums>
void pass_sums(State& state, Sums& sums) {
  state(sums.samples, sums.paths.clean, sums.paths.no_root, sums.paths.momentum_bound, sums.paths.tie);
  state(sums.crossing.at_end, sums.crossing.ever, sums.crossing.pairs, sums.momentum_error, sums.largest_momentum);
  state.list(sums.histograms, [&](auto& record) {
    state.list(record, [&](auto& histogram) {
      state(histogram.low, histogram.high, histogram.smallest, histogram.largest);
      pass_bins(state, histogram.counts);
    });
  });
  state(sums.states);
}

// Of larger counts sums would overflow.
constexpr std::int64_t kMostCounted = std::int64_t{1} << 52U;
constexpr int kHighestLevel = 52;

bool is_count(std::int64_t count) { return count >= 0 && count <= kMostCounted; }

/// Whether nothing is counted more often than there are paths.
bool has_counts(const EnsembleSums& sums) {
  if (!is_count(sums.samples)) return false;
  const auto fits = [&](std::int64_t count) { return count >= 0 && count <= sums.samples; };
  for (const std::int64_t count : {sums.paths.clean, sums.paths.no_root, sums.paths.momentum_bound, sums.paths.tie,
                                   sums.crossing.at_end, sums.crossing.ever})
    if (!fits(count)) return false;
  for (const auto& record : sums.histograms)
    for (const Histogram& histogram : record)
      for (const std::uint64_t count : histogram.counts)
        if (count > static_cast<std::uint64_t>(sums.samples)) return false;
  return std::all_of(sums.crossing.pairs.begin(), sums.crossing.pairs.end(), fits);
}

/// Whether moments of the paths can be added to each other.
bool can_be_added(const std::vector<MomentNode>& nodes, std::int64_t samples) {
  Eigen::Index coordinates = -1;
  const auto fit = [&](const std::vector<Moments>& list) {
    return std::all_of(list.begin(), list.end(), [&](const Moments& moments) {
      if (moments.count < 0 || moments.count > samples) return false;
      if (moments.count == 0) return true;
      if (coordinates < 0) coordinates = moments.mean.size();
      return moments.mean.size() == coordinates && moments.squares.size() == coordinates;
    });
  };
  return std::all_of(nodes.begin(), nodes.end(), [&](const MomentNode& node) {
    return is_count(node.first_block) && node.level >= 0 && node.level <= kHighestLevel &&
           node.moments.size() == nodes.front().moments.size() &&
           node.pair_moments.size() == nodes.front().pair_moments.size() && fit(node.moments) && fit(node.pair_moments);
  });
}

}  // namespace

std::string bytes_of(const EnsembleSums& sums) {
  StateWriter state;
  pass_sums(state, sums);
  pass_nodes(state, sums.tree.nodes());
  return state.take();
}

EnsembleSums sums_of_bytes(std::string_view bytes) {
  StateReader state(bytes);
  EnsembleSums sums;
  pass_sums(state, sums);
  std::vector<MomentNode> nodes;
  pass_nodes(state, nodes);
  state.require_end();
  if (!has_counts(sums) || !can_be_added(nodes, sums.samples)) StateReader::fail();
  for (MomentNode& node : nodes) sums.tree.add(std::move(node));
  return sums;
}

}  // namespace pulson::ensemble
