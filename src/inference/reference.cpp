#include "reference.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/factorisations.hpp"
#include "matching/maximum.hpp"
#include "matching/solvers.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "random/normals.hpp"

namespace pulson::inference {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kSmallGain = 0.05;  // nats: the minimum is that of a reference
constexpr double kFarBelow = 12;     // nats
constexpr int kMostTurns = 8;        // of θ and z: trees whose width is a third, or twice, its median took 4
constexpr double kSameCentre = 0.6;  // deviations of φ in a turn, which went on to move by 0.3 to 0.5 in the first
constexpr int kSearchesOfFew = 16;
constexpr std::uint64_t kGuessPath = 1ULL << 60U;
// Of the reference a fifth is wide: so much the evidence's error grows at most where the path is linear, by a tenth.
constexpr double kWidePart = 0.2;
constexpr int kWidths = 3;

// Where searches for minima begin: the z of greatest probability by the searches of registration, then the other minima
// that these find, and then draws of the prior.
std::vector<VectorXd> first_guesses(const Specimen& specimen, const Specimen::Model& model, int searches,
                                    std::uint64_t seed) {
  const auto unknowns = static_cast<int>(specimen.unknowns());
  std::vector<VectorXd> guesses;
  if (specimen.momentum_unknowns() == 0) {
    guesses.emplace_back(VectorXd::Zero(unknowns));
  } else {
    matching::MatchingProblem problem = specimen.problem();
    problem.integrator = make_integrator("variational-2");
    const matching::MatchingObjective objective(problem);
    matching::MinimiseOptions options;
    options.seed = seed;
    matching::MinimiseSummary counts;
    guesses = path_guesses(objective, options, kFarBelow, counts);
    guesses.front() = minimise_from(objective, options, guesses.front()).solution.z;
    for (VectorXd& z : guesses) z = specimen.white(model, objective.momenta(z), objective.increments(z));
  }
  for (int search = 1; search < searches; ++search)
    guesses.emplace_back(standard_normals(seed, kGuessPath + static_cast<std::uint64_t>(search), unknowns, 1));
  return guesses;
}

// Whether two minima are within a standard deviation of each other.
bool same_minimum(const LinearAt& linear, const VectorXd& a, const VectorXd& b) {
  const VectorXd apart = a - b;
  return apart.squaredNorm() + linear.apply(apart).squaredNorm() < 1;
}

}  // namespace

Minimum find_minimum(const Specimen& specimen, const Specimen::Model& model, const VectorXd& start) {
  return posterior::find_minima({&specimen}, model, {{start}}, {.tolerance = kSmallGain}).front();
}

std::vector<Minimum> find_minima(const Specimen& specimen, const Specimen::Model& model, int searches,
                                 std::uint64_t seed) {
  if (searches == 0) searches = specimen.data() <= kFewData ? kSearchesOfFew : 1;
  std::vector<Minimum> minima;
  std::vector<double> evidences;
  const std::vector<VectorXd> guesses = first_guesses(specimen, model, searches, seed);
  for (const VectorXd& guess : guesses) {
    try {
      Minimum found = find_minimum(specimen, model, guess);
      const LinearAt linear(*found.linear, model);
      const bool known = std::any_of(minima.begin(), minima.end(),
                                     [&](const Minimum& other) { return same_minimum(linear, found.z, other.z); });
      if (known || (!found.converged && !minima.empty())) continue;
      if (!std::isfinite(linear.log_evidence()))
        throw NumericalError("the evidence of the linear model leaves the range of numbers; change the unit, or sigma");
      evidences.push_back(linear.log_evidence());
      minima.push_back(std::move(found));
    } catch (const NumericalError&) {
      if (&guess == &guesses.back() && minima.empty()) throw;
    }
  }
  const double best = *std::max_element(evidences.begin(), evidences.end());
  std::vector<Minimum> kept;
  for (std::size_t m = 0; m < minima.size(); ++m)
    if (evidences[m] > best - kFarBelow) kept.push_back(std::move(minima[m]));
  return kept;
}

