#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>

#include <fmt/core.h>

#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/inference/posterior.hpp"
#include "pulson/matching/data_term.hpp"
#include "random/normals.hpp"
#include "rank_statistics.hpp"
#include "reference.hpp"

namespace pulson::inference {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr std::uint64_t kTruths = 1ULL << 62U;
constexpr int kMostTries = 100;
constexpr double kBand = 0.95;

// What is drawn from the prior, and the quantities that are ranked.
struct Truth {
  PosteriorProblem problem;
  VectorXd quantities;
};

std::vector<std::string> quantity_names(const PosteriorProblem& problem) {
  std::vector<std::string> names;
  for (const ParameterPrior& prior : problem.parameters) names.push_back(prior.name);
  names.insert(names.end(), {problem.tree.empty() ? "p0" : "node", "q(T/2)", "log_likelihood"});
  return names;
}

// @param first p0, or of a tree the place of its first inner node
VectorXd quantities(const VectorXd& theta, double first, double middle, double log_likelihood) {
  VectorXd all(theta.size() + 3);
  all << theta, first, middle, log_likelihood;
  return all;
}

// The first branch of a tree whose end is not observed.
std::size_t first_inner(const std::vector<Branch>& branches) {
  for (std::size_t b = 0; b < branches.size(); ++b)
    if (!branches[b].data) return b;
  return 0;
}

}  // namespace

class CalibrationStudy::Simulations {
 public:
  Simulations(const PosteriorProblem& problem, const CalibrationOptions& options)
      : options_(options),
        template_(problem),
        space_(problem),
        specimen_(problem.specimens.front(), problem.tree, problem.momenta) {
    template_.specimens.erase(template_.specimens.begin() + 1, template_.specimens.end());
    fault_ = VectorXd::Zero(space_.count());
    if (options.fault_name.empty()) return;
    bool known = false;
    for (Index j = 0; j < space_.count(); ++j) {
      const ParameterPrior& prior = space_.priors()[static_cast<std::size_t>(j)];
      if (prior.name != options.fault_name) continue;
      fault_[j] = std::log(options.fault_factor) / prior.log_deviation;
      known = true;
    }
    if (!known) throw InputError(fmt::format("the fault is of '{}', which is not sampled", options.fault_name));
  }

  Truth draw(int simulation) const {
    const Points& source = template_.specimens.front().source;
    const Index errors = static_cast<Index>(specimen_.branches().size()) * source.size();
    const auto count = static_cast<int>(specimen_.unknowns() + space_.count() + errors);
    for (int attempt = 0; attempt < kMostTries; ++attempt) {
      const std::uint64_t path =
          kTruths + static_cast<std::uint64_t>(simulation) * kMostTries + static_cast<std::uint64_t>(attempt);
      const VectorXd normals = standard_normals(options_.sampler.seed, path, count, 1);
      const VectorXd phi = normals.head(space_.count());
      const VectorXd z = normals.segment(space_.count(), specimen_.unknowns());
      const Specimen::Model model = specimen_.model(space_.at(phi + fault_));
      const auto drawn = specimen_.paths(model, z);
      if (!drawn) continue;
      return observed(model, *drawn, phi, normals.tail(errors));
    }
    throw NumericalError("paths drawn from the prior do not exist; use more `grid.steps` or a smaller amplitude");
  }

 private:
  Truth observed(const Specimen::Model& model, const std::vector<Trajectory>& paths, const VectorXd& phi,
                 const VectorXd& errors) const {
    Truth truth{template_, {}};
    const Points& source = template_.specimens.front().source;
    double misfit = 0;
    for (std::size_t b = 0; b < paths.size(); ++b) {
      const matching::DataTerm* data = specimen_.branches()[b].data.get();
      if (data == nullptr) continue;
      const Points& end = paths[b].final().q;
      const auto of_branch = errors.segment(static_cast<Index>(b) * source.size(), source.size());
      auto drawn = drawn_data(model, *data->landmarks(), end, of_branch.reshaped(source.rows(), source.cols()));
      misfit += (drawn->residual(end) / model.sigma).squaredNorm();
      (template_.tree.empty() ? truth.problem.specimens.front().data : truth.problem.tree[b].data) = std::move(drawn);
    }
    const double log_likelihood = -0.5 * misfit - specimen_.log_volume(model);
    const std::vector<PhaseState>& states = paths.front().states;
    const double first =
        template_.tree.empty() ? states.front().p(0, 0) : paths[first_inner(template_.tree)].final().q(0, 0);
    truth.quantities = quantities(space_.values(phi), first,
                                  states[states.size() / 2].q(source.rows() - 1, source.cols() - 1), log_likelihood);
    return truth;
  }

  // y = q(T) + √R ε, of the coordinates that the target has.
  std::shared_ptr<const matching::LandmarkTerm> drawn_data(const Specimen::Model& model,
                                                           const matching::LandmarkTerm& data, const Points& end,
                                                           const Points& errors) const {
    Points target = end;
    for (Index a = 0; a < target.cols(); ++a) {
      const MatrixXd precision = data.precision(a);
      for (Index i = 0; i < target.rows(); ++i)
        target(i, a) = precision(i, i) > 0 ? target(i, a) + model.sigma / std::sqrt(precision(i, i)) * errors(i, a)
                                           : std::numeric_limits<double>::quiet_NaN();
    }
    return std::make_shared<matching::LandmarkTerm>(
        matching::LandmarkObservations{target, template_.specimens.front().sigma, weights(data)});
  }

