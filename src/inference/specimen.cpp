#include "specimen.hpp"

#include <algorithm>
#include <cmath>

#include "core/factorisations.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/matching/data_term.hpp"

namespace pulson::inference {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// See PosteriorProblem; and of K(0), for rounding.
constexpr double kSeen = 1e-3;
constexpr double kSingular = 1e-12;

bool same_kernel(const KernelOperator& a, const KernelOperator& b) {
  return std::equal(a.terms().begin(), a.terms().end(), b.terms().begin(), b.terms().end(),
                    [](const KernelTerm& s, const KernelTerm& t) {
                      return s.profile == t.profile && s.alpha == t.alpha && s.weight == t.weight;
                    });
}

}  // namespace

Specimen::Specimen(matching::MatchingProblem problem)
    : problem_(std::move(problem)),
      channels_(problem_.system.noise->channels(static_cast<int>(problem_.source.rows()),
                                                static_cast<int>(problem_.source.cols()))),
      count_(problem_.data->residual(problem_.source).size()),
      nugget_(std::max(kSeen * problem_.lambda * std::pow(problem_.sigma / problem_.grid.time, 2),
                       kSingular * problem_.system.kernel.at_zero())),
      log_determinant_(problem_.data->log_determinant()),
      reference_root_(std::make_shared<MatrixXd>(root_of(problem_.system.kernel))) {
  check(problem_);
  matching::require_distinct(problem_.source);
}

MatrixXd Specimen::root_of(const KernelOperator& kernel) const {
  MatrixXd gram = kernel.gram(problem_.source, problem_.source);
  gram.diagonal().array() += nugget_;
  const Eigen::LLT<MatrixXd> factors(gram);
  if (factors.info() != Eigen::Success) throw NumericalError("the matrix of the kernel is singular");
  return factors.matrixL();
}

Specimen::Model Specimen::model(const ModelNumbers& numbers) const {
  const bool is_reference = same_kernel(*numbers.kernel, problem_.system.kernel);
  return {{*numbers.kernel, numbers.noise},
          numbers.lambda,
          numbers.sigma,
          is_reference ? reference_root_ : std::make_shared<const MatrixXd>(root_of(*numbers.kernel))};
}

Points Specimen::momenta(const Model& model, const VectorXd& z) const {
  const Index d = problem_.source.rows(), n = problem_.source.cols();
  const MatrixXd z0 = z.head(d * n).reshaped(d, n);
  return model.root->triangularView<Eigen::Lower>().solve<Eigen::OnTheRight>(z0) / std::sqrt(model.lambda);
}

MatrixXd Specimen::increments(const VectorXd& z) const {
  return std::sqrt(problem_.grid.dt()) *
         z.tail(channels_ * problem_.grid.steps).reshaped(channels_, problem_.grid.steps);
}

VectorXd Specimen::white(const Model& model, const Points& momenta, const MatrixXd& increments) const {
  VectorXd z(unknowns());
  z.head(momenta.size()) = (std::sqrt(model.lambda) * momenta * model.root->triangularView<Eigen::Lower>()).reshaped();
  z.tail(increments.size()) = increments.reshaped() / std::sqrt(problem_.grid.dt());
  return z;
}

std::optional<Trajectory> Specimen::path(const Model& model, const VectorXd& z) const {
  try {
    return problem_.integrator->integrate(model.system, {problem_.source, momenta(model, z)}, problem_.grid,
                                          increments(z), RootSearch::kContracting);
  } catch (const StepError&) {
    return std::nullopt;
  }
}

std::optional<Specimen::Shot> Specimen::shoot(const Model& model, const VectorXd& z) const {
  std::optional<Trajectory> found = path(model, z);
  if (!found) return std::nullopt;
  Shot shot{std::move(*found), {}, 0};
  shot.residual = problem_.data->residual(shot.path.final().q) / model.sigma;
  shot.log_likelihood = -0.5 * shot.residual.squaredNorm() - log_volume(model);
  if (!std::isfinite(shot.log_likelihood)) return std::nullopt;
  return shot;
}

double Specimen::log_volume(const Model& model) const {
  return 0.5 * log_determinant_ + static_cast<double>(count_) * std::log(model.sigma);
}

VectorXd Specimen::misfit_gradient(const Model& model, const Shot& shot) const {
  const Points& q = shot.path.final().q;
  const PathGradient bar = problem_.integrator->adjoint(model.system, shot.path,
                                                        {problem_.data->gradient(q), Points::Zero(q.rows(), q.cols())});
  VectorXd gradient(unknowns());
  const MatrixXd by_momenta =
      model.root->triangularView<Eigen::Lower>().solve(MatrixXd(bar.p0_bar.transpose())).transpose();
  gradient.head(q.size()) = by_momenta.reshaped() / std::sqrt(model.lambda);
  gradient.tail(channels_ * problem_.grid.steps) = std::sqrt(problem_.grid.dt()) * bar.increments_bar.reshaped();
  return gradient / (model.sigma * model.sigma);
}

}  // namespace pulson::inference