double log_standard_normal(const VectorXd& phi) {
  return -0.5 * phi.squaredNorm() - 0.5 * static_cast<double>(phi.size()) * std::log(2 * std::numbers::pi);
}

namespace {

// log(Σ exp x)
double log_sum_exp(const VectorXd& x) { return x.maxCoeff() + std::log((x.array() - x.maxCoeff()).exp().sum()); }

// log N(φ; φ̂, BBᵀ)
double log_normal_at(const Reference& reference, const VectorXd& phi) {
  const VectorXd white = reference.root.triangularView<Eigen::Lower>().solve(phi - reference.centre);
  return log_standard_normal(white) - reference.root.diagonal().array().log().sum();
}

}  // namespace

double Reference::log_density(const VectorXd& phi) const {
  if (phi.size() == 0) return 0;
  return log_sum_exp(Eigen::Vector2d(std::log1p(-kWidePart) + log_normal_at(*this, phi),
                                     std::log(kWidePart) + log_standard_normal(phi)));
}

VectorXd Reference::draw(const VectorXd& normals, double uniform) const {
  if (normals.size() == 0 || uniform < kWidePart) return normals;
  return centre + VectorXd(root.triangularView<Eigen::Lower>() * normals);
}

void defend(Reference& reference, const std::vector<Specimen>& specimens, const ParameterSpace& space,
            double inflation) {
  const posterior::Numbers numbers = space.at(reference.centre);
  for (std::size_t s = 0; s < specimens.size(); ++s) {
    const Specimen::Model model = specimens[s].model(numbers);
    // Of all specimens together, as their weights are multiplied.
    const double part = kWidePart / static_cast<double>(specimens.size());
    const VectorXd of_modes = reference.log_weights[s];
    std::vector<Component>& components = reference.components.emplace_back();
    std::vector<double> weights;
    for (std::size_t m = 0; m < reference.minima[s].size(); ++m) {
      const LinearAt linear(*reference.minima[s][m].linear, model);
      const double of_mode = std::exp(of_modes[static_cast<Index>(m)]);
      components.push_back({m, inflation});
      weights.push_back((1 - part) * of_mode);
      // Where σ is that much larger, no direction of the data is known twice as well as a priori.
      const double widest = std::sqrt(1 + linear.momentum_share() + linear.noise_share());
      for (int step = 1; step <= kWidths; ++step) {
        components.push_back({m, inflation * std::pow(widest, static_cast<double>(step) / kWidths)});
        weights.push_back(part * of_mode / (kWidths + 1));
      }
    }
    components.push_back({0, kOfPrior});
    weights.push_back(part / (kWidths + 1));
    reference.log_weights[s] = VectorXd::Map(weights.data(), std::ssize(weights)).array().log();
  }
}

namespace {

// log p(φ) + Σ log max_m p_m(y | φ), of linear models: those of the reference, or new ones at their minima at φ, which
// know how the fields change with θ.
class LinearPosterior {
 public:
  LinearPosterior(const std::vector<Specimen>& specimens, const ParameterSpace& space, const Reference& reference,
                  bool anew)
      : specimens_(specimens), space_(space), reference_(reference), anew_(anew) {}

  double operator()(const VectorXd& phi) const {
    double sum = log_standard_normal(phi);
    try {
      const posterior::Numbers numbers = space_.at(phi);
      for (std::size_t i = 0; i < specimens_.size(); ++i) {
        const Specimen::Model model = specimens_[i].model(numbers);
        double best = -std::numeric_limits<double>::infinity();
        for (const Minimum& minimum : reference_.minima[i]) {
          const LinearAt linear(*minimum.linear, model);
          best = std::max(best, anew_ ? evidence_anew(specimens_[i], model, linear.mean()) : linear.log_evidence());
        }
        sum += best;
      }
    } catch (const Error&) {
      return -std::numeric_limits<double>::infinity();
    }
    return std::isfinite(sum) ? sum : -std::numeric_limits<double>::infinity();
  }

