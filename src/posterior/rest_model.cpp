#include "rest_model.hpp"

#include <utility>
#include <vector>

#include "matching/displacement_likelihood.hpp"

namespace pulson::posterior {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Of derivatives, beside their largest: what rounding leaves where they are the same.
constexpr double kSameToRounding = 1e-12;

bool are_same(const MatrixXd& a, const MatrixXd& b) {
  return (a - b).cwiseAbs().maxCoeff() <= kSameToRounding * b.cwiseAbs().maxCoeff();
}

// ∂q(T)/∂p0 at rest: T K(q0), for each axis.
MatrixXd by_momenta_at_rest(const Specimen& specimen, const KernelOperator& kernel) {
  const matching::MatchingProblem& problem = specimen.problem();
  return problem.grid.time * matching::on_each_axis(kernel.gram(problem.source, problem.source), problem.source.rows());
}

// With another kernel in place of that of the model.
Specimen::Model with_narrower_kernel(const Specimen::Model& model) {
  std::vector<KernelTerm> terms = model.system.kernel.terms();
  for (KernelTerm& term : terms) term.alpha /= 2;
  Specimen::Model narrower = model;
  narrower.system.kernel = KernelOperator(std::move(terms));
  return narrower;
}

// The numbers of a noise, amplitudes as 0.
VectorXd lengths(const NoiseModel& noise, const Points& source) {
  VectorXd numbers = noise.parameters();
  for (const NoiseAmplitude& amplitude :
       noise.amplitudes(static_cast<int>(source.rows()), static_cast<int>(source.cols())))
    numbers[amplitude.parameter] = 0;
  return numbers;
}

}  // namespace

RestModel::RestModel(Specimen specimen, const Specimen::Model& model)
    : specimen_(std::make_shared<const Specimen>(std::move(specimen))) {
  const VectorXd rest = VectorXd::Zero(specimen_->unknowns());
  const Specimen::Model narrower = with_narrower_kernel(model);
  const auto shot = specimen_->shoot(model, rest), other_shot = specimen_->shoot(narrower, rest);
  if (!shot || !other_shot || shot->paths.size() != 1) return;
  if (shot->paths.front().final().q != specimen_->problem().source) return;
  Specimen::Slopes slopes = specimen_->slopes(model, *shot);
  const Specimen::Slopes other = specimen_->slopes(narrower, *other_shot);
  if (slopes.branches.front().end.size() > 0 && !are_same(slopes.branches.front().end, other.branches.front().end))
    return;
  if (!are_same(slopes.momenta, by_momenta_at_rest(*specimen_, model.system.kernel)) ||
      !are_same(other.momenta, by_momenta_at_rest(*specimen_, narrower.system.kernel)))
    return;
  lengths_ = lengths(*model.system.noise, specimen_->problem().source);
  of_any_kernel_ = std::make_shared<const LinearModel>(*specimen_, model, std::move(slopes), shot->residual, rest);
}

std::shared_ptr<const LinearModel> RestModel::at(const Specimen::Model& model) const {
  if (of_any_kernel_ == nullptr || lengths(*model.system.noise, specimen_->problem().source) != lengths_)
    return linear_at_rest(*specimen_, model);
  return std::make_shared<const LinearModel>(*of_any_kernel_, model,
                                             by_momenta_at_rest(*specimen_, model.system.kernel));
}

}  // namespace pulson::posterior
