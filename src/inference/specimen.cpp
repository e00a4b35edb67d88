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

Specimen::Specimen(matching::MatchingProblem problem, std::vector<Branch> tree)
    : problem_(std::move(problem)),
      branches_(std::move(tree)),
      momenta_(branches_.empty() ? problem_.source.size() : 0),
      channels_(problem_.system.noise->channels(static_cast<int>(problem_.source.rows()),
                                                static_cast<int>(problem_.source.cols()))),
      nugget_(std::max(kSeen * problem_.lambda * std::pow(problem_.sigma / problem_.grid.time, 2),
                       kSingular * problem_.system.kernel.at_zero())),
      reference_root_(std::make_shared<MatrixXd>(root_of(problem_.system.kernel))) {
  check(problem_);
  matching::require_distinct(problem_.source);
  if (branches_.empty()) branches_.push_back({"", -1, problem_.grid, problem_.data});
  for (const Branch& branch : branches_) {
    const Index of_branch = channels_ * branch.grid.steps;
    places_.push_back({momenta_ + channels_ * steps_, of_branch, count_, 0});
    steps_ += branch.grid.steps;
    if (!branch.data) continue;
    const Index data = branch.data->residual(problem_.source).size();
    count_ += data;
    log_determinant_ += branch.data->log_determinant();
    for (auto b = static_cast<int>(places_.size()) - 1; b >= 0; b = branches_[static_cast<std::size_t>(b)].parent)
      places_[static_cast<std::size_t>(b)].data += data;
  }
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
  if (momenta_ == 0) return Points::Zero(d, n);
  const MatrixXd z0 = z.head(d * n).reshaped(d, n);
  return model.root->triangularView<Eigen::Lower>().solve<Eigen::OnTheRight>(z0) / std::sqrt(model.lambda);
}

MatrixXd Specimen::increments(std::size_t branch, const VectorXd& z) const {
  const TimeGrid& grid = branches_[branch].grid;
  const Place& place = places_[branch];
  return std::sqrt(grid.dt()) * z.segment(place.first_unknown, place.unknowns).reshaped(channels_, grid.steps);
}

VectorXd Specimen::white(const Model& model, const Points& momenta, const MatrixXd& increments) const {
  VectorXd z(unknowns());
  z.head(momenta.size()) = (std::sqrt(model.lambda) * momenta * model.root->triangularView<Eigen::Lower>()).reshaped();
  z.tail(increments.size()) = increments.reshaped() / std::sqrt(problem_.grid.dt());
  return z;
}

std::optional<std::vector<Trajectory>> Specimen::paths(const Model& model, const VectorXd& z) const {
  std::vector<Trajectory> paths;
  try {
    const PhaseState start{problem_.source, momenta(model, z)};
    for (std::size_t b = 0; b < branches_.size(); ++b) {
      const int parent = branches_[b].parent;
      const PhaseState& begin = parent < 0 ? start : paths[static_cast<std::size_t>(parent)].final();
      paths.push_back(problem_.integrator->integrate(model.system, begin, branches_[b].grid, increments(b, z),
                                                     RootSearch::kContracting));
    }
  } catch (const StepError&) {
    return std::nullopt;
  }
  return paths;
}

VectorXd Specimen::residual(const std::vector<Trajectory>& paths) const {
  VectorXd residual(count_);
  Index first = 0;
  for (std::size_t b = 0; b < branches_.size(); ++b) {
    if (!branches_[b].data) continue;
    const VectorXd own = branches_[b].data->residual(paths[b].final().q);
    residual.segment(first, own.size()) = own;
    first += own.size();
  }
  return residual;
}

std::optional<Specimen::Shot> Specimen::shoot(const Model& model, const VectorXd& z) const {
  std::optional<std::vector<Trajectory>> found = paths(model, z);
  if (!found) return std::nullopt;
  Shot shot{std::move(*found), {}, 0};
  shot.residual = residual(shot.paths) / model.sigma;
  shot.log_likelihood = -0.5 * shot.residual.squaredNorm() - log_volume(model);
  if (!std::isfinite(shot.log_likelihood)) return std::nullopt;
  return shot;
}

