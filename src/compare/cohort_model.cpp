#include "cohort_model.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/core.h>

#include "core/text.hpp"
#include "matching/solvers.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/matching/data_term.hpp"

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using posterior::LinearAt;
using posterior::Minimum;
using posterior::Specimen;

constexpr double kUnit = 6;      // v₀ has so many times the effect of σ²: below, the evidence is linear in v
constexpr double kTrial = 1e-3;  // amplitudes at which effects are found, of the shapes' differences: linear
constexpr double kUnobservable = 1e-12;  // fraction of the variance of a noise: what rounding leaves of none
constexpr double kMostVariance = 16;     // x of a variance at most: 10⁷ times the effect of σ²
constexpr double kWidthRange = 2.1;      // of the logarithm of the kernel's width: a factor of 8
constexpr double kOtherRange = 3.4;      // of other logarithms: a factor of 30
// Of 387 searches on the leaves those that converged did so in 15 steps, and took few of less than an eighth.
constexpr posterior::MinimumOptions kRoughly{.tolerance = 1e-2, .most_steps = 15};

// |r|² at an end.
double misfit(const Specimen& specimen, const Specimen::Model& model, const VectorXd& end) {
  return specimen.residual(model, end).head(specimen.coordinates()).squaredNorm();
}

// Root mean square of what is observed of the shapes' differences from the source, length units.
double difference(const std::vector<Specimen>& specimens, const Specimen::Model& model, double sigma) {
  double sum = 0;
  Index count = 0;
  for (const Specimen& specimen : specimens) {
    sum += misfit(specimen, model, specimen.problem().source.reshaped());
    count += specimen.coordinates();
  }
  return sigma * std::sqrt(std::max(sum / static_cast<double>(count), 1.0));
}

}  // namespace

double ModelNumber::value(double x) const {
  if (kind == Kind::kSigma) return unit * std::sqrt(std::max(std::expm1(x), 0.0));
  if (!is_variance()) return unit * std::exp(x);
  const double v = unit * std::max(std::expm1(x), kNegligible);
  return kind == Kind::kLambda ? 1 / v : std::sqrt(v);
}

double ModelNumber::place(double value) const {
  if (kind == Kind::kSigma) return std::log1p(std::pow(value / unit, 2));
  if (!is_variance()) return std::log(value / unit);
  return std::log1p((kind == Kind::kLambda ? 1 / value : value * value) / unit);
}

const Specimen& CohortModel::fullest() const {
  return *std::max_element(specimens_.begin(), specimens_.end(), [](const Specimen& one, const Specimen& other) {
    return one.coordinates() < other.coordinates();
  });
}

bool Matches::all_converged() const {
  return std::all_of(minima.begin(), minima.end(), [](const Minimum& match) { return match.converged; });
}

CohortModel::CohortModel(const Cohort& cohort, OpenNoise noise, const CohortSettings& settings)
    : cohort_(cohort),
      settings_(settings),
      sigma_(settings.sigma.in(diameter(cohort.source.points))),
      kernel_(settings.kernel.make(cohort.source.points)),
      integrator_(make_integrator(settings.integrator)),
      noise_(std::move(noise)) {
  using Kind = ModelNumber::Kind;
  require_positive("sigma", sigma_);
  if (cohort.targets.empty()) throw InputError("there is no shape to fit a model to");
  const Points& source = cohort.source.points;
  const auto d = static_cast<int>(source.rows()), n = static_cast<int>(source.cols());
  noise_.model->check(d, n);
  const std::vector<NoiseAmplitude> amplitudes = noise_.model->amplitudes(d, n);
  const auto is_amplitude = [&](Index parameter) {
    return std::any_of(amplitudes.begin(), amplitudes.end(),
                       [&](const NoiseAmplitude& a) { return a.parameter == parameter && a.power == 1; });
  };
  const std::vector<std::string> names = noise_.model->parameter_names();
  if (!settings.lambda) open_.push_back({Kind::kLambda, "lambda"});
  for (const Index i : noise_.open)
    if (is_amplitude(i)) open_.push_back({Kind::kAmplitude, names[at(i)], i});
  if (settings.fit_width) open_.push_back({Kind::kWidth, "alpha", 0, kernel_.terms().front().alpha});
  for (const Index i : noise_.open)
    if (!is_amplitude(i)) open_.push_back({Kind::kOther, names[at(i)], i, std::pow(kernel_.terms().front().alpha, 2)});
  if (settings.fit_sigma) open_.push_back({Kind::kSigma, "data-sigma", 0, sigma_});
  find_units();
}