  VectorXd weights(const matching::LandmarkTerm& data) const {
    const double sigma = template_.specimens.front().sigma;
    VectorXd weights(template_.specimens.front().source.cols());
    for (Index a = 0; a < weights.size(); ++a) weights[a] = data.precision(a).diagonal().maxCoeff() * sigma * sigma;
    return weights;
  }

  const CalibrationOptions& options_;
  PosteriorProblem template_;
  ParameterSpace space_;
  Specimen specimen_;
  VectorXd fault_;
};

namespace {

// Ranks of the true values among L thinned draws.
std::vector<int> ranks_of(const Truth& truth, const PosteriorDraws& draws, int ranks) {
  std::vector<int> below(static_cast<std::size_t>(truth.quantities.size()), 0);
  const Index all = draws.log_likelihood.size();
  const Index last = draws.middles.front().rows() - 1;
  for (int i = 0; i < ranks; ++i) {
    const Index at = (i + 1) * all / ranks - 1;
    const double first =
        draws.momenta.empty() ? draws.ends[first_inner(truth.problem.tree)](0, at) : draws.momenta.front()(0, at);
    const VectorXd drawn =
        quantities(draws.parameters.col(at), first, draws.middles.front()(last, at), draws.log_likelihood[at]);
    for (Index j = 0; j < drawn.size(); ++j)
      if (drawn[j] < truth.quantities[j]) ++below[static_cast<std::size_t>(j)];
  }
  return below;
}

}  // namespace

CalibrationStudy::CalibrationStudy(const PosteriorProblem& problem, const CalibrationOptions& options)
    : options_(options), names_(quantity_names(problem)) {
  if (options.simulations < 1)
    throw InputError(fmt::format("there are {} simulations; at least 1 is needed", options.simulations));
  if (options.ranks < 1 || options.sampler.draws < options.ranks)
    throw InputError(fmt::format("{} draws are too few for {} ranks", options.sampler.draws, options.ranks));
  simulations_ = std::make_unique<const Simulations>(problem, options_);
}

CalibrationStudy::~CalibrationStudy() = default;

std::vector<int> CalibrationStudy::ranks(int simulation) const {
  SamplerOptions sampler = options_.sampler;
  sampler.chains = 1;
  sampler.paths_kept = 0;
  sampler.evidence = false;
  sampler.seed = options_.sampler.seed + 1 + static_cast<std::uint64_t>(simulation);
  sampler.on_progress = {};
  try {
    const Truth truth = simulations_->draw(simulation);
    return ranks_of(truth, sample_posterior(truth.problem, sampler), options_.ranks);
  } catch (const NumericalError&) {
    return {};
  }
}

Calibration CalibrationStudy::summarise(const std::vector<std::vector<int>>& ranks) const {
  Calibration calibration;
  calibration.ranks = options_.ranks;
  for (std::size_t j = 0; j < names_.size(); ++j) {
    CalibratedQuantity& quantity = calibration.quantities.emplace_back();
    quantity.name = names_[j];
    for (const std::vector<int>& of_simulation : ranks)
      if (!of_simulation.empty()) quantity.ranks.push_back(of_simulation[j]);
  }
  calibration.simulations = static_cast<int>(calibration.quantities.front().ranks.size());
  calibration.failed = options_.simulations - calibration.simulations;
  if (calibration.simulations == 0) throw NumericalError("no simulation has a posterior that could be sampled");
  const RankBand band = rank_band(calibration.simulations, options_.ranks, kBand);
  calibration.pointwise = band.pointwise;
  calibration.lower = band.lower;
  calibration.upper = band.upper;
  for (CalibratedQuantity& quantity : calibration.quantities) {
    const std::vector<int> counts = rank_counts(quantity.ranks, options_.ranks);
    quantity.deviation = rank_p_value(counts);
    for (std::size_t i = 0; i < counts.size(); ++i)
      quantity.inside_band = quantity.inside_band && counts[i] >= band.lower[i] && counts[i] <= band.upper[i];
  }
  return calibration;
}

Calibration calibrate(const PosteriorProblem& problem, const CalibrationOptions& options) {
  const SerialBlas serial;
  const auto start = std::chrono::steady_clock::now();
  const CalibrationStudy study(problem, options);
  std::vector<std::vector<int>> all(static_cast<std::size_t>(options.simulations));
  std::atomic<int> done = 0;
  parallel_for(options.simulations, [&](int s) {
    all[static_cast<std::size_t>(s)] = study.ranks(s);
    const int now = ++done;
    if (options.sampler.on_progress) options.sampler.on_progress(static_cast<double>(now) / options.simulations);
  });
  Calibration calibration = study.summarise(all);
  calibration.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return calibration;
}

}  // namespace pulson::inference
