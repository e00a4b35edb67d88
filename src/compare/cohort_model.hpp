#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "matching/maximum.hpp"
#include "open_noise.hpp"
#include "own_mean.hpp"
#include "posterior/minimum.hpp"
#include "posterior/size_exponent.hpp"
#include "pulson/compare/cohort_fit.hpp"

namespace pulson::compare {

using matching::Box, matching::SecondOrder;

inline std::size_t at(Eigen::Index i) { return static_cast<std::size_t>(i); }

/// Variance, of σ² in the mean over coordinates, that no data would show.
inline constexpr double kNegligible = 1e-6;

/// MatchingProblem::faint of all that is fitted to a cohort: no data could determine momenta that move landmarks by
/// less than about 0.03 σ, and, where landmarks are dense relative to the kernel, no time step resolves them.
inline constexpr double kFaint = 1e-3;

/// A number of a model that is fitted.
struct ModelNumber {
  enum class Kind { kLambda, kAmplitude, kWidth, kOther, kSigma };
  Kind kind;
  std::string name;
  Eigen::Index parameter = 0;  ///< of the noise
  double unit = 1;             ///< v₀, or the value at x = 0

  /// Of x ≥ 0, where the number's variance vanishes at 0.
  bool is_variance() const { return kind == Kind::kLambda || kind == Kind::kAmplitude; }
  double value(double x) const;
  double place(double value) const;
};

/// The matches of all shapes at one place x, and the model linear about them.
struct Matches {
  Eigen::VectorXd x;
  posterior::Specimen::Model model;
  std::vector<posterior::Minimum> minima;
  std::shared_ptr<const posterior::LinearModel> at_rest;  ///< where the source is the shapes' own mean, else null
  double log_evidence = 0;                                ///< Laplace's

  bool all_converged() const;
};

/// A noise model of a cohort, as a function of the numbers that are fitted. These are places x on scales on which the
/// evidence is nearly quadratic: log(1 + v/v₀) of the variances v of momenta (1/λ) and channels, v₀ that whose effect
/// is some times σ², from 0 where they vanish, and of σ², v₀ that of the settings; the logarithm of others.
class CohortModel {
 public:
  /// @param cohort is referred to
  /// @throws InputError where an option is wrong or the alignment accounts for all that a shape or the noise is
  CohortModel(const Cohort& cohort, OpenNoise noise, const CohortSettings& settings);
  CohortModel(Cohort&& cohort, OpenNoise noise, const CohortSettings& settings) = delete;  // it is referred to

  const std::vector<ModelNumber>& open() const { return open_; }
  Eigen::Index count() const { return std::ssize(open_); }
  int shapes() const { return static_cast<int>(specimens_.size()); }
  const posterior::Specimen& specimen(int shape) const { return specimens_[static_cast<std::size_t>(shape)]; }
  const posterior::Specimen& fullest() const;  ///< the first of those that lack the fewest landmarks
  const Cohort& cohort() const { return cohort_; }
  const CohortSettings& settings() const { return settings_; }
  const OpenNoise& noise() const { return noise_; }
  const Box& box() const { return box_; }
  /// Whether there is no noise where the amplitudes that are fitted are 0.
  bool may_lack_noise() const;

  /// Where momenta and every channel explain equal shares of what varies.
  const Eigen::VectorXd& start() const { return start_; }
  posterior::Numbers numbers(const Eigen::VectorXd& x) const;
  posterior::Specimen::Model model(const Eigen::VectorXd& x) const { return specimens_.front().model(numbers(x)); }
  /// As linear models of those matches know it.
  posterior::Specimen::Model model(const Eigen::VectorXd& x, const Matches& about) const {
    posterior::Specimen::Model model = this->model(x);
    model.size_exponent = about.model.size_exponent;
    return model;
  }
  /// From values of the numbers in the order of open().
  Eigen::VectorXd place(const std::vector<double>& values) const;
  /// Without noise, at the numbers of a fit of `none` to the same shapes.
  Eigen::VectorXd place_without_noise(const std::vector<FittedNumber>& of_none) const;

  /// Rough matches tell numbers apart that are far from each other; thorough ones are also searched for as `register`
  /// does where a search does not converge to the data of a shape.
  enum class Effort { kRough, kExact, kThorough };

  /// Matches at x, from those of another place as the linear model has them there, or from rest.
  /// @throws NumericalError where some shape has no path
  Matches match(const Eigen::VectorXd& x, const Matches* near, Effort effort = Effort::kExact) const;
  /// The same from the matches of another fit. @param near of each shape
  Matches match_from(const Eigen::VectorXd& x, const std::vector<const ShapeFit*>& near, Effort effort) const;

  /// Begins again at the paths of least cost for these numbers, of shapes that may have other matches: those whose
  /// landmarks come close to each other. @return whether that cost less for some shape
  bool improve(Matches& matches) const;

  /// The evidence of the linear models at another place, its gradient, and Fisher's information of x: with C the
  /// covariance of the data and C_i its derivatives, Σ ½ tr C⁻¹C_i C⁻¹C_j over the shapes.
  SecondOrder linear_evidence(const Matches& about, const Eigen::VectorXd& x) const;
  double linear_value(const Matches& about, const Eigen::VectorXd& x) const;
  /// What the shapes' own mean adds to the evidence at x; 0 where the source is given.
  double of_own_mean(const Eigen::VectorXd& x) const;
  /// Fisher's correlation of each number with log σ, all other numbers known.
  Eigen::VectorXd correlations_with_sigma(const Matches& about) const;

 private:
  using Starts = std::function<std::vector<Eigen::VectorXd>(const posterior::Specimen::Model& model, int shape)>;

  Matches match_with(const Starts& starts_of, const Eigen::VectorXd& x, Effort effort) const;
  void find_units();
  void check_observable(const posterior::Specimen::BranchSlopes& slopes) const;
  matching::MatchingProblem problem(const posterior::Numbers& numbers, int shape) const;
  SecondOrder linear_evidence_with(const Matches& about, const Eigen::VectorXd& x, bool with_sigma) const;
  double laplace(const Matches& matches) const;
  double of_own_mean(const Matches& about, const posterior::Specimen::Model& model) const {
    return own_mean_ ? own_mean_->log_factor(*about.at_rest, model) : 0;
  }

  const Cohort& cohort_;
  CohortSettings settings_;
  double sigma_;  ///< of the settings, length units
  KernelOperator kernel_;
  std::shared_ptr<const Integrator> integrator_;
  OpenNoise noise_;
  std::vector<ModelNumber> open_;
  std::vector<posterior::Specimen> specimens_;
  std::shared_ptr<const posterior::SizeExponent> size_exponent_;
  std::shared_ptr<const OwnMean> own_mean_;  // null where the source is given
  Box box_;
  Eigen::VectorXd start_;
};

}  // namespace pulson::compare
