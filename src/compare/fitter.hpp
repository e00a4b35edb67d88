#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "amplitudes.hpp"
#include "evidence_map.hpp"
#include "known_matches.hpp"
#include "newton.hpp"
#include "posterior.hpp"
#include "pulson/compare/cohort_fit.hpp"
#include "pulson/core/parallel.hpp"
#include "variances.hpp"

namespace pulson::compare {

inline std::size_t at(Eigen::Index i) { return static_cast<std::size_t>(i); }

/// factor·factorᵀ
Eigen::MatrixXd squared(const Eigen::MatrixXd& factor);

/// What is done for each shape, in parallel, some shapes after others until it is not enough for one of them.
/// @return whether it was for all
template <typename Of>
bool while_enough(int shapes, const Of& of) {
  constexpr int kAtOnce = 8;
  std::vector<char> enough(static_cast<std::size_t>(shapes));
  for (int first = 0; first < shapes; first += kAtOnce) {
    const int some = std::min(kAtOnce, shapes - first);
    parallel_for(some, [&](int i) { enough[at(first + i)] = of(first + i) ? 1 : 0; });
    if (std::find(enough.begin() + first, enough.begin() + first + some, 0) != enough.begin() + first + some)
      return false;
  }
  return true;
}

/// Nats of Laplace's evidence below the greatest, at which the samples of a candidate are not taken.
inline constexpr double kHopeless = 15;

/// Shapes that stand for all of a cohort of at least twice as many.
inline constexpr int kFew = 16;

/// Of Fitter::alternate() at most.
inline constexpr int kMostAlternations = 30;

/// One fit of a model to a cohort, see fit_cohort().
class Fitter {
 public:
  Fitter(const Cohort& cohort, OpenNoise noise, const CohortSettings& settings);

  CohortFit run();

  /// The same, but that the numbers of a large cohort are those of a part of it, without intervals.
  CohortFit run_by_part();

  /// From the numbers of a fit to more shapes to the maximum of Laplace's evidence nearest to these, without intervals.
  /// One step of Fisher scoring does for a large cohort, in whose deviations the evidence is quadratic.
  /// @param which of those shapes these are
  CohortFit run_again(const CohortFit& before, const std::vector<int>& which);

 private:
  /// The parameters of the model, and the matches for them.
  struct State {
    double lambda = 1;
    double width = 1;            ///< of the kernel, in units of that it is given with
    Eigen::VectorXd parameters;  ///< of the noise
    std::vector<Linearised> matches;
    VarianceFit variances;
    int rounds = 0;
    bool converged = false;
    double log_evidence() const;
    bool all_matched() const;
  };
  /// The numbers of greatest evidence, in the coordinates of place(), and their intervals of 90 %.
  struct Maximum {
    State state;
    Eigen::MatrixXd information;  ///< −∇² of the evidence
    Eigen::VectorXd low, high;    ///< ±∞ where the evidence does not fall
  };
  /// What the samples add to Laplace's evidence of each shape, see EvidenceMap::add_samples().
  struct Excess {
    std::vector<Eigen::VectorXd> of_shapes;
    bool enough = true;  ///< whether enough draws of each are effective
  };
  /// Where the evidence is charted: about the place of a state, from whose matches all others begin.
  struct Chart {
    State centre;
    Eigen::MatrixXd metric;  ///< about −∇² there
    Box box;
    Eigen::MatrixXd axes() const;
  };
  using Draws = std::vector<std::vector<Eigen::VectorXd>>;  ///< where the iteration of each draw of a shape begins

  KernelOperator kernel(const State& state) const;
  matching::MatchingObjective objective(const State& state) const;
  matching::MatchingProblem problem(const State& state, int target) const;
  VarianceData variance_data(const matching::MatchingObjective& objective, int target, const Linearised& match) const;
  Eigen::VectorXd drift(const matching::MatchingObjective& objective, const Observation& observation,
                        const Linearised& match, Eigen::Index group) const;
  Eigen::Index groups() const { return (lambda_open_ ? 1 : 0) + std::ssize(amplitudes_); }
  Eigen::Index numbers_open() const { return groups() + (settings_.fit_width ? 1 : 0) + std::ssize(others_); }
  State start(double width) const;
  void find_units(const State& first);
  void match(State& state, const std::vector<Eigen::VectorXd>& from, bool with_other_starts,
             const std::vector<Eigen::VectorXd>& foretold = {}) const;
  void scale(State& state, const Eigen::VectorXd& u) const;
  std::vector<Eigen::VectorXd> rescale(State& state, const Eigen::VectorXd& u) const;
  std::vector<Eigen::VectorXd> match_with_backoff(State& state, std::vector<Eigen::VectorXd> from,
                                                  Eigen::VectorXd u) const;
  bool improve(State& state) const;
  void find_variances(State& state) const;
  State alternate(State state, int most_rounds) const;

  // In evidence_search.cpp: Laplace's evidence.
  double variance(const State& state, Eigen::Index group) const;
  Eigen::VectorXd place(const State& state) const;
  State moved(const State& from, const Eigen::VectorXd& to);
  Box everywhere(const State& start) const;
  SecondOrder second_order(const State& here, const Box& box, const Eigen::VectorXd& steps);
  State climb(const State& from, const Box& box, NewtonOptions options = {});
  State best_start() const;
  std::vector<State> climbed(const State& start);
  std::vector<State> candidates();
  bool is_large() const;
  Cohort part() const;
  State with_numbers_of(const State& of_few) const;

  // In sampled_search.cpp: that of the samples.
  Excess sampled_excess(const State& state, Draws& draws) const;
  State best_candidate(const std::vector<State>& candidates, EvidenceMap& map, Draws& draws);
  std::optional<State> charted(const State& from, const Eigen::VectorXd& x, bool with_samples, EvidenceMap& map,
                               Draws& draws);
  Chart chart_about(const State& state, const Box& box);
  std::optional<State> approach(const Chart& chart, EvidenceMap& map, Draws& draws);
  void survey(const Chart& chart, EvidenceMap& map, Draws& draws);
  State vanishing_if_likelier(const Chart& chart, State best, EvidenceMap& map, Draws& draws);
  Maximum find_intervals(const Chart& chart, State best, EvidenceMap& map, Draws& draws);
  Maximum search(const std::vector<State>& candidates);
  Maximum maximum();

  void check_observable(const matching::MatchingObjective& objective, const State& at_rest) const;
  CohortFit record(const Maximum& maximum) const;
  CohortFit record_without_intervals(const State& state) const;
  std::vector<FittedNumber> numbers(const Maximum& maximum) const;
  bool sample(const matching::MatchingObjective& objective, const Linearised& match, int target, ShapeFit& fit) const;
  ShapeFit shape_fit(const matching::MatchingObjective& objective, const Linearised& match, int target) const;

  const Cohort& cohort_;
  const CohortSettings& settings_;
  double sigma_;  ///< of the settings, length units
  KernelOperator kernel_;
  std::shared_ptr<const Integrator> integrator_;
  OpenNoise noise_;
  bool lambda_open_;
  std::vector<Eigen::Index> amplitudes_;  ///< open parameters that are amplitudes
  std::vector<Eigen::Index> others_;      ///< those that are not
  std::vector<int> group_of_channel_;     ///< −1: fixed
  Eigen::VectorXd units_;                 ///< variances of the groups, v₀ of place()
  std::vector<Observation> observations_;
  KnownMatches known_;
};

}  // namespace pulson::compare
