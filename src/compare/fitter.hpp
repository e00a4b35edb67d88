#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "amplitudes.hpp"
#include "matching/log_maximum.hpp"
#include "posterior.hpp"
#include "pulson/compare/cohort_fit.hpp"
#include "variances.hpp"

namespace pulson {

inline std::size_t at(Eigen::Index i) { return static_cast<std::size_t>(i); }

/// factor·factorᵀ
Eigen::MatrixXd squared(const Eigen::MatrixXd& factor);

/// One fit of a model to a cohort, see fit_cohort().
class Fitter {
 public:
  Fitter(const Cohort& cohort, OpenNoise noise, const CohortSettings& settings);

  CohortFit run();

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
  };
  /// The numbers of greatest evidence.
  struct Maximum {
    State state;
    double gain = 0;  ///< by the search, nats
  };

  KernelOperator kernel(const State& state) const;
  MatchingObjective objective(const State& state) const;
  MatchingProblem problem(const State& state, int target) const;
  VarianceData variance_data(const MatchingObjective& objective, int target, const Linearised& match) const;
  Eigen::VectorXd drift(const MatchingObjective& objective, const Observation& observation, const Linearised& match,
                        Eigen::Index group) const;
  Eigen::Index groups() const { return (lambda_open_ ? 1 : 0) + std::ssize(amplitudes_); }
  Eigen::Index numbers_open() const { return groups() + (settings_.fit_width ? 1 : 0) + std::ssize(others_); }
  State start() const;
  void match(State& state, const std::vector<Eigen::VectorXd>& from, bool with_other_starts) const;
  std::vector<Eigen::VectorXd> rescale(State& state, const Eigen::VectorXd& u) const;
  std::vector<Eigen::VectorXd> match_with_backoff(State& state, std::vector<Eigen::VectorXd> from,
                                                  Eigen::VectorXd u) const;
  void find_variances(State& state) const;
  State alternate(State state, int most_rounds) const;
  State try_without_noise(State best) const;

  // In evidence_search.cpp.
  double variance(const State& state, Eigen::Index group) const;
  Eigen::VectorXd place(const State& state) const;
  State moved(const State& from, const Eigen::VectorXd& to) const;
  LogSearch box(const Eigen::VectorXd& x) const;
  Maximum maximise(const State& from, const Eigen::VectorXd& slope) const;
  Eigen::MatrixXd information(const State& best) const;
  double sampled_excess(const State& state) const;
  Maximum correct(Maximum best) const;

  void check_observable(const MatchingObjective& objective, const State& at_rest) const;
  CohortFit record(const State& state) const;
  std::vector<FittedNumber> numbers(const State& state) const;
  ShapeFit shape_fit(const MatchingObjective& objective, const Linearised& match, int target) const;

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
  Eigen::VectorXd units_;                 ///< variances of the groups whose effect is σ²
  std::vector<Observation> observations_;
};

}  // namespace pulson
