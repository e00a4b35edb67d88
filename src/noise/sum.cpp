#include <map>
#include <stdexcept>
#include <string>

#include "models.hpp"

namespace pulson {
namespace {

class SumOfNoises final : public NoiseModel {
 public:
  explicit SumOfNoises(std::vector<std::shared_ptr<const NoiseModel>> terms) : terms_(std::move(terms)) {}

  std::string spec() const override {
    std::string text;
    for (const auto& term : terms_) text += (text.empty() ? "" : "+") + term->spec();
    return text;
  }
  int channels(int dimension, int count) const override {
    int sum = 0;
    for (const auto& term : terms_) sum += term->channels(dimension, count);
    return sum;
  }
  NoiseTraits traits() const override {
    NoiseTraits all{.linear = true};
    for (const auto& term : terms_) {
      const NoiseTraits one = term->traits();
      all.moves_positions |= one.moves_positions;
      all.moves_momenta |= one.moves_momenta;
      all.additive &= one.additive;
      all.compensated |= one.compensated;
      all.hamiltonian &= one.hamiltonian;
      all.translation_invariant &= one.translation_invariant;
      all.diffeomorphic &= one.diffeomorphic;
      all.local &= one.local;
      all.linear &= one.linear;
    }
    return all;
  }
  void check(int dimension, int count) const override {
    for (const auto& term : terms_) term->check(dimension, count);
  }

  Eigen::VectorXd potentials(const PhaseState& state) const override {
    return joined(state, [&](const NoiseModel& term) { return term.potentials(state); });
  }
  Eigen::VectorXd contract(const PhaseState& state, const PhaseState& with) const override {
    return joined(state, [&](const NoiseModel& term) { return term.contract(state, with); });
  }
  PhaseState gradient(const PhaseState& state, const Eigen::VectorXd& w) const override {
    return added(state, w,
                 [&](const NoiseModel& term, const Eigen::VectorXd& w_term) { return term.gradient(state, w_term); });
  }
  PhaseState hessian(const PhaseState& state, const Eigen::VectorXd& w, const PhaseState& change) const override {
    return added(state, w, [&](const NoiseModel& term, const Eigen::VectorXd& w_term) {
      return term.hessian(state, w_term, change);
    });
  }
  // Channels of different terms share none, so their G add.
  PhaseState compensation_gradient(const PhaseState& state) const override {
    return added(state, [&](const NoiseModel& term) { return term.compensation_gradient(state); });
  }
  PhaseState compensation_hessian(const PhaseState& state, const PhaseState& change) const override {
    return added(state, [&](const NoiseModel& term) { return term.compensation_hessian(state, change); });
  }

  Points spatial_noise(const Points& x, const Eigen::VectorXd& w, int count) const override {
    return added_fields(x, w, count, [&](const NoiseModel& term, const Eigen::VectorXd& w_term) {
      return term.spatial_noise(x, w_term, count);
    });
  }
  Points spatial_noise_change(const Points& x, const Eigen::VectorXd& w, int count,
                              const Points& change) const override {
    return added_fields(x, w, count, [&](const NoiseModel& term, const Eigen::VectorXd& w_term) {
      return term.spatial_noise_change(x, w_term, count, change);
    });
  }
  Points spatial_compensation(const Points& x) const override {
    Points field = Points::Zero(x.rows(), x.cols());
    for (const auto& term : terms_) field += term->spatial_compensation(x);
    return field;
  }
  Points spatial_compensation_change(const Points& x, const Points& change) const override {
    Points field = Points::Zero(x.rows(), x.cols());
    for (const auto& term : terms_) field += term->spatial_compensation_change(x, change);
    return field;
  }

  double friction() const override {
    double sum = 0;
    for (const auto& term : terms_) sum += term->friction();
    return sum;
  }

