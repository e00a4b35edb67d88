#include <stdexcept>
#include <string>

#include "core/open_numbers.hpp"
#include "models.hpp"
#include "pair_noises.hpp"

namespace pulson {
namespace {

// A sum of one term, from zero, where the whole sum is asked for: each term is rounded by itself.
template <class T>
MatrixOf<T>* zero_beside(const MatrixOf<T>* whole, MatrixOf<T>& part) {
  if (!whole) return nullptr;
  part = MatrixOf<T>::Constant(whole->rows(), whole->cols(), T(0));
  return &part;
}
template <class T>
StateOf<T>* zero_beside(const StateOf<T>* whole, StateOf<T>& part) {
  if (!whole) return nullptr;
  zero_beside(&whole->q, part.q);
  zero_beside(&whole->p, part.p);
  return &part;
}

class SumOfNoises final : public NoiseModel {
 public:
  explicit SumOfNoises(std::vector<std::shared_ptr<const NoiseModel>> terms) : terms_(std::move(terms)) {}

  std::string spec() const override {
    std::string text;
    for (const auto& term : terms_) text.append(text.empty() ? "" : "+").append(term->spec());
    return text;
  }
  int channels(int dimension, int count) const override {
    int sum = 0;
    for (const auto& term : terms_) sum += term->channels(dimension, count);
    return sum;
  }
  std::vector<NoiseChannel> describe_channels(int dimension, int count) const override {
    std::vector<NoiseChannel> all;
    for (const auto& term : terms_)
      for (NoiseChannel& channel : term->describe_channels(dimension, count)) all.push_back(std::move(channel));
    return all;
  }
  NoiseTraits traits() const override {
    NoiseTraits all{.displacement = Displacement::none(), .linear = true};
    for (const auto& term : terms_) {
      const NoiseTraits one = term->traits();
      all.displacement = all.displacement + one.displacement;
      all.moves_momenta |= one.moves_momenta;
      all.additive &= one.additive;
      all.compensated |= one.compensated;
      all.hamiltonian &= one.hamiltonian;
      all.translation_invariant &= one.translation_invariant;
      all.diffeomorphic &= one.diffeomorphic;
      all.local &= one.local;
      all.linear &= one.linear;
      all.affine &= one.affine;
    }
    return all;
  }
  void check(int dimension, int count) const override {
    for (const auto& term : terms_) term->check(dimension, count);
  }

  // `ch-sd.beta`, and `ch-sd#2.beta` of the second term with that name.
  std::vector<std::string> parameter_names() const override {
    std::vector<std::string> of_terms, names;
    for (const auto& term : terms_) {
      const std::string spec = term->spec();
      of_terms.push_back(spec.substr(0, spec.find(':')));
    }
    const std::vector<std::string> owners = term_owners(of_terms);
    for (std::size_t i = 0; i < terms_.size(); ++i)
      for (const std::string& name : terms_[i]->parameter_names()) names.push_back(owners[i] + name);
    return names;
  }
  std::vector<NoiseAmplitude> amplitudes(int dimension, int count) const override {
    std::vector<NoiseAmplitude> all;
    int parameter = 0, channel = 0;
    for (const auto& term : terms_) {
      for (NoiseAmplitude amplitude : term->amplitudes(dimension, count)) {
        amplitude.parameter += parameter;
        for (int& i : amplitude.channels) i += channel;
        all.push_back(std::move(amplitude));
      }
      parameter += static_cast<int>(term->parameters().size());
      channel += term->channels(dimension, count);
    }
    return all;
  }
  Eigen::VectorXd parameters() const override {
    Eigen::VectorXd all;
    for (const auto& term : terms_) {
      const Eigen::VectorXd theta = term->parameters();
      all.conservativeResize(all.size() + theta.size());
      all.tail(theta.size()) = theta;
    }
    return all;
  }
  std::shared_ptr<const NoiseModel> with_parameters(const Eigen::VectorXd& parameters) const override {
    if (parameters.size() != this->parameters().size())
      throw std::logic_error("a sum of noise models has the parameters of all its terms");
    std::vector<std::shared_ptr<const NoiseModel>> terms;
    Eigen::Index first = 0;
    for (const auto& term : terms_) {
      const Eigen::Index size = term->parameters().size();
      terms.push_back(term->with_parameters(parameters.segment(first, size)));
      first += size;
    }
    return std::make_shared<SumOfNoises>(std::move(terms));
  }

  const std::vector<std::shared_ptr<const NoiseModel>>& terms() const { return terms_; }

  void add_to(const NoiseSums<double>& sums) const override { add(sums); }
  void add_to(const NoiseSums<Dual>& sums) const override { add(sums); }
  void add_to(const SpaceSums<double>& sums) const override { add(sums); }
  void add_to(const SpaceSums<Dual>& sums) const override { add(sums); }

 private:
  // Channels of different terms share none, so their G add. Each term has its share of θ, of w and of the potentials.
  template <class T>
  void add(const NoiseSums<T>& to) const {
    Eigen::Index parameter = 0, channel = 0;
    for (const auto& term : terms_) {
      const VectorOf<T> theta = to.theta.segment(parameter, term->parameters().size());
      const Eigen::Index size = to.count > 0 ? term->channels(static_cast<int>(to.at.q.rows()), to.count) : 0;
      NoiseSums<T> share{.at = to.at, .theta = theta, .count = to.count, .friction = to.friction};
      if (to.w.size() > 0) share.w = to.w.segment(channel, size);
      VectorOf<T> potentials = VectorOf<T>::Constant(size, T(0));
      StateOf<T> gradient, compensation;
      if (to.potentials) share.potentials = &potentials;
      share.gradient = zero_beside(to.gradient, gradient);
      share.compensation = zero_beside(to.compensation, compensation);
      term->add_to(share);
      if (to.potentials) to.potentials->segment(channel, size) += potentials;
      if (to.gradient) *to.gradient += gradient;
      if (to.compensation) *to.compensation += compensation;
      parameter += theta.size();
      channel += size;
    }
  }

  template <class T>
  void add(const SpaceSums<T>& to) const {
    Eigen::Index channel = 0;
    for (const auto& term : terms_) {
      const Eigen::Index size = term->channels(static_cast<int>(to.at.q.rows()), static_cast<int>(to.at.q.cols()));
      SpaceSums<T> share{.x = to.x, .at = to.at};
      if (to.w.size() > 0) share.w = to.w.segment(channel, size);
      MatrixOf<T> noise, compensation;
      share.noise = zero_beside(to.noise, noise);
      share.compensation = zero_beside(to.compensation, compensation);
      term->add_to(share);
      if (to.noise) *to.noise += noise;
      if (to.compensation) *to.compensation += compensation;
      channel += size;
    }
  }

  std::vector<std::shared_ptr<const NoiseModel>> terms_;
};

}  // namespace

std::shared_ptr<const NoiseModel> sum_of_noises(std::vector<std::shared_ptr<const NoiseModel>> terms) {
  return std::make_shared<SumOfNoises>(std::move(terms));
}

std::vector<std::shared_ptr<const NoiseModel>> terms_of_sum(const NoiseModel& noise) {
  const auto* sum = dynamic_cast<const SumOfNoises*>(&noise);
  return sum == nullptr ? std::vector<std::shared_ptr<const NoiseModel>>() : sum->terms();
}

}  // namespace pulson