 private:
  static double evidence_anew(const Specimen& specimen, const Specimen::Model& model, const VectorXd& z) {
    const auto shot = specimen.shoot(model, z);
    if (!shot) return -std::numeric_limits<double>::infinity();
    return LinearAt(LinearModel(specimen, model, *shot, z), model).log_evidence();
  }

  const std::vector<Specimen>& specimens_;
  const ParameterSpace& space_;
  const Reference& reference_;
  bool anew_;
};

// By Newton's method. Eigenvalues of the information are raised to 1/4, half the deviation that the prior leaves.
matching::NewtonMaximum maximise(const LinearPosterior& f, const VectorXd& phi) {
  constexpr double kStep = 0.1;  // of φ, whose deviations a priori are 1
  constexpr double kLeastInformation = 0.25;
  constexpr double kNear = 0.1;  // deviations from the maximum: the law about it is a proposal
  const auto model = [&](const VectorXd& x) {
    matching::SecondOrder here = matching::second_order(f, x, kStep, true);
    if (!here.information.allFinite()) here.information = MatrixXd::Identity(x.size(), x.size());
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(here.information);
    here.information = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(kLeastInformation).asDiagonal() *
                       eigen.eigenvectors().transpose();
    return here;
  };
  const VectorXd everywhere = VectorXd::Constant(phi.size(), std::numeric_limits<double>::infinity());
  return matching::maximise_by_newton(f, model, {-everywhere, everywhere}, phi, {.tolerance = 0.5 * kNear * kNear});
}

}  // namespace

Reference make_reference(const std::vector<Specimen>& specimens, const ParameterSpace& space, int searches,
                         std::uint64_t seed) {
  const SerialBlas serial;
  Reference reference;
  const Index k = space.count();
  reference.centre = VectorXd::Zero(k);
  reference.minima.resize(specimens.size());
  const auto count = static_cast<int>(specimens.size());
  posterior::Numbers numbers = space.at(reference.centre);
  parallel_for(count, [&](int i) {
    const auto s = static_cast<std::size_t>(i);
    reference.minima[s] = find_minima(specimens[s], specimens[s].model(numbers), searches, seed);
  });
  matching::NewtonMaximum best;
  // Linear models of another place know nothing of a width: from the second turn on they are new ones, about minima
  // that are of a place nearby once φ no longer moves.
  bool settled = false;
  for (int turn = 0; k > 0 && turn < kMostTurns && !settled; ++turn) {
    best = maximise(LinearPosterior(specimens, space, reference, turn > 0), reference.centre);
    const VectorXd moved = best.x - reference.centre;
    settled = turn > 0 && moved.dot(best.about.information * moved) < kSameCentre * kSameCentre;
    reference.centre = best.x;
    numbers = space.at(reference.centre);
    parallel_for(count, [&](int i) {
      const auto s = static_cast<std::size_t>(i);
      const Specimen::Model model = specimens[s].model(numbers);
      for (Minimum& minimum : reference.minima[s])
        minimum = find_minimum(specimens[s], model, LinearAt(*minimum.linear, model).mean());
    });
  }
  numbers = space.at(reference.centre);
  double laplace = 0;
  for (std::size_t s = 0; s < specimens.size(); ++s) {
    VectorXd logs(std::ssize(reference.minima[s]));
    const Specimen::Model model = specimens[s].model(numbers);
    for (Index m = 0; m < logs.size(); ++m)
      logs[m] = LinearAt(*reference.minima[s][static_cast<std::size_t>(m)].linear, model).log_evidence();
    const double sum = log_sum_exp(logs);
    laplace += sum;
    reference.log_weights.emplace_back(logs.array() - sum);
  }
  if (k > 0) {
    const MatrixXd covariance = best.about.information.inverse();
    reference.root = Eigen::LLT<MatrixXd>(covariance).matrixL();
    laplace += log_standard_normal(reference.centre) - log_normal_at(reference, reference.centre);
  }
  reference.laplace_log_evidence = laplace;
  return reference;
}

}  // namespace pulson::inference
