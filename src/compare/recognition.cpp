#include "recognition.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <Eigen/Cholesky>

#include "cohort_model.hpp"
#include "pulson/core/parallel.hpp"
#include "random/normals.hpp"
#include "statistics.hpp"

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Kind = ModelNumber::Kind;
using posterior::Specimen;

constexpr int kCohorts = 50;            // from each model: a part to ± 7 %
constexpr double kShareShown = 0.1;     // of the variance: less is not asked for
constexpr double kShareAsked = 1 / 3.;  // where less was found
// Cubic interpolation in the logarithm of the width is off by (kSpacing/2)⁴ of a Gaussian's fourth derivative, 2e-5 of
// the variance.
constexpr double kSpacing = 0.1;
constexpr double kMostWidth = 1;                // of that logarithm from the width of `none`: a factor e
constexpr double kNoAmplitude = 1e-12;          // amplitude, beside those that are seen
constexpr double kSlopeStep = 1e-4;             // of x, for derivatives
constexpr double kNoiseLevel = 1.5;             // x of noise at which a search begins, as in number_search
constexpr std::uint64_t kStream = 1ULL << 40U;  // of random numbers

// What was seen of a cohort of vectors: Σ ddᵀ, and how many.
struct Seen {
  MatrixXd products;
  double count = 0;
};

// A model linear at rest: C(x) = σ²I + A(α)/λ + Σ_g β_g² B_g(α), at the σ of the data.
class RestModel {
 public:
  RestModel(const CohortModel& cohort, const CohortFit& fit, double width_of_none)
      : cohort_(cohort), box_(cohort.box()) {
    const auto& open = cohort.open();
    for (Index i = 0; i < cohort.count(); ++i) {
      const ModelNumber& number = open[at(i)];
      if (number.kind == Kind::kWidth) width_ = i;
      if (number.kind == Kind::kAmplitude) amplitudes_.push_back(i);
      if (number.kind == Kind::kOther) box_.least[i] = box_.most[i] = number.place(value_of(fit, number.name));
    }
    if (width_ >= 0) {
      const double centre = open[at(width_)].place(width_of_none);
      first_ = centre - kMostWidth - kSpacing;
      box_.least[width_] = centre - kMostWidth;
      box_.most[width_] = centre + kMostWidth;
    }
    const int places = width_ < 0 ? 1 : static_cast<int>(std::lround(2 * kMostWidth / kSpacing)) + 3;
    parts_.resize(static_cast<std::size_t>(places));
    parallel_for(places, [&](int k) { parts_[static_cast<std::size_t>(k)] = parts_at(first_ + k * kSpacing); });
  }

  const CohortModel& cohort() const { return cohort_; }
  const Box& box() const { return box_; }

  MatrixXd covariance(const VectorXd& x) const {
    const std::vector<double> weights = weights_of(x);
    std::vector<std::pair<std::size_t, double>> places;  // of the grid, and their coefficients
    if (width_ < 0) {
      places.emplace_back(0, 1);
    } else {
      const double along = (x[width_] - first_) / kSpacing;
      const double last = static_cast<double>(parts_.size()) - 3;
      const double floor = std::clamp(std::floor(along), 1.0, last);
      const double t = along - floor;
      const auto middle = static_cast<std::size_t>(floor);
      places = {{middle - 1, -t * (t - 1) * (t - 2) / 6},
                {middle, (t + 1) * (t - 1) * (t - 2) / 2},
                {middle + 1, -(t + 1) * t * (t - 2) / 2},
                {middle + 2, (t + 1) * t * (t - 1) / 6}};
    }
    const Index n = parts_.front().front().rows();
    MatrixXd sum = MatrixXd::Zero(n, n);
    for (const auto& [place, coefficient] : places)
      for (std::size_t i = 0; i < weights.size(); ++i) sum += coefficient * weights[i] * parts_[place][i];
    sum.diagonal().array() += sigma_square(x);
    return sum;
  }

  double value(const VectorXd& x, const Seen& seen) const {
    const Eigen::LLT<MatrixXd> factors(covariance(x));
    if (factors.info() != Eigen::Success) return -std::numeric_limits<double>::infinity();
    return -0.5 * factors.solve(seen.products).trace() -
           seen.count * factors.matrixLLT().diagonal().array().log().sum();
  }

