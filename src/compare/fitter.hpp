#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "amplitudes.hpp"
#include "matching/log_maximum.hpp"
#include "posterior.hpp"
#include "pulson/compare/cohort_fit.hpp"
#include "variances.hpp"

namespace pulson {

inline std::size_t at(Eigen::Index i) { return static_cast<std::size_t>(i); }

/// Deviations of the numbers in a search, at least and at most.
inline constexpr double kLeastScale = 0.02, kMostScale = 0.5;

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
    double value = 0;      ///< the evidence
    Eigen::VectorXd bend;  ///< what sampling adds to the curvature along each number; empty where nothing
  };

  /// A quadratic model of what is added to Laplace's evidence, in the coordinates of place().
  struct Excess {
    Eigen::VectorXd at;
    double value = 0;
    Eigen::VectorXd slope, bend;  ///< −∂² along each
    double operator()(const Eigen::VectorXd& x) const;
  };
  using Draws = std::vector<std::vector<Eigen::VectorXd>>;  ///< where the iteration of each draw of a shape begins

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

  // In evidence_search.cpp.
  double variance(const State& state, Eigen::Index group) const;
  Eigen::VectorXd place(const State& state) const;
  State moved(const State& from, const Eigen::VectorXd& to) const;
  LogSearch box(const Eigen::VectorXd& x, const Eigen::VectorXd& scale, const std::vector<Eigen::Index>& free,
                double range) const;
  double least_place(Eigen::Index i) const;
  Maximum maximise(const State& from, const Excess& excess, const Eigen::VectorXd& scale, double range) const;
  Eigen::MatrixXd curvature(const State& best, const Eigen::VectorXd& scale) const;
  Eigen::MatrixXd information(const State& best) const;
  Eigen::MatrixXd information(const Maximum& maximum) const;
  double sampled_excess(const State& state, Draws& draws) const;
  std::optional<Maximum> correct(const State& start, const Eigen::VectorXd& scale, Draws& draws) const;
  Maximum search(const State& start) const;

  void check_observable(const MatchingObjective& objective, const State& at_rest) const;
  CohortFit record(const Maximum& maximum) const;
  std::vector<FittedNumber> numbers(const Maximum& maximum) const;
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
