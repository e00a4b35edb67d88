#include "pulson/dynamics/noise_model.hpp"

#include <numeric>

namespace pulson {
namespace {

using Eigen::VectorXd;

template <class T, class Derived>
MatrixOf<T> zeros_like(const Eigen::MatrixBase<Derived>& x) {
  return MatrixOf<T>::Constant(x.rows(), x.cols(), T(0));
}

// At rest, or with a change.
VectorOf<Dual> dual(const VectorXd& x) { return x.cast<Dual>(); }
MatrixOf<Dual> dual(const Points& x) { return x.cast<Dual>(); }
MatrixOf<Dual> dual(const Points& x, const Points& change) {
  return x.binaryExpr(change, [](double value, double by) { return Dual(value, by); });
}
StateOf<Dual> dual(const PhaseState& x) { return {dual(x.q), dual(x.p)}; }
StateOf<Dual> dual(const PhaseState& x, const PhaseState& change) { return {dual(x.q, change.q), dual(x.p, change.p)}; }

PhaseState result(StateOf<double>&& x) { return {std::move(x.q), std::move(x.p)}; }
Points result(Points&& x) { return std::move(x); }
Points result(const MatrixOf<Dual>& x) {
  return x.unaryExpr([](const Dual& entry) { return entry.change; });
}
PhaseState result(const StateOf<Dual>& x) { return {result(x.q), result(x.p)}; }

// The sum that `member` points to, of a model with these arguments, from zero.
template <class T>
auto sum_of(const NoiseModel& noise, NoiseSums<T> sums, StateOf<T>* NoiseSums<T>::*member) {
  StateOf<T> sum{zeros_like<T>(sums.at.q), zeros_like<T>(sums.at.q)};
  sums.*member = &sum;
  noise.add_to(sums);
  return result(std::move(sum));
}
template <class T>
auto sum_of(const NoiseModel& noise, SpaceSums<T> sums, MatrixOf<T>* SpaceSums<T>::*member) {
  MatrixOf<T> sum = zeros_like<T>(sums.x);
  sums.*member = &sum;
  noise.add_to(sums);
  return result(std::move(sum));
}
template <class T>
VectorOf<T> potentials_of(const NoiseModel& noise, NoiseSums<T> sums) {
  VectorOf<T> sum = VectorOf<T>::Constant(noise.channels(static_cast<int>(sums.at.q.rows()), sums.count), T(0));
  sums.potentials = &sum;
  noise.add_to(sums);
  return sum;
}
template <class T>
T friction_of(const NoiseModel& noise, const VectorOf<T>& theta) {
  T sum(0);
  noise.add_to(NoiseSums<T>{.at = {}, .theta = theta, .friction = &sum});
  return sum;
}

int count_of(const PhaseState& state) { return static_cast<int>(state.q.cols()); }

}  // namespace

std::vector<NoiseChannel> NoiseModel::describe_channels(int dimension, int count) const {
  return {static_cast<std::size_t>(channels(dimension, count)), NoiseChannel{.noise = spec()}};
}

NoiseAmplitude NoiseAmplitude::of_all(int parameter, int channels) {
  NoiseAmplitude amplitude{.parameter = parameter, .channels = std::vector<int>(static_cast<std::size_t>(channels))};
  std::iota(amplitude.channels.begin(), amplitude.channels.end(), 0);
  return amplitude;
}

std::vector<NoiseAmplitude> NoiseModel::amplitudes(int /*dimension*/, int /*count*/) const { return {}; }

VectorXd NoiseModel::potentials(const PhaseState& state) const {
  return potentials_of<double>(*this, {.at = {state.q, state.p}, .theta = parameters(), .count = count_of(state)});
}

VectorXd NoiseModel::contract(const PhaseState& state, const PhaseState& with) const {
  return potentials_of<Dual>(*this, {.at = dual(state, with), .theta = dual(parameters()), .count = count_of(state)})
      .unaryExpr([](const Dual& x) { return x.change; });
}

PhaseState NoiseModel::gradient(const PhaseState& state, const VectorXd& w) const {
  return sum_of<double>(*this, {.at = {state.q, state.p}, .theta = parameters(), .w = w, .count = count_of(state)},
                        &NoiseSums<double>::gradient);
}

PhaseState NoiseModel::hessian(const PhaseState& state, const VectorXd& w, const PhaseState& change) const {
  return sum_of<Dual>(*this, {.at = dual(state, change), .theta = dual(parameters()), .w = w, .count = count_of(state)},
                      &NoiseSums<Dual>::gradient);
}

// With index a·d + axis a matrix of all coordinates is one of N columns, in which axes are parts of a column.
Points RestFields::velocity(Eigen::Index d, const VectorXd& w) const {
  if (w.size() == 0) return Points::Zero(d, fields.rows() / d);
  const Eigen::Index alike = w.size() / fields.cols();
  const Eigen::MatrixXd moved = w.reshaped(alike, fields.cols()) * fields.transpose();
  return moved.reshaped(d, moved.size() / d);
}

void RestFields::add_rows(const Eigen::MatrixXd& rows, Eigen::Ref<Eigen::MatrixXd> by_w) const {
  if (by_w.cols() == 0) return;
  const Eigen::Index height = rows.size() / fields.rows();
  Eigen::Map<Eigen::MatrixXd>(by_w.data(), height, fields.cols()).noalias() +=
      Eigen::Map<const Eigen::MatrixXd>(rows.data(), height, fields.rows()) * fields;
}

Points NoiseModel::rest_velocity(const Points& q, const VectorXd& w) const {
  return gradient({q, Points::Zero(q.rows(), q.cols())}, w).p;
}

void NoiseModel::rest_fields(const Points& q, const VectorXd& w, RestFields& fields) const {
  const Points zero = Points::Zero(q.rows(), q.cols());
  const PhaseState state{q, zero};
  const Eigen::Index size = q.size(), channels = w.size();
  fields.fields.resize(size, channels);
  for (Eigen::Index i = 0; i < channels; ++i)
    fields.fields.col(i) = gradient(state, VectorXd::Unit(channels, i)).p.reshaped();
  fields.slope.setZero(size, size);
  if (traits().additive) return;
  PhaseState unit{zero, zero};
  for (Eigen::Index i = 0; i < size; ++i) {
    unit.q.reshaped()[i] = 1;
    fields.slope.col(i) = hessian(state, w, unit).p.reshaped();
    unit.q.reshaped()[i] = 0;
  }
}

PhaseState NoiseModel::gradient_by_parameters(const PhaseState& state, const VectorXd& w,
                                              const VectorXd& change) const {
  return sum_of<Dual>(*this, {.at = dual(state), .theta = dual(parameters(), change), .w = w, .count = count_of(state)},
                      &NoiseSums<Dual>::gradient);
}

PhaseState NoiseModel::compensation_gradient(const PhaseState& state) const {
  return sum_of<double>(*this, {.at = {state.q, state.p}, .theta = parameters(), .count = count_of(state)},
                        &NoiseSums<double>::compensation);
}

PhaseState NoiseModel::compensation_hessian(const PhaseState& state, const PhaseState& change) const {
  return sum_of<Dual>(*this, {.at = dual(state, change), .theta = dual(parameters()), .count = count_of(state)},
                      &NoiseSums<Dual>::compensation);
}

PhaseState NoiseModel::compensation_by_parameters(const PhaseState& state, const VectorXd& change) const {
  return sum_of<Dual>(*this, {.at = dual(state), .theta = dual(parameters(), change), .count = count_of(state)},
                      &NoiseSums<Dual>::compensation);
}

Points NoiseModel::spatial_noise(const Points& x, const PhaseState& at, const VectorXd& w) const {
  return sum_of<double>(*this, {.x = x, .at = at, .w = w}, &SpaceSums<double>::noise);
}

Points NoiseModel::spatial_noise_change(const Points& x, const PhaseState& at, const VectorXd& w,
                                        const Points& change) const {
  return sum_of<Dual>(*this, {.x = dual(x, change), .at = at, .w = w}, &SpaceSums<Dual>::noise);
}

Points NoiseModel::spatial_compensation(const Points& x, const PhaseState& at) const {
  return sum_of<double>(*this, {.x = x, .at = at}, &SpaceSums<double>::compensation);
}

Points NoiseModel::spatial_compensation_change(const Points& x, const PhaseState& at, const Points& change) const {
  return sum_of<Dual>(*this, {.x = dual(x, change), .at = at}, &SpaceSums<Dual>::compensation);
}

double NoiseModel::friction() const { return friction_of<double>(*this, parameters()); }

double NoiseModel::friction_by_parameters(const VectorXd& change) const {
  return friction_of<Dual>(*this, dual(parameters(), change)).change;
}

}  // namespace pulson
