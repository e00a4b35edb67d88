#pragma once

#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "pulson/core/landmarks.hpp"

namespace pulson {

/// value + change·ε with ε² = 0: a function written for any scalar, called with Duals, gives its exact derivative along
/// the direction in the arguments' changes.
struct Dual {
  double value = 0;
  double change = 0;

  constexpr Dual() = default;
  constexpr Dual(double v) : value(v) {}  // NOLINT(google-explicit-constructor): numbers are Duals at rest
  constexpr Dual(double v, double c) : value(v), change(c) {}

  constexpr Dual& operator+=(const Dual& b) { return *this = {value + b.value, change + b.change}; }
  constexpr Dual& operator-=(const Dual& b) { return *this = {value - b.value, change - b.change}; }
  constexpr Dual& operator*=(const Dual& b) { return *this = {value * b.value, change * b.value + value * b.change}; }
  constexpr Dual& operator/=(const Dual& b) {
    const double quotient = value / b.value;
    return *this = {quotient, (change - quotient * b.change) / b.value};
  }
};

constexpr Dual operator-(const Dual& a) { return {-a.value, -a.change}; }
constexpr Dual operator+(Dual a, const Dual& b) { return a += b; }
constexpr Dual operator-(Dual a, const Dual& b) { return a -= b; }
constexpr Dual operator*(Dual a, const Dual& b) { return a *= b; }
constexpr Dual operator/(Dual a, const Dual& b) { return a /= b; }

constexpr bool operator==(const Dual& a, const Dual& b) { return a.value == b.value && a.change == b.change; }

inline Dual exp(const Dual& a) { return {std::exp(a.value), std::exp(a.value) * a.change}; }
inline Dual sin(const Dual& a) { return {std::sin(a.value), std::cos(a.value) * a.change}; }
inline Dual cos(const Dual& a) { return {std::cos(a.value), -std::sin(a.value) * a.change}; }

}  // namespace pulson

/// @cond
/// So that Eigen's matrices may hold Duals.
template <>
struct Eigen::NumTraits<pulson::Dual> : Eigen::NumTraits<double> {
  using Real = pulson::Dual;
  using NonInteger = pulson::Dual;
  using Nested = pulson::Dual;
  // Eigen's names. NOLINTBEGIN(readability-identifier-naming)
  enum {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    RequireInitialization = 1,
    ReadCost = 2,
    AddCost = 2,
    MulCost = 4
  };
  // NOLINTEND(readability-identifier-naming)
};
/// @endcond

namespace pulson {

/// What the displacement h_w,p of a noise is: nothing, a field over space, which then carries every point, or one that
/// landmarks alone have, which is interpolated between them. It has no default: each model declares it.
class Displacement {
 public:
  static constexpr Displacement none() { return {false, false}; }
  /// The model gives the field: see NoiseModel::spatial_noise.
  static constexpr Displacement field() { return {true, false}; }
  static constexpr Displacement landmarks() { return {false, true}; }

  constexpr bool has_field() const { return has_field_; }
  constexpr bool has_landmarks() const { return has_landmarks_; }
  /// Of a sum of models.
  constexpr Displacement operator+(const Displacement& other) const {
    return {has_field_ || other.has_field_, has_landmarks_ || other.has_landmarks_};
  }

 private:
  constexpr Displacement(bool has_field, bool has_landmarks) : has_field_(has_field), has_landmarks_(has_landmarks) {}

  bool has_field_;
  bool has_landmarks_;
};

/// What a noise model is, as integrators, documentation and tests need to know it.
struct NoiseTraits {
  Displacement displacement;          ///< of positions by h_w,p
  bool moves_momenta = false;         ///< some h_i,q ≠ 0
  bool additive = true;               ///< h_i,p and h_i,q are constant
  bool compensated = false;           ///< some channel has h_i,q·h_i,p ≠ 0, so that G ≠ 0
  bool hamiltonian = true;            ///< there is no friction
  bool translation_invariant = true;  ///< h_i(q + c, p) = h_i(q, p), so that total momentum is kept
  bool diffeomorphic = true;          ///< landmarks cannot pass each other in the limit Δt → 0
  bool local = true;    ///< each potential is a sum over landmarks, so that ∇²h_w has d×d blocks alone
  bool linear = false;  ///< every h_i is linear in p: h_i(q, 0) = 0
  bool affine = true;   ///< G is affine in p

