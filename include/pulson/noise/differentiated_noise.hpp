#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "pulson/core/errors.hpp"
#include "pulson/dynamics/noise_model.hpp"

namespace pulson {

/// What the formula of a noise model may leave out.
struct NoiseFormula {
  /// @throws InputError if it cannot act on `count` landmarks in R^d; `spec` names the model
  void check(int /*dimension*/, int /*count*/, const std::string& /*spec*/) const {}
  /// Completes descriptions that hold the specification.
  void describe(int /*dimension*/, const Eigen::VectorXd& /*theta*/, std::vector<NoiseChannel>& /*channels*/) const {}
  /// The numbers that scale channels, of `channels` in all; see NoiseModel::amplitudes.
  std::vector<NoiseAmplitude> amplitudes(int /*channels*/) const { return {}; }
  /// Adds ∇G; needed where some h_i,q·h_i,p ≠ 0, and G must be affine in p too.
  template <class T>
  void add_compensation_gradient(const StateOf<T>& /*state*/, const VectorOf<T>& /*theta*/,
                                 StateOf<T>& /*gradient*/) const {}
  /// Adds Σ_i w_i ξ_i(x) where the traits declare a field over space, which may depend on the landmarks' places q.
  template <class T>
  void add_spatial_noise(const MatrixOf<T>& /*x*/, const Points& /*q*/, const Eigen::VectorXd& /*theta*/,
                         const Eigen::VectorXd& /*w*/, MatrixOf<T>& /*field*/) const {}
  /// Adds what G_p would be of a landmark at x without momentum and without channels of its own.
  template <class T>
  void add_spatial_compensation(const MatrixOf<T>& /*x*/, const Points& /*q*/, const Eigen::VectorXd& /*theta*/,
                                MatrixOf<T>& /*field*/) const {}
  /// The index in θ of the friction λ, or −1 where there is none.
  static int friction_index() { return -1; }
};

/// A noise model made of its formula: the author writes potentials and their gradient for any scalar, and exact second
/// derivatives, transposes and derivatives by the parameters follow from Duals. A Formula derives from NoiseFormula and
/// has
///
///     std::vector<std::string> parameter_names() const;                  names of θ
///     std::string spec(const Eigen::VectorXd& theta) const;
///     int channels(int dimension, int count) const;
///     NoiseTraits traits() const;
///     template <class T> void add_potentials(const StateOf<T>&, const VectorOf<T>& theta, VectorOf<T>& h) const;
///     template <class T> void add_gradient(const StateOf<T>&, const VectorOf<T>& theta, const Eigen::VectorXd& w,
///                                          StateOf<T>& gradient) const;
///
/// which add h_i to C zeros, and ∇h_w to zeros. See docs/adding_a_noise_model.md.
template <class Formula>
class DifferentiatedNoise final : public NoiseModel {
 public:
  DifferentiatedNoise(Formula formula, Eigen::VectorXd theta) : formula_(std::move(formula)), theta_(std::move(theta)) {
    const std::vector<std::string> names = parameter_names();
    if (theta_.size() != static_cast<Eigen::Index>(names.size()))
      throw std::logic_error("a noise model has one value for each of its parameter names");
    for (Eigen::Index i = 0; i < theta_.size(); ++i) {
      const bool may_vanish = i == Formula::friction_index();
      if (!(std::isfinite(theta_[i]) && (theta_[i] > 0 || (may_vanish && theta_[i] == 0))))
        throw InputError("noise '" + spec() + "': " + names[static_cast<std::size_t>(i)] + " must be a finite number " +
                         (may_vanish ? "that is not negative" : "greater than 0"));
    }
  }

  std::string spec() const override { return formula_.spec(theta_); }
  int channels(int dimension, int count) const override { return formula_.channels(dimension, count); }
  std::vector<NoiseChannel> describe_channels(int dimension, int count) const override {
    std::vector<NoiseChannel> all = NoiseModel::describe_channels(dimension, count);
    formula_.describe(dimension, theta_, all);
    return all;
  }
  NoiseTraits traits() const override { return formula_.traits(); }
  void check(int dimension, int count) const override { formula_.check(dimension, count, spec()); }

  std::vector<std::string> parameter_names() const override { return formula_.parameter_names(); }
  Eigen::VectorXd parameters() const override { return theta_; }
  std::vector<NoiseAmplitude> amplitudes(int dimension, int count) const override {
    return formula_.amplitudes(channels(dimension, count));
  }
  std::shared_ptr<const NoiseModel> with_parameters(const Eigen::VectorXd& parameters) const override {
    return std::make_shared<DifferentiatedNoise>(formula_, parameters);
  }

  /// By the formula where it has `rest_velocity` and `rest_fields`.
  Points rest_velocity(const Points& q, const Eigen::VectorXd& w) const override {
    if constexpr (requires { formula_.rest_velocity(q, theta_, w); })
      return formula_.rest_velocity(q, theta_, w);
    else
      return NoiseModel::rest_velocity(q, w);
  }
  void rest_fields(const Points& q, const Eigen::VectorXd& w, RestFields& fields) const override {
    if constexpr (requires { formula_.rest_fields(q, theta_, w, fields); })
      formula_.rest_fields(q, theta_, w, fields);
    else
      NoiseModel::rest_fields(q, w, fields);
  }

  const Formula& formula() const { return formula_; }

  void add_to(const NoiseSums<double>& sums) const override { add(sums); }
  void add_to(const NoiseSums<Dual>& sums) const override { add(sums); }
  void add_to(const SpaceSums<double>& sums) const override { add(sums); }
  void add_to(const SpaceSums<Dual>& sums) const override { add(sums); }

 private:
  template <class T>
  void add(const NoiseSums<T>& to) const {
    if (to.potentials) formula_.add_potentials(to.at, to.theta, *to.potentials);
    if (to.gradient) formula_.add_gradient(to.at, to.theta, to.w, *to.gradient);
    if (to.compensation) formula_.add_compensation_gradient(to.at, to.theta, *to.compensation);
    if (to.friction && Formula::friction_index() >= 0) *to.friction += to.theta[Formula::friction_index()];
  }
  template <class T>
  void add(const SpaceSums<T>& to) const {
    if (to.noise) formula_.add_spatial_noise(to.x, to.at.q, theta_, to.w, *to.noise);
    if (to.compensation) formula_.add_spatial_compensation(to.x, to.at.q, theta_, *to.compensation);
  }

  Formula formula_;
  Eigen::VectorXd theta_;
};

/// A model of this formula and these parameters, in the order of its names.
template <class Formula>
std::shared_ptr<const NoiseModel> make_differentiated(Formula formula, std::initializer_list<double> theta) {
  Eigen::VectorXd parameters(static_cast<Eigen::Index>(theta.size()));
  std::copy(theta.begin(), theta.end(), parameters.begin());
  return std::make_shared<DifferentiatedNoise<Formula>>(std::move(formula), std::move(parameters));
}

}  // namespace pulson