// Amplitudes such that momenta and every open channel explain equal shares of the observed variance, linearised at
// rest; there the effect of each is proportional to its variance.
void CohortModel::find_units() {
  const Points& source = cohort_.source.points;
  const double far = diameter(source);
  posterior::Numbers numbers{std::make_shared<KernelOperator>(kernel_), noise_.model,
                             settings_.lambda.value_or(1 / (far * far)), 1};
  for (int s = 0; s < static_cast<int>(cohort_.targets.size()); ++s) try {
      specimens_.emplace_back(problem(numbers, s), cohort_.alignment);
    } catch (const InputError& error) {
      throw InputError(fmt::format("{}: {}", cohort_.targets[at(s)].source, error.what()));
    }
  VectorXd theta = noise_.model->parameters();
  Specimen::Model model = specimens_.front().model(numbers);
  const double size = difference(specimens_, model, sigma_);
  for (const ModelNumber& number : open_)
    if (number.kind == ModelNumber::Kind::kAmplitude)
      theta[number.parameter] = kTrial * size;
    else if (number.kind == ModelNumber::Kind::kOther)
      theta[number.parameter] = number.unit;
  if (theta.size() > 0) numbers.noise = noise_.model->with_parameters(theta);
  model = specimens_.front().model(numbers);
  const Specimen& first = specimens_.front();
  size_exponent_ = std::make_shared<posterior::SizeExponent>(first, model);
  if (cohort_.about_own_mean) {
    matching::MatchingProblem whole = problem(numbers, 0);
    whole.data = std::make_shared<matching::LandmarkTerm>(
        matching::LandmarkObservations{source, sigma_ * numbers.sigma, {}, {}});
    own_mean_ = std::make_shared<OwnMean>(specimens_, posterior::RestModel(Specimen(std::move(whole)), model));
  }
  const auto shot = first.shoot(model, VectorXd::Zero(first.unknowns()));
  if (!shot)
    throw NumericalError(
        "landmarks at rest have no path: the noise is too strong for the time step; use more `grid.steps`");
  const Specimen::Slopes slopes = first.slopes(model, *shot);
  check_observable(slopes.branches.front());
  const posterior::LinearModel at_rest(first, model, slopes, shot->residual, VectorXd::Zero(first.unknowns()));
  double excess = 0;
  Index data = 0;
  for (const Specimen& specimen : specimens_) {
    const auto n = static_cast<double>(specimen.coordinates());
    excess += std::max(misfit(specimen, model, source.reshaped()), 2 * n) - n;
    data += specimen.coordinates();
  }
  excess /= static_cast<double>(data);
  const auto n = static_cast<double>(first.coordinates());
  const auto groups = static_cast<double>(
      std::count_if(open_.begin(), open_.end(), [](const ModelNumber& number) { return number.is_variance(); }));
  const auto variance_at = [&](const Specimen::Model& other) {
    return at_rest.covariance(other).diagonal().head(first.coordinates()).sum();
  };
  const double variance = variance_at(model);
  box_ = {VectorXd(count()), VectorXd(count())};
  start_ = VectorXd::Zero(count());
  for (Index i = 0; i < count(); ++i) {
    ModelNumber& number = open_[at(i)];
    const double range = number.kind == ModelNumber::Kind::kWidth ? kWidthRange : kOtherRange;
    const bool is_sigma = number.kind == ModelNumber::Kind::kSigma;
    box_.least[i] = is_sigma ? std::log1p(std::exp(-2 * range)) : -range;
    box_.most[i] = is_sigma ? std::log1p(std::exp(2 * range)) : range;
    if (is_sigma) start_[i] = number.place(number.unit);
    if (!number.is_variance()) continue;
    // What twice the variance adds.
    posterior::Numbers twice = numbers;
    const bool is_lambda = number.kind == ModelNumber::Kind::kLambda;
    if (is_lambda) {
      twice.lambda /= 2;
    } else {
      VectorXd more = theta;
      more[number.parameter] *= std::sqrt(2.0);
      twice.noise = noise_.model->with_parameters(more);
    }
    const double v = is_lambda ? 1 / numbers.lambda : std::pow(theta[number.parameter], 2);
    const double effect = (variance_at(first.model(twice)) - variance) / n;
    number.unit = kUnit * v / effect;
    box_.least[i] = std::log1p(kNegligible);
    box_.most[i] = kMostVariance;
    start_[i] = std::log1p(excess / groups / kUnit);
  }
}