  /// Whether some h_i,p ≠ 0.
  constexpr bool moves_positions() const { return displacement.has_field() || displacement.has_landmarks(); }
};

/// What tells a channel of noise apart from the others of its model: with the numbers of `noise`, enough to write its
/// potential down. What does not apply is empty.
struct NoiseChannel {
  std::string noise;             ///< specification of the model; in a sum, of the term
  std::vector<int> landmarks{};  ///< from 0: the landmark or pair that it is about; empty for all alike
  std::optional<int> axis{};     ///< from 0
  Eigen::VectorXd center{};      ///< d, of its field over space
  Eigen::VectorXd wavevector{};  ///< d, of its field over space
};

/// A number of a noise model that scales channels: where it is multiplied by c, h_i becomes c^power h_i for each of
/// these channels, and no other h_i changes.
struct NoiseAmplitude {
  int parameter = 0;          ///< index in θ
  std::vector<int> channels;  ///< from 0, ascending
  double power = 1;

  /// Of a model with C channels that are all proportional to θ[parameter].
  static NoiseAmplitude of_all(int parameter, int channels);
};

template <class T>
using MatrixOf = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic>;
template <class T>
using VectorOf = Eigen::Matrix<T, Eigen::Dynamic, 1>;

/// (q, p), or derivatives by them, in a scalar T: double or Dual.
template <class T>
struct StateOf {
  MatrixOf<T> q;
  MatrixOf<T> p;

  StateOf& operator+=(const StateOf& other) {
    q += other.q;
    p += other.p;
    return *this;
  }
};

/// What a noise model is asked for, in a scalar T: numbers, or Duals, whose changes are derivatives along a direction.
/// It adds to each sum that there is.
template <class T>
struct NoiseSums {
  const StateOf<T>& at;      ///< d×N
  const VectorOf<T>& theta;  ///< θ
  Eigen::VectorXd w = {};    ///< C increments, for those sums that have h_w
  int count = 0;             ///< N

  VectorOf<T>* potentials = nullptr;   ///< h_i, C numbers
  StateOf<T>* gradient = nullptr;      ///< ∇h_w
  StateOf<T>* compensation = nullptr;  ///< ∇G
  T* friction = nullptr;               ///< λ
};

/// What a noise model is asked for at places x of space, in a scalar T: numbers, or Duals, whose changes are
/// derivatives along a change of the places. It adds to each sum that there is.
template <class T>
struct SpaceSums {
  const MatrixOf<T>& x;    ///< d×M
  const PhaseState& at;    ///< of the landmarks
  Eigen::VectorXd w = {};  ///< C increments, for the field of noise

  MatrixOf<T>* noise = nullptr;         ///< the share of h_w,p that is a field over space, d×M
  MatrixOf<T>* compensation = nullptr;  ///< the same share of G_p
};

/// What moves positions at rest, of a model that is linear in p: there h_i,q = 0, so that p stays 0 and
/// dq = Σ h_i,p(q) ∘ dW_i. Index a·d + axis.
struct RestFields {
  Eigen::MatrixXd fields;  ///< h_i,p, dN×C; or N×N, where channels move an axis each, all axes alike
  Eigen::MatrixXd slope;   ///< ∂h_w,p/∂q, dN×dN

  /// h_w,p, d×N.
  Points velocity(Eigen::Index d, const Eigen::VectorXd& w) const;
  /// by_w += rows·h_p. @param rows R×dN @param by_w R×C
  void add_rows(const Eigen::MatrixXd& rows, Eigen::Ref<Eigen::MatrixXd> by_w) const;
};

/// A noise model of the stochastic Hamiltonian system (11): channels i = 1..C, each a potential h_i(q,p), affine in p,
/// that drives
///
///     dq = H_p dt + Σ h_i,p ∘ dW_i,   dp = −H_q dt − Σ h_i,q ∘ dW_i − λ H_p dt
///
/// with friction λ = 0 for all but Langevin's. Integrators use a model through increments w (C numbers) and the
/// potential h_w = Σ_i w_i h_i; G = ¼ Σ_i h_i,q·h_i,p is what the compensated integrator adds to H. Pairs (q part, p
/// part) of derivatives are PhaseStates, d×N each. All methods are const and thread-safe.
///
/// A model says what it is, and adds potentials and gradients to sums; all derivatives follow from these. Most are made
/// of a formula, see DifferentiatedNoise.
class NoiseModel {
 public:
  virtual ~NoiseModel() = default;

