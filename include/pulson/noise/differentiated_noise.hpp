#pragma once

#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "pulson/core/dual.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/dynamics/noise_model.hpp"

namespace pulson {

template <class T>
using MatrixOf = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic>;
template <class T>
using VectorOf = Eigen::Matrix<T, Eigen::Dynamic, 1>;

/// (q, p), or derivatives by them, in a scalar T: double or Dual.
template <class T>
struct StateOf {
  MatrixOf<T> q;
  MatrixOf<T> p;
};

/// What the formula of a noise model may leave out.
struct NoiseFormula {
  /// @throws InputError if it cannot act on `count` landmarks in R^d; `spec` names the model
  void check(int /*dimension*/, int /*count*/, const std::string& /*spec*/) const {}
  /// Adds ∇G; needed where some h_i,q·h_i,p ≠ 0, and G must be affine in p too.
  template <class T>
  void add_compensation_gradient(const StateOf<T>& /*state*/, const VectorOf<T>& /*theta*/,
                                 StateOf<T>& /*gradient*/) const {}
  /// Adds Σ_i w_i ξ_i(x) where the model is made of fields over space.
  template <class T>
  void add_spatial_noise(const MatrixOf<T>& /*x*/, const VectorOf<T>& /*theta*/, const Eigen::VectorXd& /*w*/,
                         MatrixOf<T>& /*field*/) const {}
  template <class T>
  void add_spatial_compensation(const MatrixOf<T>& /*x*/, const VectorOf<T>& /*theta*/, MatrixOf<T>& /*field*/) const {}
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
  NoiseTraits traits() const override { return formula_.traits(); }
  void check(int dimension, int count) const override { formula_.check(dimension, count, spec()); }

  Eigen::VectorXd potentials(const PhaseState& state) const override {
    Eigen::VectorXd h = Eigen::VectorXd::Zero(channels_of(state));
    formula_.add_potentials(StateOf<double>{state.q, state.p}, theta_, h);
    return h;
  }
  PhaseState gradient(const PhaseState& state, const Eigen::VectorXd& w) const override {
    StateOf<double> gradient = zero<double>(state);
    formula_.add_gradient(StateOf<double>{state.q, state.p}, theta_, w, gradient);
    return {std::move(gradient.q), std::move(gradient.p)};
  }
  PhaseState hessian(const PhaseState& state, const Eigen::VectorXd& w, const PhaseState& change) const override {
    StateOf<Dual> gradient = zero<Dual>(state);
    formula_.add_gradient(dual(state, change), rest(theta_), w, gradient);
    return changes(gradient);
  }
  Eigen::VectorXd contract(const PhaseState& state, const PhaseState& with) const override {
    VectorOf<Dual> h = VectorOf<Dual>::Constant(channels_of(state), Dual());
    formula_.add_potentials(dual(state, with), rest(theta_), h);
    return h.unaryExpr([](const Dual& x) { return x.change; });
  }

  PhaseState compensation_gradient(const PhaseState& state) const override {
    StateOf<double> gradient = zero<double>(state);
    formula_.add_compensation_gradient(StateOf<double>{state.q, state.p}, theta_, gradient);
    return {std::move(gradient.q), std::move(gradient.p)};
  }
  PhaseState compensation_hessian(const PhaseState& state, const PhaseState& change) const override {
    StateOf<Dual> gradient = zero<Dual>(state);
    formula_.add_compensation_gradient(dual(state, change), rest(theta_), gradient);
    return changes(gradient);
  }

