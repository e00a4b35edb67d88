#include <numbers>
#include <type_traits>

#include <fmt/core.h>

#include "gaussian_pairs.hpp"
#include "models.hpp"
#include "pair_noises.hpp"
#include "pulson/kernels/kernel_operator.hpp"
#include "pulson/noise/differentiated_noise.hpp"

namespace pulson {
namespace {

KernelOperator kernel_of(double width) {
  return KernelOperator({{.profile = KernelProfile::kGaussian, .alpha = width, .weight = 1}});
}

// h = β Σ_a p_a^j k(q_a − q_b) for each landmark b and axis j, axis fastest, k(z) = exp(−|z|²/width²): fields about the
// landmarks, that move with them. Without momenta dq_a = β Σ_b k(q_a − q_b) ∘ dW_b.
struct Kunita : NoiseFormula {
  std::vector<std::string> parameter_names() const { return {"beta", "width"}; }
  std::string spec(const Eigen::VectorXd& theta) const {
    return fmt::format("kunita:beta={},width={}", theta[0], theta[1]);
  }
  int channels(int dimension, int count) const { return dimension * count; }
  std::vector<NoiseAmplitude> amplitudes(int channels) const { return {NoiseAmplitude::of_all(0, channels)}; }
  void describe(int dimension, const Eigen::VectorXd& /*theta*/, std::vector<NoiseChannel>& channels) const {
    LandmarkChoice().describe(dimension, channels);
  }
  NoiseTraits traits() const {
    return {.displacement = Displacement::field(),
            .moves_momenta = true,
            .additive = false,
            .compensated = true,
            .local = false,
            .linear = true};
  }

  template <class T>
  void add_potentials(const StateOf<T>& state, const VectorOf<T>& theta, VectorOf<T>& h) const {
    const Eigen::Index d = state.q.rows();
    h += theta[0] * state.p.reshaped();
    for_each_gaussian_pair(state.q, T(theta[1] * theta[1]), [&](Eigen::Index a, Eigen::Index b, const T*, const T& k) {
      const T strength = theta[0] * k;
      for (Eigen::Index j = 0; j < d; ++j) {
        h[a * d + j] += strength * state.p(j, b);
        h[b * d + j] += strength * state.p(j, a);
      }
    });
  }

  // h_w = β Σ_ab p_a·w_b k(q_a − q_b)
  template <class T>
  void add_gradient(const StateOf<T>& state, const VectorOf<T>& theta, const Eigen::VectorXd& w,
                    StateOf<T>& gradient) const {
    const Eigen::Index d = state.q.rows();
    if constexpr (std::is_same_v<T, double>) {
      gradient.p += rest_velocity(state.q, theta, w);
      if ((state.p.array() == 0).all()) return;
      gradient.q += theta[0] * kernel_of(theta[1]).gradient(state.q, state.p, w.reshaped(d, state.q.cols()));
      return;
    }
    with_noise(state, theta, [&](const auto& noise) {
      noise.AddVelocity(w.data(), gradient.p.data());
      if (!(state.p.array() == T(0)).all()) noise.AddForce(state.p.data(), w.data(), gradient.q.data());
    });
  }

  template <class T>
  void add_compensation_gradient(const StateOf<T>& state, const VectorOf<T>& theta, StateOf<T>& gradient) const {
    with_noise(state, theta, [&](const auto& noise) {
      noise.AddCompensationVelocity(gradient.p.data());
      noise.AddCompensationForce(state.p.data(), gradient.q.data());
    });
  }

  // β Σ_b k(x − q_b) w_b: the fields are known everywhere.
  template <class T>
  void add_spatial_noise(const MatrixOf<T>& x, const Points& q, const Eigen::VectorXd& theta, const Eigen::VectorXd& w,
                         MatrixOf<T>& field) const {
    field += T(theta[0]) * sum_over_landmarks(kernel_of(theta[1]), x, q, w.reshaped(q.rows(), q.cols()));
  }

  // ¼β² Σ_b ∇k(z) (k(z) − 1) = β²/(2 width²) Σ_b (k(z) − k(z)²) z, z = x − q_b: G_p of a landmark at x that has no
  // channel, as p_x is in the potentials of the others alone. k² is the kernel of width/√2.
  template <class T>
  void add_spatial_compensation(const MatrixOf<T>& x, const Points& q, const Eigen::VectorXd& theta,
                                MatrixOf<T>& field) const {
    const double factor = 0.5 * theta[0] * theta[0] / (theta[1] * theta[1]);
    field += T(factor) * (moments(theta[1], x, q) - moments(theta[1] / std::numbers::sqrt2, x, q));
  }

  static Points rest_velocity(const Points& q, const Eigen::VectorXd& theta, const Eigen::VectorXd& w) {
    return theta[0] * kernel_of(theta[1]).apply(q, q, w.reshaped(q.rows(), q.cols()));
  }