// The amplitude of noise whose displacements the alignment removes is not determined.
void CohortModel::check_observable(const Specimen::BranchSlopes& slopes) const {
  const Points& source = cohort_.source.points;
  const auto amplitudes = noise_.model->amplitudes(static_cast<int>(source.rows()), static_cast<int>(source.cols()));
  const Index channels = specimens_.front().channels();
  for (const NoiseAmplitude& amplitude : amplitudes) {
    if (std::find(noise_.open.begin(), noise_.open.end(), amplitude.parameter) == noise_.open.end()) continue;
    std::vector<Index> columns;
    for (Index i = 0; i < slopes.end.cols(); ++i)
      if (std::binary_search(amplitude.channels.begin(), amplitude.channels.end(), static_cast<int>(i % channels)))
        columns.push_back(i);
    const MatrixXd whole = slopes.end(Eigen::all, columns);
    if ((slopes.by_end * whole).squaredNorm() > kUnobservable * whole.squaredNorm() / (sigma_ * sigma_)) continue;
    throw InputError(fmt::format("noise '{}' moves the shapes only as their alignment ({}) does, which removes it",
                                 noise_.model->spec(), alignment_name(cohort_.alignment)));
  }
}

posterior::Numbers CohortModel::numbers(const VectorXd& x) const {
  posterior::Numbers numbers{std::make_shared<KernelOperator>(kernel_), noise_.model, settings_.lambda.value_or(1), 1};
  VectorXd theta = noise_.model->parameters();
  for (Index i = 0; i < count(); ++i) {
    const ModelNumber& number = open_[at(i)];
    switch (number.kind) {
      case ModelNumber::Kind::kLambda:
        numbers.lambda = number.value(x[i]);
        break;
      case ModelNumber::Kind::kAmplitude:
      case ModelNumber::Kind::kOther:
        theta[number.parameter] = number.value(x[i]);
        break;
      case ModelNumber::Kind::kWidth: {
        std::vector<KernelTerm> terms = kernel_.terms();
        for (KernelTerm& term : terms) term.alpha *= std::exp(x[i]);
        numbers.kernel = std::make_shared<KernelOperator>(std::move(terms));
        break;
      }
      case ModelNumber::Kind::kSigma:
        numbers.sigma = number.value(x[i]) / number.unit;
        break;
    }
  }
  if (theta.size() > 0) numbers.noise = noise_.model->with_parameters(theta);
  return numbers;
}

bool CohortModel::may_lack_noise() const {
  const auto d = static_cast<int>(cohort_.source.points.rows()), n = static_cast<int>(cohort_.source.points.cols());
  const std::vector<NoiseAmplitude> amplitudes = noise_.model->amplitudes(d, n);
  const auto is_open = [&](const NoiseAmplitude& amplitude) {
    return amplitude.power == 1 && std::any_of(open_.begin(), open_.end(), [&](const ModelNumber& number) {
             return number.kind == ModelNumber::Kind::kAmplitude && number.parameter == amplitude.parameter;
           });
  };
  return !amplitudes.empty() && std::all_of(amplitudes.begin(), amplitudes.end(), is_open);
}

VectorXd CohortModel::place_without_noise(const std::vector<FittedNumber>& of_none) const {
  VectorXd x = VectorXd::Zero(count());
  for (Index i = 0; i < count(); ++i) {
    const ModelNumber& number = open_[at(i)];
    if (number.kind == ModelNumber::Kind::kAmplitude || number.kind == ModelNumber::Kind::kOther) continue;
    const auto found = std::find_if(of_none.begin(), of_none.end(),
                                    [&](const FittedNumber& fitted) { return fitted.name == number.name; });
    x[i] = number.place(found->value);
  }
  return box_.clipped(x);
}

VectorXd CohortModel::place(const std::vector<double>& values) const {
  VectorXd x(count());
  for (Index i = 0; i < count(); ++i) x[i] = open_[at(i)].place(values[at(i)]);
  return box_.clipped(x);
}

