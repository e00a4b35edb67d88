#include "pulson/inference/fit_parameters.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "combinations.hpp"
#include "error_of.hpp"
#include "matching/registration_problem.hpp"
#include "plain_options.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/matching/data_term.hpp"
#include "pulson/matching/objective.hpp"
#include "random/normals.hpp"
#include "shape.hpp"

namespace pulson::inference {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

matching::RegistrationOptions options_of(std::string noise, double sigma, double lambda) {
  matching::RegistrationOptions options = plain_options();
  options.kernel = "gaussian:alpha=0.9";
  options.noise = std::move(noise);
  options.integrator = "variational";
  options.grid = {1, 5};
  options.sigma = sigma;
  options.lambda = lambda;
  return options;
}

// The abscissa of the maximum of f near x, by a fine scan and a parabola through the three highest values.
template <class F>
double scanned_maximum(const F& f, double low, double high, int count) {
  const double step = (high - low) / count;
  std::vector<double> values;
  for (int i = 0; i <= count; ++i) values.push_back(f(low + step * i));
  const auto top = std::max_element(values.begin() + 1, values.end() - 1);
  const double bend = top[-1] - 2 * top[0] + top[1];
  return low + step * (static_cast<double>(top - values.begin()) - 0.5 * (top[1] - top[-1]) / bend);
}

// Landmarks that move so little that the density of the targets is a Gaussian in closed form, see laplace_test.cpp.
struct GaussianTargets {
  static constexpr double kSmall = 1e-4;
  static constexpr double kLambda = 1 / (kSmall * kSmall);

  GaussianTargets() {
    Numbers numbers(21);
    source = shape(numbers.landmarks(2, 4));
    for (int t = 0; t < 3; ++t) targets.push_back(shape(source.points + 3 * kSmall * numbers(2, 4)));
    options = options_of("ch-sd:beta=0.0001", 0.3 * kSmall, kLambda);
  }

  double log_density(double beta) const {
    const MatrixXd kernel = options.kernel.make(source.points).gram(source.points, source.points);
    const double variance =
        beta * beta * options.grid.dt() * (options.grid.steps - 0.75) + std::pow(options.sigma.in(0), 2);
    const MatrixXd covariance = kernel / kLambda + variance * MatrixXd::Identity(4, 4);
    const double log_determinant = std::log((2 * std::numbers::pi * covariance).fullPivLu().determinant());
    double sum = 0;
    for (const Landmarks& target : targets) {
      const MatrixXd x = target.points - source.points;
      sum -= 0.5 * ((x * covariance.inverse()).cwiseProduct(x).sum() + 2 * log_determinant);
    }
    return sum;
  }