  static void rest_fields(const Points& q, const Eigen::VectorXd& theta, const Eigen::VectorXd& w, RestFields& rest) {
    rest.fields.noalias() = theta[0] * kernel_of(theta[1]).gram(q, q);
    rest.slope.resize(q.size(), q.size());
    const double factor = 2 / (theta[1] * theta[1]);
    if (q.rows() == 1) set_slope<1>(q, factor, w, rest);
    if (q.rows() == 2) set_slope<2>(q, factor, w, rest);
    if (q.rows() == 3) set_slope<3>(q, factor, w, rest);
  }

 private:
  // task(formula at the positions)
  template <class T, class Task>
  static void with_noise(const StateOf<T>& state, const VectorOf<T>& theta, const Task& task) {
    with_dimension(state.q.rows(), [&](auto dimension) {
      using Noise = HWY_NAMESPACE::KunitaNoise<decltype(dimension)::value, T>;
      const auto n = static_cast<std::size_t>(state.q.cols());
      const T range = theta[1] * theta[1];
      std::vector<T> memory(Noise::MemorySize(n));
      Noise noise(n, pair_noise_constants(theta[0], range), memory.data());
      noise.MoveTo(state.q.data(), GaussianExponentials<T>(state.q, range));
      task(noise);
    });
  }

  // Landmark b moves by β Σ_a k(q_b − q_a) w_a. Its derivative by q_a is w_a gᵀ, g = 2β/width² k (q_b − q_a), and by
  // q_b minus the sum of these.
  template <int d>
  static void set_slope(const Points& q, double factor, const Eigen::VectorXd& w, RestFields& rest) {
    const Eigen::Index n = q.cols();
    Eigen::Matrix<double, d, Eigen::Dynamic> sum(d, n);
    for (int c = 0; c < d; ++c) {
      sum.setZero();
      for (Eigen::Index a = 0; a < n; ++a) {
        const double* const strength = rest.fields.col(a).data();
        double* const by_a = rest.slope.col(a * d + c).data();
        for (Eigen::Index b = 0; b < n; ++b) {
          const double g = factor * strength[b] * (q(c, b) - q(c, a));
          for (int r = 0; r < d; ++r) {
            by_a[b * d + r] = w[a * d + r] * g;
            sum(r, b) += by_a[b * d + r];
          }
        }
      }
      for (Eigen::Index b = 0; b < n; ++b) rest.slope.template block<d, 1>(b * d, b * d + c) -= sum.col(b);
    }
  }

  // Σ_b k(x − q_b) p_b, and its change along that of x.
  static Points sum_over_landmarks(const KernelOperator& k, const Points& x, const Points& q, const Points& p) {
    return k.apply(x, q, p);
  }
  static MatrixOf<Dual> sum_over_landmarks(const KernelOperator& k, const MatrixOf<Dual>& x, const Points& q,
                                           const Points& p) {
    const Eigen::Index d = x.rows();
    const Points places = x.unaryExpr([](const Dual& c) { return c.value; });
    const Points change = x.unaryExpr([](const Dual& c) { return c.change; });
    Eigen::MatrixXd jacobians;
    const Points sum = k.apply_with_jacobian(places, q, p, jacobians);
    MatrixOf<Dual> result(d, x.cols());
    for (Eigen::Index m = 0; m < x.cols(); ++m) {
      const Eigen::VectorXd of_sum = jacobians.col(m).reshaped(d, d) * change.col(m);
      for (Eigen::Index j = 0; j < d; ++j) result(j, m) = {sum(j, m), of_sum[j]};
    }
    return result;
  }

  // Σ_b k(x − q_b) (x − q_b), with coordinates from the landmarks' mean, as larger ones would cancel with a larger
  // error.
  template <class T>
  static MatrixOf<T> moments(double width, const MatrixOf<T>& x, const Points& q) {
    const KernelOperator k = kernel_of(width);
    const Eigen::VectorXd mean = q.rowwise().mean();
    const MatrixOf<T> from_mean = x.colwise() - mean.cast<T>();
    const MatrixOf<T> sum = sum_over_landmarks(k, x, q, Points::Ones(q.rows(), q.cols()));
    return from_mean.cwiseProduct(sum) - sum_over_landmarks(k, x, q, q.colwise() - mean);
  }
};

}  // namespace

std::optional<KunitaPairs> kunita_pairs(const NoiseModel& noise) {
  const auto* model = dynamic_cast<const DifferentiatedNoise<Kunita>*>(&noise);
  if (model == nullptr) return std::nullopt;
  return KunitaPairs{model->parameters()[0], model->parameters()[1]};
}

NoiseTable::Row kunita() {
  return {"kunita",
          {{"beta", "", "amplitude, length per square root of time; 2%: of the diameter", true},
           {"width", "auto", "of fields exp(-|x - q_b|^2/width^2); auto: diameter/4", true}},
          "h = beta p_a^j exp(-|q_a - q_b|^2/width^2): fields about the landmarks, that move with them (Kunita flows)",
          [](const Parameters& parameters, const Landmarks& shape) {
            const double size = shape.count() > 1 ? diameter(shape.points) : 0;
            const double automatic = size > 0 ? size / 4 : 1;  // of one landmark any will do
            const double width = parameters.is_auto("width") ? automatic : parameters.positive("width");
            return make_differentiated(Kunita(), {parameters.positive("beta"), width});
          }};
}

}  // namespace pulson
