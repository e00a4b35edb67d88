#include <fmt/core.h>

#include "gaussian_pairs.hpp"
#include "models.hpp"
#include "pair_noises.hpp"
#include "pulson/noise/differentiated_noise.hpp"

namespace pulson {
namespace {

// h = β p_a^j s_a(q), s_a = Σ_b exp(−|q_a − q_b|²/γ) over the b that screen a, for each chosen landmark a and axis j,
// axis fastest: §5.3 of the paper, where landmark 2 moves and 1 screens. The b are the landmarks of other groups where
// the shape has several, else all but a.
struct ChSdScreened : NoiseFormula {
  LandmarkChoice on;
  std::vector<std::size_t> group;  // of each landmark; empty where there is one group

  std::vector<std::string> parameter_names() const { return {"beta", "gamma"}; }
  std::string spec(const Eigen::VectorXd& theta) const {
    return fmt::format("ch-sd-screened:beta={},gamma={}{}", theta[0], theta[1], on.spec());
  }
  int channels(int dimension, int count) const { return dimension * on.count(count); }
  std::vector<NoiseAmplitude> amplitudes(int channels) const { return {NoiseAmplitude::of_all(0, channels)}; }
  void describe(int dimension, const Eigen::VectorXd& /*theta*/, std::vector<NoiseChannel>& channels) const {
    on.describe(dimension, channels);
  }
  NoiseTraits traits() const {
    return {.displacement = Displacement::landmarks(),
            .moves_momenta = true,
            .additive = false,
            .compensated = true,
            .diffeomorphic = false,
            .local = false,
            .linear = true};
  }
  void check(int /*dimension*/, int count, const std::string& spec) const {
    on.check(count, spec);
    if (!group.empty() && static_cast<int>(group.size()) != count)
      throw InputError(
          fmt::format("noise '{}': it was made for {} landmarks, the shape has {}", spec, group.size(), count));
  }

  template <class T>
  void add_potentials(const StateOf<T>& state, const VectorOf<T>& theta, VectorOf<T>& h) const {
    const Eigen::Index d = state.q.rows();
    VectorOf<T> screens = VectorOf<T>::Constant(state.q.cols(), T(0));
    for_each_gaussian_pair(state.q, theta[1], [&](Eigen::Index a, Eigen::Index b, const T*, const T& e) {
      if (!screen_each_other(static_cast<std::size_t>(a), static_cast<std::size_t>(b))) return;
      screens[a] += e;
      screens[b] += e;
    });
    for (int i = 0; i < on.count(static_cast<int>(state.q.cols())); ++i)
      for (Eigen::Index axis = 0; axis < d; ++axis) h[i * d + axis] += theta[0] * screens[on[i]] * state.p(axis, on[i]);
  }

  template <class T>
  void add_gradient(const StateOf<T>& state, const VectorOf<T>& theta, const Eigen::VectorXd& w,
                    StateOf<T>& gradient) const {
    with_noise(state, theta, [&](const auto& noise, std::size_t chosen, const auto& choice) {
      noise.AddVelocity(chosen, choice, w.data(), gradient.p.data());
      noise.AddForce(chosen, choice, state.p.data(), w.data(), gradient.q.data());
    });
  }

  template <class T>
  void add_compensation_gradient(const StateOf<T>& state, const VectorOf<T>& theta, StateOf<T>& gradient) const {
    with_noise(state, theta, [&](const auto& noise, std::size_t chosen, const auto& choice) {
      noise.AddCompensationVelocity(chosen, choice, gradient.p.data());
      noise.AddCompensationForce(chosen, choice, state.p.data(), gradient.q.data());
    });
  }

  bool screen_each_other(std::size_t a, std::size_t b) const { return group.empty() || group[a] != group[b]; }

 private:
  // task(formula at the positions, number of the chosen landmarks, i ↦ the i-th of them)
  template <class T, class Task>
  void with_noise(const StateOf<T>& state, const VectorOf<T>& theta, const Task& task) const {
    with_dimension(state.q.rows(), [&](auto dimension) {
      using Noise = HWY_NAMESPACE::ScreenedNoise<decltype(dimension)::value, T>;
      const auto n = static_cast<std::size_t>(state.q.cols());
      std::vector<T> memory(Noise::MemorySize(n));
      Noise noise(n, pair_noise_constants(theta[0], theta[1]), memory.data());
      noise.MoveTo(
          state.q.data(), [&](std::size_t a, std::size_t b) { return screen_each_other(a, b); },
          GaussianExponentials<T>(state.q, theta[1]));
      task(noise, static_cast<std::size_t>(on.count(static_cast<int>(n))),
           [&](std::size_t i) { return static_cast<std::size_t>(on[static_cast<int>(i)]); });
    });
  }
};

// The number of each landmark's group; empty where all belong to one.
std::vector<std::size_t> group_numbers(const Landmarks& shape) {
  const std::vector<std::vector<int>> groups = landmarks_by_group(shape);
  if (groups.size() < 2) return {};
  std::vector<std::size_t> numbers(static_cast<std::size_t>(shape.count()));
  for (std::size_t g = 0; g < groups.size(); ++g)
    for (const int a : groups[g]) numbers[static_cast<std::size_t>(a)] = g;
  return numbers;
}

}  // namespace

std::optional<ScreenedPairs> screened_pairs(const NoiseModel& noise) {
  const auto* model = dynamic_cast<const DifferentiatedNoise<ChSdScreened>*>(&noise);
  if (model == nullptr) return std::nullopt;
  const Eigen::VectorXd theta = model->parameters();
  return ScreenedPairs{theta[0], theta[1], model->formula().on, model->formula().group};
}

NoiseTable::Row ch_sd_screened() {
  return {"ch-sd-screened",
          {{"beta", "", "amplitude, length per square root of time; 50%: of the diameter", true},
           {"gamma", "", "range: exp(-r^2/gamma), length squared"},
           LandmarkChoice::info()},
          "h = beta p_a sum_b exp(-|q_a - q_b|^2/gamma): noise in the positions near another outline (if there is only "
          "one, near another landmark); landmarks may pass through each other (section 5.3)",
          [](const Parameters& parameters, const Landmarks& shape) {
            ChSdScreened formula;
            formula.on = LandmarkChoice(parameters);
            formula.group = group_numbers(shape);
            return make_differentiated(std::move(formula), {parameters.positive("beta"), parameters.positive("gamma")});
          }};
}

}  // namespace pulson