matching::MatchingProblem CohortModel::problem(const posterior::Numbers& numbers, int shape) const {
  return {{*numbers.kernel, numbers.noise},
          integrator_,
          settings_.grid,
          cohort_.source.points,
          std::make_shared<matching::LandmarkTerm>(matching::LandmarkObservations{
              cohort_.targets[at(shape)].points, sigma_ * numbers.sigma, cohort_.weights_of(at(shape)), {}}),
          sigma_ * numbers.sigma,
          numbers.lambda,
          {},
          kFaint};
}

Matches CohortModel::match(const VectorXd& x, const Matches* near, Effort effort) const {
  const auto starts_of = [&](const Specimen::Model& model, int s) -> std::vector<VectorXd> {
    if (near == nullptr) return {};
    const Minimum& before = near->minima[at(s)];
    const Specimen& specimen = specimens_[at(s)];
    return {LinearAt(*before.linear, model).mean(),
            specimen.white(model, specimen.momenta(near->model, before.z), specimen.increments(0, before.z))};
  };
  return match_with(starts_of, x, effort);
}

Matches CohortModel::match_from(const VectorXd& x, const std::vector<const ShapeFit*>& near, Effort effort) const {
  const auto starts_of = [&](const Specimen::Model& model, int s) -> std::vector<VectorXd> {
    const ShapeFit& before = *near[at(s)];
    const Specimen& specimen = specimens_[at(s)];
    const MatrixXd none = MatrixXd::Zero(specimen.channels(), settings_.grid.steps);
    return {specimen.white(model, before.momenta, before.increments.rows() > 0 ? before.increments : none)};
  };
  return match_with(starts_of, x, effort);
}

Matches CohortModel::match_with(const Starts& starts_of, const VectorXd& x, Effort effort) const {
  const posterior::MinimumOptions options = effort == Effort::kRough ? kRoughly : posterior::MinimumOptions{};
  const posterior::Numbers numbers = this->numbers(x);
  Matches matches{x, specimens_.front().model(numbers), std::vector<Minimum>(specimens_.size()), {}, 0};
  matches.model.size_exponent = size_exponent_->at(matches.model);
  if (own_mean_) matches.at_rest = own_mean_->at_rest(matches.model);
  const Index at_once = posterior::ShotBatch(specimens_.front(), matches.model).at_once();
  parallel_for(static_cast<int>((shapes() + at_once - 1) / at_once), [&](int group) {
    const auto first = static_cast<int>(group * at_once);
    const int last = std::min(first + static_cast<int>(at_once), shapes());
    std::vector<const Specimen*> specimens;
    std::vector<std::vector<VectorXd>> starts;
    for (int s = first; s < last; ++s) {
      specimens.push_back(&specimens_[at(s)]);
      starts.push_back(starts_of(matches.model, s));
    }
    std::vector<Minimum> found = find_minima(specimens, matches.model, starts, options);
    for (int s = first; s < last; ++s) {
      Minimum& match = matches.minima[at(s)] = std::move(found[at(s - first)]);
      const Specimen& specimen = specimens_[at(s)];
      const auto poor = 2 * static_cast<double>(specimen.coordinates());
      if (effort == Effort::kThorough && (!match.converged || misfit(specimen, matches.model, match.end) > poor)) {
        const matching::MatchingObjective objective(problem(numbers, s));
        const VectorXd other = minimise(objective, {}).solution.z;
        const VectorXd begin = specimen.white(matches.model, objective.momenta(other), objective.increments(other));
        Minimum again = find_minima({&specimen}, matches.model, {{begin}}).front();
        if (again.cost < match.cost) match = std::move(again);
      }
      if (settings_.on_match) settings_.on_match();
    }
  });
  matches.log_evidence = laplace(matches);
  if (!std::isfinite(matches.log_evidence)) throw NumericalError("the evidence leaves the range of numbers");
  return matches;
}

double CohortModel::laplace(const Matches& matches) const {
  double sum = of_own_mean(matches, matches.model);
  for (const Minimum& match : matches.minima) sum += LinearAt(*match.linear, matches.model).laplace();
  return sum;
}

double CohortModel::of_own_mean(const VectorXd& x) const {
  if (!own_mean_) return 0;
  const Specimen::Model model = this->model(x);
  return own_mean_->log_factor(*own_mean_->at_rest(model), model);
}

}  // namespace pulson::compare