  /// The specification that makes this model again for the same shape: `ch-sd:beta=1`.
  virtual std::string spec() const = 0;

  /// C, for shapes of `count` landmarks in R^d.
  virtual int channels(int dimension, int count) const = 0;

  /// The channels in their order: here the specification alone.
  virtual std::vector<NoiseChannel> describe_channels(int dimension, int count) const;

  virtual NoiseTraits traits() const = 0;

  /// @throws InputError if the model cannot act on N landmarks in R^d, as where `on=9` meets eight landmarks.
  virtual void check(int dimension, int count) const = 0;

  /// Names of the parameters θ that may be fitted: `beta`, `gamma`, `width`, …
  virtual std::vector<std::string> parameter_names() const = 0;

  /// θ
  virtual Eigen::VectorXd parameters() const = 0;

  /// Which channels each number of θ scales, of shapes of `count` landmarks in R^d; no channel is in two of them. Here
  /// none is declared.
  virtual std::vector<NoiseAmplitude> amplitudes(int dimension, int count) const;

  /// The same model with other parameters. @throws InputError if one is out of its range
  virtual std::shared_ptr<const NoiseModel> with_parameters(const Eigen::VectorXd& parameters) const = 0;

  /// Adds to the sums that there are, at any θ.
  virtual void add_to(const NoiseSums<double>& sums) const = 0;
  virtual void add_to(const NoiseSums<Dual>& sums) const = 0;
  /// The fields over space of a model that declares some; none else.
  virtual void add_to(const SpaceSums<double>& sums) const = 0;
  virtual void add_to(const SpaceSums<Dual>& sums) const = 0;

  /// h_i, C numbers.
  Eigen::VectorXd potentials(const PhaseState& state) const;

  /// ∇h_w = (h_w,q, h_w,p).
  PhaseState gradient(const PhaseState& state, const Eigen::VectorXd& w) const;

  /// ∇²h_w along a change of the state.
  PhaseState hessian(const PhaseState& state, const Eigen::VectorXd& w, const PhaseState& change) const;

  /// h_w,p at rest.
  virtual Points rest_velocity(const Points& q, const Eigen::VectorXd& w) const;

  /// The fields at rest, here a gradient for each channel and a second derivative for each coordinate.
  virtual void rest_fields(const Points& q, const Eigen::VectorXd& w, RestFields& fields) const;

  /// ∇h_i·with, C numbers: the transpose of `gradient` in w.
  Eigen::VectorXd contract(const PhaseState& state, const PhaseState& with) const;

  /// ∇G.
  PhaseState compensation_gradient(const PhaseState& state) const;

  /// ∇²G along a change of the state.
  PhaseState compensation_hessian(const PhaseState& state, const PhaseState& change) const;

  /// The share of h_w,p that is a field over space while the landmarks are at a state, Σ_i w_i ξ_i(x), d×M; zero for
  /// models that declare none.
  Points spatial_noise(const Points& x, const PhaseState& at, const Eigen::VectorXd& w) const;

  /// The change of that field along a change of the places, d×M.
  Points spatial_noise_change(const Points& x, const PhaseState& at, const Eigen::VectorXd& w,
                              const Points& change) const;

  /// The same share of G_p, d×M: at x what G_p would be of one more landmark there that has no momentum and no channels
  /// of its own.
  Points spatial_compensation(const Points& x, const PhaseState& at) const;
  Points spatial_compensation_change(const Points& x, const PhaseState& at, const Points& change) const;

  /// λ of the friction −λ H_p in dp.
  double friction() const;

  /// ∂(∇h_w)/∂θ along a change of θ.
  PhaseState gradient_by_parameters(const PhaseState& state, const Eigen::VectorXd& w,
                                    const Eigen::VectorXd& change) const;

  /// ∂(∇G)/∂θ along a change of θ.
  PhaseState compensation_by_parameters(const PhaseState& state, const Eigen::VectorXd& change) const;

  /// ∂λ/∂θ of the friction along a change of θ.
  double friction_by_parameters(const Eigen::VectorXd& change) const;
};

}  // namespace pulson
