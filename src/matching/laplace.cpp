#include <limits>

#include "matching/momentum_basis.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/matching/data_term.hpp"
#include "pulson/matching/objective.hpp"
#include "quadratic_model.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

double evidence(const LandmarkTerm& data, const MatchingObjective::Evaluation& minimum,
                const MatchingObjective::Linearisation& linear, const QuadraticModel& model) {
  const VectorXd gradient = minimum.z + linear.jacobian.transpose() * linear.residual;
  const double to_gain = 0.5 * gradient.dot(model.solve(gradient));
  return to_gain - minimum.cost.total() - 0.5 * model.log_determinant() - 0.5 * data.log_determinant();
}

// K(q0) times each column of momenta, dN×M.
MatrixXd velocities(const MatchingProblem& problem, const MatrixXd& momenta) {
  const MatrixXd gram = problem.system.kernel.gram(problem.source, problem.source);
  MatrixXd fields(momenta.rows(), momenta.cols());
  for (Index i = 0; i < momenta.cols(); ++i)
    fields.col(i) = (momenta.col(i).reshaped(problem.source.rows(), problem.source.cols()) * gram).reshaped();
  return fields;
}

// ∂/∂z of the mean of the end points, dN×U.
MatrixXd mean_endpoint_changes(const MatchingObjective& objective, const MatchingObjective::Evaluation& at) {
  MatrixXd sum = objective.endpoint_changes(at.path());
  for (std::size_t s = 1; s < at.paths.size(); ++s) sum += objective.endpoint_changes(at.paths[s]);
  return sum / static_cast<double>(at.paths.size());
}

// √diag(A B⁻¹ Aᵀ) as d×N. @param changes A, dN×M: by the first M unknowns, the others change nothing
Points deviations(const QuadraticModel& model, const MatrixXd& changes, Index unknowns, Index dimension) {
  MatrixXd transposed = MatrixXd::Zero(unknowns, changes.rows());
  transposed.topRows(changes.cols()) = changes.transpose();
  return model.variances(transposed).cwiseSqrt().reshaped(dimension, changes.rows() / dimension);
}

}  // namespace

LaplaceApproximation laplace(const MatchingObjective& objective, const MatchingObjective::Evaluation& minimum) {
  const SerialBlas serial;
  const MatchingProblem& problem = objective.problem();
  const Index d = problem.source.rows();
  const Index unknowns = objective.unknowns();
  const MatchingObjective::Linearisation linear = objective.linearise(minimum);
  const VectorXd frequency = objective.frequency();
  const QuadraticModel model(linear, frequency);
  const MatrixXd momenta = objective.basis().changes();
  const LandmarkTerm* data = problem.data->landmarks();
  return {deviations(model, momenta, unknowns, d), deviations(model, velocities(problem, momenta), unknowns, d),
          deviations(model, mean_endpoint_changes(objective, minimum), unknowns, d),
          data != nullptr ? evidence(*data, minimum, linear, model) : std::numeric_limits<double>::quiet_NaN()};
}

double log_evidence(const MatchingObjective& objective, const MatchingObjective::Evaluation& minimum) {
  const SerialBlas serial;
  const LandmarkTerm* data = objective.problem().data->landmarks();
  if (data == nullptr)
    throw InputError(
        "the evidence needs landmarks as data: the cost of a curve is not the logarithm of a normalised density");
  const MatchingObjective::Linearisation linear = objective.linearise(minimum);
  const VectorXd frequency = objective.frequency();
  return evidence(*data, minimum, linear, QuadraticModel(linear, frequency));
}

}  // namespace pulson::matching