  Landmarks source;
  std::vector<Landmarks> targets;
  matching::RegistrationOptions options = plain_options();
};

TEST(FitParameters, FindsTheMaximumOfADensityInClosedForm) {
  const GaussianTargets limit;
  const auto density = [&](double log_beta) { return limit.log_density(std::exp(log_beta)); };
  const double best = scanned_maximum(density, std::log(2e-5), std::log(5e-4), 2000);
  ASSERT_GT(best, std::log(3e-5));
  ASSERT_LT(best, std::log(4e-4));
  const FittedParameters fitted =
      fit_parameters(limit.source, limit.targets, limit.options, {.names = {"beta"}, .tolerance = 1e-4});
  EXPECT_TRUE(fitted.converged);
  EXPECT_THAT(fitted.note, IsEmpty());
  EXPECT_NEAR(std::log(fitted.values[0]), best, 1e-3);
  EXPECT_NEAR(fitted.log_evidence, density(best), 0.01);
  constexpr double kStep = 1e-3;
  const double curvature = (2 * density(best) - density(best + kStep) - density(best - kStep)) / (kStep * kStep);
  EXPECT_NEAR(fitted.log_deviations[0] * std::sqrt(curvature), 1, 0.01);
  EXPECT_EQ(fitted.noise, make_noise(fitted.noise)->spec());
  EXPECT_EQ(make_noise(fitted.noise)->parameters()[0], fitted.values[0]);
}

TEST(FitParameters, FindsTheMaximumThatAScanFinds) {
  Numbers numbers(22);
  const Landmarks source = shape(numbers.landmarks(2, 5));
  const Points target = source.points + 0.3 * numbers(2, 5);
  matching::RegistrationOptions options = options_of("none", 0.02, 0.7);
  options.kernel = "gaussian:alpha=auto";
  options.integrator = "variational-2";  // wide kernels need more than five steps of the first order
  const auto evidence = [&](double log_alpha) {
    const matching::MatchingObjective objective(
        {{make_kernel("gaussian:alpha=" + std::to_string(std::exp(log_alpha)), source.points), make_noise("none")},
         make_integrator(options.integrator),
         options.grid,
         source.points,
         std::make_shared<matching::LandmarkTerm>(matching::LandmarkObservations{target, options.sigma.in(0)}),
         options.sigma.in(0),
         0.7});
    matching::MinimiseOptions minimise_options;
    minimise_options.gradient_tolerance = 1e-5;
    return log_evidence(objective, minimise(objective, minimise_options).solution);
  };
  const double start = std::log(automatic_alpha(source.points));
  const double best = scanned_maximum(evidence, start - 1.5, start + 1.5, 150);
  ASSERT_LT(std::abs(best - start), 1.4);
  ASSERT_GT(std::abs(best - start), 0.01);
  const FittedParameters fitted = fit_parameters(source, {shape(target)}, options, {.names = {"alpha"}});
  EXPECT_TRUE(fitted.converged);
  EXPECT_NEAR(std::log(fitted.values[0]), best, 3e-3);
  EXPECT_NEAR(fitted.log_evidence, evidence(std::log(fitted.values[0])), 1e-4);
  EXPECT_EQ(fitted.kernel, KernelOperator({{KernelProfile::kGaussian, fitted.values[0], 1}}).spec());
  EXPECT_EQ(fitted.sigma, 0.02);
  EXPECT_EQ(fitted.lambda, 0.7);
}

// Targets from the model itself: p0 ~ N(0, (λK)⁻¹), ΔW ~ N(0, Δt), y ~ N(q(T), σ²).
std::vector<Landmarks> drawn_targets(const Landmarks& source, const matching::RegistrationOptions& options, int count) {
  const StochasticSystem system{options.kernel.make(source.points), options.noise.make(source)};
  const MatrixXd precision = options.lambda.value() * system.kernel.gram(source.points, source.points);
  const MatrixXd root = precision.llt().matrixL();
  const int d = source.dimension(), n = source.count(), steps = options.grid.steps;
  std::vector<Landmarks> targets;
  for (int t = 0; t < count; ++t) {
    const MatrixXd normals = standard_normals(31, static_cast<std::uint64_t>(t), d * n, steps + 2);
    const Points p0 = normals.col(steps).reshaped(d, n) * root.inverse();
    const MatrixXd increments = std::sqrt(options.grid.dt()) * normals.leftCols(steps);
    const Trajectory path =
        make_integrator(options.integrator)->integrate(system, {source.points, p0}, options.grid, increments);
    targets.push_back(shape(path.final().q + options.sigma.in(0) * normals.col(steps + 1).reshaped(d, n)));
  }
  return targets;
}

// √(1/I) of log β of the model with its flow taken as linear: I = ½ Σ tr(Σ⁻¹ ∂Σ/∂log β)² over targets and axes.
double expected_deviation(const Landmarks& source, const matching::RegistrationOptions& options, double beta,
                          int count) {
  const MatrixXd kernel = options.kernel.make(source.points).gram(source.points, source.points);
  const double of_noise = beta * beta * options.grid.dt() * (options.grid.steps - 0.75);
  const MatrixXd one = MatrixXd::Identity(source.count(), source.count());
  const MatrixXd covariance =
      kernel / options.lambda.value() + (of_noise + options.sigma.in(0) * options.sigma.in(0)) * one;
  const MatrixXd change = 2 * of_noise * covariance.inverse();
  return 1 / std::sqrt(0.5 * count * source.dimension() * (change * change).trace());
}

TEST(FitParameters, FindsTheModelThatTargetsWereDrawnFrom) {
  constexpr int kTargets = 20;
  constexpr double kTrueLambda = 60, kTrueBeta = 0.1, kTrueSigma = 0.02;
  const Landmarks source = shape(Numbers(23).landmarks(2, 6));
  const matching::RegistrationOptions truth = options_of("ch-sd:beta=0.1", kTrueSigma, kTrueLambda);
  const std::vector<Landmarks> targets = drawn_targets(source, truth, kTargets);
  const FittedParameters one =
      fit_parameters(source, targets, options_of("ch-sd:beta=0.3", kTrueSigma, kTrueLambda), {.names = {"beta"}});
  EXPECT_TRUE(one.converged) << one.note;
  EXPECT_LE(std::abs(std::log(one.values[0] / kTrueBeta)), 3 * one.log_deviations[0]);
  EXPECT_NEAR(one.log_deviations[0] / expected_deviation(source, truth, kTrueBeta, kTargets), 1, 0.3);

  const FittedParameters both =
      fit_parameters(source, targets, options_of("ch-sd:beta=0.3", kTrueSigma, 20), {.names = {"lambda", "beta"}});
  EXPECT_TRUE(both.converged) << both.note;
  EXPECT_THAT(both.names, ElementsAre("lambda", "beta"));
  EXPECT_EQ(both.lambda, both.values[0]);
  EXPECT_GT(both.log_evidence, one.log_evidence);
  EXPECT_LE(std::abs(std::log(both.values[0] / kTrueLambda)), 3 * both.log_deviations[0]);
  EXPECT_LE(std::abs(std::log(both.values[1] / kTrueBeta)), 3 * both.log_deviations[1]);
  EXPECT_LT(both.evaluations, 100);
}

struct Small {
  Small() {
    Numbers numbers(24);
    source = shape(numbers.landmarks(2, 3));
    target = shape(source.points + 0.2 * numbers(2, 3));
  }
  FittedParameters fit(const matching::RegistrationOptions& options, std::vector<std::string> names,
                       int evaluations = 4) const {
    return fit_parameters(source, {target}, options, {.names = std::move(names), .max_evaluations = evaluations});
  }
  std::string error(const matching::RegistrationOptions& options, std::vector<std::string> names) const {
    return error_of([&] { fit(options, std::move(names)); });
  }
  Landmarks source, target;
};

TEST(FitParameters, ANameInSeveralTermsIsACommonFactor) {
  const matching::RegistrationOptions options = options_of("ch-sd:beta=0.1,on=1/2+ch-sd:beta=0.25,on=3", 0.05, 1);
  const FittedParameters common = Small().fit(options, {"beta"});
  const VectorXd betas = make_noise(common.noise)->parameters();
  EXPECT_EQ(common.values[0], betas[0]);
  EXPECT_NE(betas[0], 0.1);
  EXPECT_DOUBLE_EQ(betas[1], 2.5 * betas[0]);
  EXPECT_THAT(common.noise, AllOf(HasSubstr(",on=1/2+"), HasSubstr(",on=3")));

  const FittedParameters second = Small().fit(options, {"ch-sd#2.beta"});
  EXPECT_EQ(make_noise(second.noise)->parameters()[0], 0.1);
  EXPECT_EQ(make_noise(second.noise)->parameters()[1], second.values[0]);
  EXPECT_NE(second.values[0], 0.25);
}

TEST(FitParameters, KernelsOfSeveralTermsKeepTheirRatios) {
  matching::RegistrationOptions options = options_of("none", 0.05, 1);
  options.kernel = "gaussian:alpha=0.8+matern32:alpha=0.4,weight=0.5";
  const std::vector<KernelTerm> common =
      make_kernel(Small().fit(options, {"alpha"}).kernel, Small().source.points).terms();
  EXPECT_NE(common[0].alpha, 0.8);
  EXPECT_DOUBLE_EQ(common[0].alpha, 2 * common[1].alpha);
  EXPECT_EQ(common[1].weight, 0.5);
  const std::vector<KernelTerm> one =
      make_kernel(Small().fit(options, {"matern32.weight"}).kernel, Small().source.points).terms();
  EXPECT_EQ(one[0].weight, 1);
  EXPECT_NE(one[1].weight, 0.5);
  EXPECT_EQ(one[1].alpha, 0.4);
}

// trouve-vialard calls its amplitude sigma.
TEST(FitParameters, TheDeviationOfTheDataIsNotThatOfTheNoise) {
  const matching::RegistrationOptions options = options_of("trouve-vialard:sigma=0.5", 0.05, 1);
  const FittedParameters of_noise = Small().fit(options, {"sigma"});
  EXPECT_EQ(of_noise.sigma, 0.05);
  EXPECT_EQ(make_noise(of_noise.noise)->parameters()[0], of_noise.values[0]);
  const FittedParameters of_data = Small().fit(options, {"data-sigma"});
  EXPECT_EQ(of_data.noise, "trouve-vialard:sigma=0.5");
  EXPECT_EQ(of_data.sigma, of_data.values[0]);
  EXPECT_NE(of_data.sigma, 0.05);
}

TEST(FitParameters, SaysWhenTheMaximumIsAtTheEndOfTheSearch) {
  const Small small;
  const FittedParameters fitted =
      fit_parameters(small.source, {small.source}, options_of("none", 0.01, 1), {.names = {"lambda"}});
  EXPECT_NEAR(fitted.values[0], 100, 1e-9);
  EXPECT_THAT(fitted.note, HasSubstr("lambda is at the limit of the search range, 100 times larger than initially"));
  EXPECT_TRUE(std::isnan(fitted.log_deviations[0]));
}

TEST(FitParameters, SaysWhenItStoppedEarly) {
  const FittedParameters fitted = Small().fit(options_of("ch-sd:beta=0.3", 0.05, 1), {"beta"}, 3);
  EXPECT_FALSE(fitted.converged);
  EXPECT_THAT(fitted.note, HasSubstr("before its tolerance was reached"));
}

TEST(FitParameters, SaysWhenParametersCannotBeToldApart) {
  const FittedParameters fitted = Small().fit(options_of("none", 0.05, 1), {"weight", "lambda"}, 60);
  EXPECT_TRUE(fitted.log_deviations.array().isNaN().all() || fitted.log_deviations.minCoeff() > 3)
      << fitted.log_deviations;
}

TEST(FitParameters, ReportsEachEvaluationAndIsTheSameForAnyNumberOfThreads) {
  const GaussianTargets limit;
  std::vector<FittedParameters> fits;
  for (const int threads : {1, 3}) {
    set_thread_count(threads);
    int last = 0;
    FitOptions fit{.names = {"beta"}};
    fit.on_evaluation = [&](int evaluation, const VectorXd& values, double evidence) {
      EXPECT_EQ(evaluation, ++last);
      EXPECT_EQ(values.size(), 1);
      EXPECT_TRUE(std::isfinite(evidence));
    };
    fits.push_back(fit_parameters(limit.source, limit.targets, limit.options, fit));
    EXPECT_EQ(last, fits.back().evaluations);
  }
  set_thread_count(0);
  EXPECT_EQ(fits[0].values, fits[1].values);
  EXPECT_EQ(fits[0].log_evidence, fits[1].log_evidence);
  EXPECT_EQ(fits[0].log_deviations, fits[1].log_deviations);
}

TEST(FitParameters, PassesOnWhatACallbackThrows) {
  const Small small;
  FitOptions fit{.names = {"beta"}};
  fit.on_evaluation = [](int evaluation, const VectorXd&, double) {
    if (evaluation == 3) throw std::domain_error("enough");
  };
  EXPECT_THROW(fit_parameters(small.source, {small.target}, options_of("ch-sd:beta=0.3", 0.05, 1), fit),
               std::domain_error);
}

// Automatic choices are those for the source when aligned with the first target, and then the same for all.
TEST(FitParameters, AutomaticChoicesBecomeNumbers) {
  const Small small;
  matching::RegistrationOptions options = options_of("none", 0.05, 1);
  options.kernel = "gaussian:alpha=auto";
  options.lambda.reset();
  options.align = AlignmentKind::kSimilarity;
  const Landmarks large = shape(3 * small.target.points);
  const matching::Registration first = register_shapes(small.source, large, options);
  const FittedParameters fitted =
      fit_parameters(small.source, {large, small.target}, options, {.names = {"data-sigma"}, .max_evaluations = 1});
  EXPECT_EQ(fitted.kernel, first.kernel);
  EXPECT_EQ(fitted.lambda, first.lambda);
}

TEST(RegistrationProblem, IsWhatRegistrationMinimises) {
  const Small small;
  for (const char* noise : {"none", "ch-sd:beta=0.3"}) {
    matching::RegistrationOptions options = options_of(noise, 0.05, 1);
    options.kernel = "gaussian:alpha=auto";
    options.lambda.reset();
    options.align = AlignmentKind::kSimilarity;
    const Landmarks target = shape(3 * small.target.points);
    const matching::Registration fit = register_shapes(small.source, target, options);
    const matching::RegistrationProblem problem = make_problem(small.source, target, options);
    const matching::MatchingObjective::Evaluation at =
        minimise(matching::MatchingObjective(problem.matching), options.minimise).solution;
    EXPECT_EQ(at.cost.total(), fit.cost.total());
    EXPECT_EQ(at.path().final().q, fit.result);
    EXPECT_EQ(problem.mode, fit.mode);
    EXPECT_EQ(problem.source.points, fit.source.points);
    EXPECT_EQ(problem.alignment.scale, fit.alignment.scale);
  }
}

TEST(FitParameters, RefusesWhatItCannotFit) {
  const Small small;
  const matching::RegistrationOptions noisy = options_of("ch-sd:beta=0.3", 0.05, 1);
  EXPECT_EQ(small.error(noisy, {"gamma"}),
            "'gamma' is not a parameter of these models; valid: alpha, weight, beta, data-sigma, lambda");
  EXPECT_THAT(small.error(noisy, {"betta"}), HasSubstr("did you mean 'beta'"));
  EXPECT_THAT(small.error(noisy, {"sigma"}), HasSubstr("'sigma' is not a parameter"));
  EXPECT_THAT(small.error(options_of("none", 0.05, 1), {"beta"}),
              HasSubstr("valid: alpha, weight, data-sigma, lambda"));
  matching::RegistrationOptions quiet = noisy;
  quiet.mode = matching::MatchingMode::kDeterministic;
  EXPECT_THAT(small.error(quiet, {"beta"}), HasSubstr("'beta' is not a parameter"));
  EXPECT_THAT(small.error(options_of("ch-sd:beta=1+p-sd:beta=0.2", 0.05, 1), {"gamma"}),
              HasSubstr("valid: alpha, weight, beta, ch-sd.beta, p-sd.beta, data-sigma, lambda"));
  EXPECT_EQ(small.error(noisy, {"beta", "beta"}), "'beta' is to be fitted twice");
  matching::RegistrationOptions covariant = noisy;
  covariant.data.covariances.assign(3, 0.01 * MatrixXd::Identity(2, 2));
  EXPECT_THAT(small.error(covariant, {"data-sigma"}), HasSubstr("sigma has no effect beside them"));
  matching::RegistrationOptions frozen = noisy;
  frozen.mode = matching::MatchingMode::kPathwise;
  EXPECT_THAT(small.error(frozen, {"beta"}), HasSubstr("mode pathwise holds what it does; take mode map"));
  EXPECT_EQ(small.error(options_of("ch-sd:beta=1+p-sd:beta=0.2", 0.05, 1), {"beta", "p-sd.beta"}),
            "'p-sd.beta' is to be fitted twice");
  EXPECT_THAT(small.error(options_of("langevin:sigma=1,friction=0", 0.05, 1), {"friction"}),
              HasSubstr("'friction' is 0; what is fitted"));
  EXPECT_EQ(small.error(noisy, {}), "no parameter is named to be fitted");
  EXPECT_EQ(error_of([&] { fit_parameters(small.source, {}, noisy, {.names = {"beta"}}); }),
            "there is no target to fit parameters to");
  EXPECT_THAT(
      error_of([&] { fit_parameters(small.source, {small.target}, noisy, {.names = {"beta"}, .tolerance = 0}); }),
      HasSubstr("the tolerance of the fit is 0"));
  EXPECT_THAT(error_of([&] { fit_parameters(small.source, {shape(Points::Zero(2, 4))}, noisy, {.names = {"beta"}}); }),
              HasSubstr("different numbers of landmarks"));
}

}  // namespace
}  // namespace pulson::inference