  SecondOrder second_order(const VectorXd& x, const Seen& seen) const {
    const MatrixXd here = covariance(x);
    const Eigen::LLT<MatrixXd> factors(here);
    const Index n = x.size();
    const MatrixXd weighed = factors.solve(seen.products);
    SecondOrder found{-0.5 * weighed.trace() - seen.count * factors.matrixLLT().diagonal().array().log().sum(),
                      VectorXd(n), MatrixXd(n, n)};
    std::vector<MatrixXd> changes;  // C⁻¹ ∂C
    for (Index i = 0; i < n; ++i)
      changes.emplace_back(factors.solve((covariance(x + kSlopeStep * VectorXd::Unit(n, i)) - here) / kSlopeStep));
    const auto trace_of = [](const MatrixXd& a, const MatrixXd& b) { return a.cwiseProduct(b.transpose()).sum(); };
    for (Index i = 0; i < n; ++i) {
      found.gradient[i] = 0.5 * (trace_of(changes[at(i)], weighed) - seen.count * changes[at(i)].trace());
      for (Index j = 0; j <= i; ++j)
        found.information(i, j) = found.information(j, i) = 0.5 * seen.count * trace_of(changes[at(i)], changes[at(j)]);
    }
    return found;
  }

  // Of the greatest likelihood, from each of some starts.
  double greatest(const std::vector<VectorXd>& starts, const Seen& seen, VectorXd* place = nullptr) const {
    double best = -std::numeric_limits<double>::infinity();
    for (const VectorXd& start : starts) {
      const matching::NewtonMaximum found = matching::maximise_by_newton(
          [&](const VectorXd& x) { return value(x, seen); }, [&](const VectorXd& x) { return second_order(x, seen); },
          box_, box_.clipped(start), {.tolerance = 0.01, .longest_step = 2, .most_steps = 20, .most_halvings = 6});
      if (!(found.about.value > best)) continue;
      best = found.about.value;
      if (place != nullptr) *place = found.x;
    }
    return best;
  }

  // The numbers of a fit.
  VectorXd place(const CohortFit& fit) const {
    std::vector<double> values;
    for (const ModelNumber& number : cohort_.open()) values.push_back(value_of(fit, number.name));
    return box_.clipped(cohort_.place(values));
  }

  // Those of `none`, with noise at a level.
  VectorXd place_beside(const VectorXd& of_none, const RestModel& none, double level) const {
    VectorXd x = box_.least;
    for (Index i = 0; i < x.size(); ++i) {
      const ModelNumber& number = cohort_.open()[at(i)];
      if (number.kind == Kind::kAmplitude) x[i] = level;
      for (Index j = 0; j < of_none.size(); ++j)
        if (none.cohort_.open()[at(j)].name == number.name)
          x[i] = number.place(none.cohort_.open()[at(j)].value(of_none[j]));
    }
    return box_.clipped(x);
  }

  // What noise makes of the variance, momenta the rest.
  double noise_share(const VectorXd& x) const {
    VectorXd of_none = x;
    for (const Index i : amplitudes_) of_none[i] = box_.least[i];
    const double errors = sigma_square(x) * static_cast<double>(parts_.front().front().rows());
    const double all = covariance(x).trace() - errors;
    return all > 0 ? 1 - (covariance(of_none).trace() - errors) / all : 0;
  }

  // With noise of that share in place of some of what momenta do, in equal parts of each amplitude.
  VectorXd with_share(VectorXd x, double share) const {
    const double before = 1 - noise_share(x);
    for (Index i = 0; i < x.size(); ++i) {
      const ModelNumber& number = cohort_.open()[at(i)];
      if (number.kind == Kind::kLambda) x[i] = number.place(number.value(x[i]) * before / (1 - share));
    }
    // By bisection of one level of all amplitudes.
    double low = 0, high = 1;
    for (const Index i : amplitudes_) high = std::max(high, box_.most[i]);
    for (int cut = 0; cut < 40; ++cut) {
      const double middle = (low + high) / 2;
      for (const Index i : amplitudes_) x[i] = middle;
      (noise_share(x) < share ? low : high) = middle;
    }
    return box_.clipped(x);
  }

  bool has_amplitudes() const { return !amplitudes_.empty(); }

 private:
  static double value_of(const CohortFit& fit, const std::string& name) {
    return std::find_if(fit.fitted.begin(), fit.fitted.end(),
                        [&](const FittedNumber& number) { return number.name == name; })
        ->value;
  }

  // Coefficients of what is fixed, of the momenta and of each amplitude.
  std::vector<double> weights_of(const VectorXd& x) const {
    const posterior::Numbers numbers = cohort_.numbers(x);
    std::vector<double> weights = {1, 1 / numbers.lambda};
    for (const Index i : amplitudes_) weights.push_back(std::pow(cohort_.open()[at(i)].value(x[i]), 2));
    return weights;
  }
  double sigma_square(const VectorXd& x) const { return std::pow(cohort_.numbers(x).sigma, 2); }