  Points spatial_noise(const Points& x, const Eigen::VectorXd& w, int /*count*/) const override {
    MatrixOf<double> field = Points::Zero(x.rows(), x.cols());
    formula_.add_spatial_noise(MatrixOf<double>(x), theta_, w, field);
    return field;
  }
  Points spatial_noise_change(const Points& x, const Eigen::VectorXd& w, int /*count*/,
                              const Points& change) const override {
    MatrixOf<Dual> field = MatrixOf<Dual>::Constant(x.rows(), x.cols(), Dual());
    formula_.add_spatial_noise(dual(x, change), rest(theta_), w, field);
    return field.unaryExpr([](const Dual& value) { return value.change; });
  }
  Points spatial_compensation(const Points& x) const override {
    MatrixOf<double> field = Points::Zero(x.rows(), x.cols());
    formula_.add_spatial_compensation(MatrixOf<double>(x), theta_, field);
    return field;
  }
  Points spatial_compensation_change(const Points& x, const Points& change) const override {
    MatrixOf<Dual> field = MatrixOf<Dual>::Constant(x.rows(), x.cols(), Dual());
    formula_.add_spatial_compensation(dual(x, change), rest(theta_), field);
    return field.unaryExpr([](const Dual& value) { return value.change; });
  }

  double friction() const override { return Formula::friction_index() < 0 ? 0 : theta_[Formula::friction_index()]; }

  std::vector<std::string> parameter_names() const override { return formula_.parameter_names(); }
  Eigen::VectorXd parameters() const override { return theta_; }
  std::shared_ptr<const NoiseModel> with_parameters(const Eigen::VectorXd& parameters) const override {
    return std::make_shared<DifferentiatedNoise>(formula_, parameters);
  }
  PhaseState gradient_by_parameters(const PhaseState& state, const Eigen::VectorXd& w,
                                    const Eigen::VectorXd& change) const override {
    StateOf<Dual> gradient = zero<Dual>(state);
    formula_.add_gradient(StateOf<Dual>{rest(state.q), rest(state.p)}, dual(theta_, change), w, gradient);
    return changes(gradient);
  }
  PhaseState compensation_by_parameters(const PhaseState& state, const Eigen::VectorXd& change) const override {
    StateOf<Dual> gradient = zero<Dual>(state);
    formula_.add_compensation_gradient(StateOf<Dual>{rest(state.q), rest(state.p)}, dual(theta_, change), gradient);
    return changes(gradient);
  }
  double friction_by_parameters(const Eigen::VectorXd& change) const override {
    return Formula::friction_index() < 0 ? 0 : change[Formula::friction_index()];
  }

 private:
  int channels_of(const PhaseState& state) const {
    return formula_.channels(static_cast<int>(state.q.rows()), static_cast<int>(state.q.cols()));
  }
  template <class T>
  static StateOf<T> zero(const PhaseState& like) {
    const MatrixOf<T> zeros = MatrixOf<T>::Constant(like.q.rows(), like.q.cols(), T(0));
    return {zeros, zeros};
  }
  template <class Derived>
  static auto rest(const Eigen::MatrixBase<Derived>& x) {
    return x.unaryExpr([](double value) { return Dual(value); }).eval();
  }
  template <class A, class B>
  static auto dual(const Eigen::MatrixBase<A>& value, const Eigen::MatrixBase<B>& change) {
    return value.binaryExpr(change, [](double v, double c) { return Dual(v, c); }).eval();
  }
  static StateOf<Dual> dual(const PhaseState& state, const PhaseState& change) {
    return {dual(state.q, change.q), dual(state.p, change.p)};
  }
  static PhaseState changes(const StateOf<Dual>& x) {
    const auto change = [](const Dual& entry) { return entry.change; };
    return {x.q.unaryExpr(change), x.p.unaryExpr(change)};
  }

  Formula formula_;
  Eigen::VectorXd theta_;
};

/// A model of this formula and these parameters, in the order of its names.
template <class Formula>
std::shared_ptr<const NoiseModel> make_differentiated(Formula formula, std::initializer_list<double> theta) {
  return std::make_shared<DifferentiatedNoise<Formula>>(
      std::move(formula), Eigen::Map<const Eigen::VectorXd>(theta.begin(), static_cast<Eigen::Index>(theta.size())));
}

}  // namespace pulson
