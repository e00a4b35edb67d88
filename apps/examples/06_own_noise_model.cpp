// A noise model of one's own: it moves each group of landmarks as a whole, so that two discs pass through each other
// rigidly. Its formula is written once, for any number type, and its exact derivatives follow; options take the model.
// docs/adding_a_noise_model.md lists what else a model may define, and how it gets a name.
//
//   $ 06_own_noise_model
//   matched, energy 0.02558, action 0.948 of 4 channels

#include <iostream>

#include <fmt/core.h>
#include <pulson/pulson.hpp>

namespace {

using Eigen::Index;
using pulson::StateOf;
using pulson::VectorOf;

// h = beta sum_a p_a^j over the landmarks a of a group, one channel for each group and axis j, axis fastest.
struct GroupShift : pulson::NoiseFormula {
  std::vector<std::vector<int>> groups;

  std::vector<std::string> parameter_names() const { return {"beta"}; }
  std::string spec(const Eigen::VectorXd& theta) const { return fmt::format("group-shift:beta={}", theta[0]); }
  int channels(int dimension, int /*count*/) const { return dimension * static_cast<int>(groups.size()); }
  std::vector<pulson::NoiseAmplitude> amplitudes(int channels) const {
    return {pulson::NoiseAmplitude::of_all(0, channels)};  // the first parameter scales them all
  }
  pulson::NoiseTraits traits() const {
    return {.displacement = pulson::Displacement::landmarks(), .diffeomorphic = false};
  }

  template <class T>
  void add_potentials(const StateOf<T>& state, const VectorOf<T>& theta, VectorOf<T>& h) const {
    const Index d = state.p.rows();
    for (Index i = 0; i < h.size(); ++i)
      for (const int a : groups[i / d]) h[i] += theta[0] * state.p(i % d, a);
  }

  // Of sum_i w_i h_i, by q, where there is none here, and by p.
  template <class T>
  void add_gradient(const StateOf<T>& state, const VectorOf<T>& theta, const Eigen::VectorXd& w,
                    StateOf<T>& gradient) const {
    const Index d = state.p.rows();
    for (Index i = 0; i < w.size(); ++i)
      for (const int a : groups[i / d]) gradient.p(i % d, a) += theta[0] * T(w[i]);
  }
};

}  // namespace

int main(int argc, char** argv) {
  const pulson::Landmarks source =
      pulson::formats::read_landmarks(argc > 2 ? argv[1] : "sample_shapes/discs_source.csv");
  const pulson::Landmarks target =
      pulson::formats::read_landmarks(argc > 2 ? argv[2] : "sample_shapes/discs_target.csv");
  GroupShift group_shift;
  group_shift.groups = pulson::landmarks_by_group(source);

  pulson::matching::RegistrationOptions options;
  options.kernel = "gaussian:alpha=0.4";
  options.noise = pulson::make_differentiated(group_shift, {2});  // beta
  options.lambda = 1;
  options.align = pulson::AlignmentKind::kNone;  // a half turn would change the places of the discs, too
  const pulson::matching::Registration registration = pulson::matching::register_shapes(source, target, options);
  std::cout.precision(4);
  std::cout << (registration.matched() ? "matched" : "not matched") << ", energy " << registration.cost.energy
            << ", action " << registration.cost.action << " of " << registration.increments.rows() << " channels\n";
}