double Specimen::log_volume(const Model& model) const {
  return 0.5 * log_determinant_ + static_cast<double>(count_) * std::log(model.sigma);
}

// Backwards through the branches: what depends on the end of one are its own data and the starts of its children.
VectorXd Specimen::misfit_gradient(const Model& model, const Shot& shot) const {
  const Points zero = Points::Zero(problem_.source.rows(), problem_.source.cols());
  VectorXd gradient(unknowns());
  std::vector<PhaseState> bars(branches_.size(), PhaseState{zero, zero});
  for (std::size_t b = branches_.size(); b-- > 0;) {
    const Branch& branch = branches_[b];
    if (branch.data) bars[b].q += branch.data->gradient(shot.paths[b].final().q);
    const PathGradient bar = problem_.integrator->adjoint(model.system, shot.paths[b], bars[b], false);
    gradient.segment(places_[b].first_unknown, places_[b].unknowns) =
        std::sqrt(branch.grid.dt()) * bar.increments_bar.reshaped();
    if (branch.parent >= 0) {
      PhaseState& of_parent = bars[static_cast<std::size_t>(branch.parent)];
      of_parent.q += bar.q0_bar;
      of_parent.p += bar.p0_bar;
    } else if (momenta_ > 0) {
      const MatrixXd by_momenta =
          model.root->triangularView<Eigen::Lower>().solve(MatrixXd(bar.p0_bar.transpose())).transpose();
      gradient.head(momenta_) = by_momenta.reshaped() / std::sqrt(model.lambda);
    }
  }
  return gradient / (model.sigma * model.sigma);
}

Specimen::Slopes Specimen::slopes(const Model& model, const Shot& shot) const {
  if (momenta_ > 0) {
    const EndpointJacobian end = problem_.integrator->endpoint_jacobian(model.system, shot.paths.front());
    const Points& q = shot.paths.front().final().q;
    return {problem_.data->linearise(q, end.momenta).changes,
            {std::sqrt(problem_.grid.dt()) * problem_.data->linearise(q, end.increments).changes}};
  }
  const Index d = problem_.source.rows(), n = problem_.source.cols(), size = problem_.source.size();
  Slopes slopes{MatrixXd(count_, 0), {}};
  slopes.by_branch.resize(branches_.size());
  std::vector<MatrixXd> ends(branches_.size());  // of each branch, by (q, p) at its end, a row for each datum
  for (std::size_t b = 0; b < branches_.size(); ++b) ends[b] = MatrixXd::Zero(places_[b].data, 2 * size);
  for (std::size_t b = branches_.size(); b-- > 0;) {
    const Branch& branch = branches_[b];
    const Place& place = places_[b];
    if (branch.data) {
      const MatrixXd own = branch.data->linearise(shot.paths[b].final().q, MatrixXd::Identity(size, size)).changes;
      ends[b].topLeftCorner(own.rows(), size) = own;
    }
    slopes.by_branch[b].resize(place.data, place.unknowns);
    MatrixXd starts(place.data, 2 * size);
    parallel_for(static_cast<int>(place.data), [&](int row) {
      const PhaseState bar{ends[b].row(row).head(size).reshaped(d, n), ends[b].row(row).tail(size).reshaped(d, n)};
      const PathGradient gradient = problem_.integrator->adjoint(model.system, shot.paths[b], bar, false);
      slopes.by_branch[b].row(row) = std::sqrt(branch.grid.dt()) * gradient.increments_bar.reshaped().transpose();
      starts.row(row).head(size) = gradient.q0_bar.reshaped().transpose();
      starts.row(row).tail(size) = gradient.p0_bar.reshaped().transpose();
    });
    if (branch.parent >= 0) {
      const auto parent = static_cast<std::size_t>(branch.parent);
      ends[parent].middleRows(place.first_datum - places_[parent].first_datum, place.data) = starts;
    }
  }
  return slopes;
}

}  // namespace pulson::inference