  std::vector<MatrixXd> parts_at(double width) const {
    VectorXd x = box_.least;
    if (width_ >= 0) x[width_] = width;
    const Specimen& most = cohort_.fullest();
    const auto model_of = [&](double lambda, Index amplitude) {
      posterior::Numbers numbers = cohort_.numbers(x);
      numbers.lambda = lambda;
      numbers.sigma = 1;
      VectorXd theta = numbers.noise->parameters();
      for (const Index i : amplitudes_)
        theta[cohort_.open()[at(i)].parameter] = amplitude < 0 || i == amplitude ? 1 : kNoAmplitude;
      if (theta.size() > 0) numbers.noise = numbers.noise->with_parameters(theta);
      return most.model(numbers);
    };
    constexpr Index kEvery = -1;
    const Index none = cohort_.count();
    const double rest = 1 / (kNoAmplitude * kNoAmplitude);
    const auto linear = posterior::linear_at_rest(most, model_of(1, kEvery));
    const auto covariance_of = [&](double lambda, Index amplitude) -> MatrixXd {
      return linear->covariance(model_of(lambda, amplitude)).topLeftCorner(most.coordinates(), most.coordinates());
    };
    const MatrixXd fixed = covariance_of(rest, none);
    std::vector<MatrixXd> parts{fixed - MatrixXd::Identity(fixed.rows(), fixed.cols()), covariance_of(1, none) - fixed};
    for (const Index i : amplitudes_) parts.emplace_back(covariance_of(rest, i) - fixed);
    return parts;
  }

  const CohortModel& cohort_;
  Box box_;
  Index width_ = -1;
  double first_ = 0;
  std::vector<Index> amplitudes_;
  std::vector<std::vector<MatrixXd>> parts_;  // of each place of the width
};

Seen drawn_vectors(const MatrixXd& covariance, int count, std::uint64_t seed, std::uint64_t stream) {
  const Eigen::LLT<MatrixXd> factors(covariance);
  const MatrixXd normals = standard_normals(seed, kStream + stream, static_cast<int>(covariance.rows()), count);
  const MatrixXd shapes = factors.matrixL() * normals;
  return {shapes * shapes.transpose(), static_cast<double>(count)};
}

}  // namespace

std::vector<std::optional<Recognition>> find_recognitions(const Comparison& comparison,
                                                          const std::vector<NoiseChoice>& noises) {
  const auto& models = comparison.models;
  std::vector<std::optional<Recognition>> found(models.size());
  const auto of_none = std::find_if(models.begin(), models.end(), [](const auto& m) { return m.noise == "none"; });
  if (of_none == models.end() || !std::isfinite(of_none->score)) return found;
  const auto none = static_cast<std::size_t>(of_none - models.begin());
  const double width = make_kernel(of_none->fit.kernel, comparison.cohort.source.points).terms().front().alpha;
  std::vector<std::unique_ptr<CohortModel>> cohorts;
  std::vector<RestModel> rest;
  for (std::size_t m = 0; m < models.size(); ++m) {
    cohorts.push_back(std::make_unique<CohortModel>(
        comparison.cohort, make_open_noise(noises[m], comparison.cohort.source), comparison.settings));
    rest.emplace_back(*cohorts.back(), models[m].fit, width);
  }
  const VectorXd at_none = rest[none].place(of_none->fit);
  const auto shapes = static_cast<int>(comparison.cohort.targets.size());
  const int count = shapes - (comparison.cohort.about_own_mean ? 1 : 0);
  for (std::size_t truth = 0; truth < models.size(); ++truth) {
    const RestModel& drawn_from = rest[truth];
    VectorXd at_truth = drawn_from.place(models[truth].fit);
    if (drawn_from.has_amplitudes() && drawn_from.noise_share(at_truth) < kShareShown)
      at_truth = drawn_from.with_share(drawn_from.place_beside(at_none, rest[none], 0), kShareAsked);
    const MatrixXd covariance = drawn_from.covariance(at_truth);
    std::vector<char> recognised(kCohorts);
    parallel_for(kCohorts, [&](int cohort) {
      const Seen seen =
          drawn_vectors(covariance, count, comparison.settings.seed,
                        static_cast<std::uint64_t>(truth) * kCohorts + static_cast<std::uint64_t>(cohort));
      VectorXd place = at_none;
      const double of_geodesic = rest[none].greatest({at_none}, seen, &place);
      std::size_t best = none;
      double greatest = of_geodesic + kDecisive;  // a noise has to be above that
      for (std::size_t m = 0; m < models.size(); ++m) {
        if (m == none || !std::isfinite(models[m].score)) continue;
        std::vector<VectorXd> starts{rest[m].place_beside(place, rest[none], kNoiseLevel)};
        if (m == truth) starts.push_back(at_truth);
        const double more = 0.5 * std::log(static_cast<double>(shapes)) *
                            static_cast<double>(rest[m].cohort().count() - rest[none].cohort().count());
        if (const double score = rest[m].greatest(starts, seen) - more; score > greatest) {
          greatest = score;
          best = m;
        }
      }
      recognised[static_cast<std::size_t>(cohort)] = best == truth ? 1 : 0;
    });
    found[truth] =
        Recognition{drawn_from.noise_share(at_truth),
                    static_cast<double>(std::count(recognised.begin(), recognised.end(), 1)) / kCohorts, kCohorts};
  }
  return found;
}

}  // namespace pulson::compare