  // `ch-sd.beta`, and `ch-sd#2.beta` of the second term with that name.
  std::vector<std::string> parameter_names() const override {
    std::vector<std::string> names;
    std::map<std::string, int> met;
    for (const auto& term : terms_) {
      const std::string spec = term->spec();
      std::string owner = spec.substr(0, spec.find(':'));
      if (const int number = ++met[owner]; number > 1) owner.append("#").append(std::to_string(number));
      owner += '.';
      for (const std::string& name : term->parameter_names()) names.push_back(owner + name);
    }
    return names;
  }
  Eigen::VectorXd parameters() const override {
    Eigen::VectorXd all(parameter_count());
    for_each_with_parameters([&](const NoiseModel& term, Eigen::Index first, Eigen::Index size) {
      all.segment(first, size) = term.parameters();
    });
    return all;
  }
  std::shared_ptr<const NoiseModel> with_parameters(const Eigen::VectorXd& parameters) const override {
    if (parameters.size() != parameter_count())
      throw std::logic_error("a sum of noise models has the parameters of all its terms");
    std::vector<std::shared_ptr<const NoiseModel>> terms;
    for_each_with_parameters([&](const NoiseModel& term, Eigen::Index first, Eigen::Index size) {
      terms.push_back(term.with_parameters(parameters.segment(first, size)));
    });
    return std::make_shared<SumOfNoises>(std::move(terms));
  }
  PhaseState gradient_by_parameters(const PhaseState& state, const Eigen::VectorXd& w,
                                    const Eigen::VectorXd& change) const override {
    Eigen::Index parameter = 0;
    return added(state, w, [&](const NoiseModel& term, const Eigen::VectorXd& w_term) {
      const Eigen::Index size = term.parameters().size();
      parameter += size;
      return term.gradient_by_parameters(state, w_term, change.segment(parameter - size, size));
    });
  }
  PhaseState compensation_by_parameters(const PhaseState& state, const Eigen::VectorXd& change) const override {
    Eigen::Index parameter = 0;
    return added(state, [&](const NoiseModel& term) {
      const Eigen::Index size = term.parameters().size();
      parameter += size;
      return term.compensation_by_parameters(state, change.segment(parameter - size, size));
    });
  }
  double friction_by_parameters(const Eigen::VectorXd& change) const override {
    double sum = 0;
    for_each_with_parameters([&](const NoiseModel& term, Eigen::Index first, Eigen::Index size) {
      sum += term.friction_by_parameters(change.segment(first, size));
    });
    return sum;
  }

 private:
  static Eigen::Index channels_of(const NoiseModel& term, const PhaseState& state) {
    return term.channels(static_cast<int>(state.q.rows()), static_cast<int>(state.q.cols()));
  }
  Eigen::Index parameter_count() const {
    Eigen::Index sum = 0;
    for (const auto& term : terms_) sum += term->parameters().size();
    return sum;
  }

  template <class Visit>
  void for_each_with_parameters(const Visit& visit) const {
    Eigen::Index first = 0;
    for (const auto& term : terms_) {
      const Eigen::Index size = term->parameters().size();
      visit(*term, first, size);
      first += size;
    }
  }

  template <class Part>
  Points added_fields(const Points& x, const Eigen::VectorXd& w, int count, const Part& part) const {
    Points field = Points::Zero(x.rows(), x.cols());
    Eigen::Index channel = 0;
    for (const auto& term : terms_) {
      const Eigen::Index size = term->channels(static_cast<int>(x.rows()), count);
      field += part(*term, Eigen::VectorXd(w.segment(channel, size)));
      channel += size;
    }
    return field;
  }

  template <class Part>
  Eigen::VectorXd joined(const PhaseState& state, const Part& part) const {
    Eigen::VectorXd all(channels(static_cast<int>(state.q.rows()), static_cast<int>(state.q.cols())));
    Eigen::Index channel = 0;
    for (const auto& term : terms_) {
      const Eigen::Index size = channels_of(*term, state);
      all.segment(channel, size) = part(*term);
      channel += size;
    }
    return all;
  }

  template <class Part>
  PhaseState added(const PhaseState& state, const Part& part) const {
    const Points zero = Points::Zero(state.q.rows(), state.q.cols());
    PhaseState sum{zero, zero};
    for (const auto& term : terms_) {
      const PhaseState one = part(*term);
      sum.q += one.q;
      sum.p += one.p;
    }
    return sum;
  }
  template <class Part>
  PhaseState added(const PhaseState& state, const Eigen::VectorXd& w, const Part& part) const {
    Eigen::Index channel = 0;
    return added(state, [&](const NoiseModel& term) {
      const Eigen::Index size = channels_of(term, state);
      channel += size;
      return part(term, Eigen::VectorXd(w.segment(channel - size, size)));
    });
  }

  std::vector<std::shared_ptr<const NoiseModel>> terms_;
};

}  // namespace

std::shared_ptr<const NoiseModel> sum_of_noises(std::vector<std::shared_ptr<const NoiseModel>> terms) {
  return std::make_shared<SumOfNoises>(std::move(terms));
}

}  // namespace pulson
