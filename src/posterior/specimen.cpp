#include "specimen.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/QR>
#include <fmt/core.h>

#include "core/factorisations.hpp"
#include "core/undefined.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/matching/data_term.hpp"

namespace pulson::posterior {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// ε = kSeen λσ²/T²: momenta in directions whose eigenvalue of K is below ε would move no landmark by more than 0.03 σ.
// It keeps them finite where K is singular to rounding, and changes the velocities Kp0 of the others by a fraction ε
// over their eigenvalue. At least so much of K(0), for rounding.
constexpr double kSeen = 1e-3;
constexpr double kSingular = 1e-12;

bool same_kernel(const KernelOperator& a, const KernelOperator& b) {
  return std::equal(a.terms().begin(), a.terms().end(), b.terms().begin(), b.terms().end(),
                    [](const KernelTerm& s, const KernelTerm& t) {
                      return s.profile == t.profile && s.alpha == t.alpha && s.weight == t.weight;
                    });
}

// A basis of what is orthogonal to the columns of X: the last columns of Q in X = QR.
MatrixXd complement_of(const Eigen::HouseholderQR<MatrixXd>& factors) {
  const Index n = factors.rows();
  MatrixXd basis = MatrixXd::Identity(n, n);
  basis.applyOnTheLeft(factors.householderQ());
  return basis.rightCols(n - factors.cols());
}

// λS of MomentumPrior::kSmooth.
constexpr double kDeviations = 3;
MatrixXd hidden_by_noise(const matching::MatchingProblem& problem) {
  const Index d = problem.source.rows(), n = problem.source.cols();
  const PhaseState at_rest{problem.source, Points::Zero(d, n)};
  MatrixXd moved = MatrixXd::Zero(n, n);
  for (Index axis = 0; axis < d; ++axis) {
    MatrixXd channels(problem.system.noise->channels(static_cast<int>(d), static_cast<int>(n)), n);
    for (Index a = 0; a < n; ++a) {
      PhaseState along{Points::Zero(d, n), Points::Zero(d, n)};
      along.p(axis, a) = 1;
      channels.col(a) = problem.system.noise->contract(at_rest, along);
    }
    moved += channels.transpose() * channels / static_cast<double>(d);
  }
  const double time = problem.grid.time;
  return problem.lambda * std::pow(kDeviations / time, 2) *
         (problem.sigma * problem.sigma * MatrixXd::Identity(n, n) + time * moved);
}

}  // namespace

Specimen::Specimen(matching::MatchingProblem problem, std::vector<Branch> tree, MomentumPrior prior)
    : problem_(std::move(problem)),
      branches_(std::move(tree)),
      momenta_(branches_.empty() ? problem_.source.size() : 0),
      channels_(problem_.system.noise->channels(static_cast<int>(problem_.source.rows()),
                                                static_cast<int>(problem_.source.cols()))),
      nugget_(std::max(kSeen * problem_.lambda * std::pow(problem_.sigma / problem_.grid.time, 2),
                       kSingular * problem_.system.kernel.at_zero())),
      hidden_(prior == MomentumPrior::kSmooth ? hidden_by_noise(problem_) : MatrixXd()),
      reference_root_(std::make_shared<MatrixXd>(root_of(problem_.system.kernel))) {
  check(problem_);
  matching::require_distinct(problem_.source);
  if (branches_.empty()) branches_.push_back({"", -1, problem_.grid, problem_.data});
  add_branches();
}

Specimen::Specimen(matching::MatchingProblem problem, AlignmentKind pose, MomentumPrior prior)
    : Specimen(std::move(problem), std::vector<Branch>{}, prior) {
  if (pose == AlignmentKind::kNone) return;
  pose_kind_ = pose;
  pose_.emplace(*problem_.data->landmarks(), problem_.source, pose);
  const MatrixXd moved = projection_ * pose_->directions();
  if (count_ <= moved.cols())
    throw InputError(
        fmt::format("its {} observed coordinates are too few, as the alignment accounts for all of them", count_));
  const Eigen::HouseholderQR<MatrixXd> factors(moved);
  complement_ = complement_of(factors);
  log_determinant_ += 2 * factors.matrixQR().diagonal().cwiseAbs().array().log().sum() -
                      static_cast<double>(moved.cols()) * std::log(2 * std::numbers::pi);
  sizes_ = pose_->sizes();
  count_ = complement_.cols() + sizes_;
  places_.front().data = count_;
  projection_ = complement_.transpose() * projection_;
}

MatrixXd Specimen::projection(const VectorXd& end) const {
  if (!pose_) return projection_;
  const Points q = end.reshaped(problem_.source.rows(), problem_.source.cols());
  MatrixXd slopes(count_, q.size());
  slopes << pose_->slopes(projection_, q), pose_->size_slopes(q);
  return slopes;
}

MatrixXd Specimen::source_projection() const {
  if (!pose_) return projection_;
  const MatrixXd observed = by_end(0);
  const MatrixXd moved = observed * Pose::directions(*problem_.data->landmarks(), problem_.source, pose_kind_);
  return complement_of(Eigen::HouseholderQR<MatrixXd>(moved)).transpose() * observed;
}

void Specimen::add_branches() {
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
  if (momenta_ > 0) projection_ = by_end(0);
}

MatrixXd Specimen::root_of(const KernelOperator& kernel) const {
  MatrixXd gram = kernel.gram(problem_.source, problem_.source);
  gram.diagonal().array() += nugget_;
  Eigen::LLT<MatrixXd> factors(gram);
  if (factors.info() == Eigen::Success && hidden_.size() > 0) {
    const MatrixXd half = factors.matrixL().solve(hidden_);
    factors.compute(gram + half.transpose() * half);
  }
  if (factors.info() != Eigen::Success) throw NumericalError("the matrix of the kernel is singular");
  return factors.matrixL();
}

Specimen::Model Specimen::model(const Numbers& numbers) const {
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

VectorXd Specimen::own_residual(std::size_t branch, const Points& end) const {
  if (!pose_) return branches_[branch].data->residual(end);
  VectorXd residual(count_);
  residual << complement_.transpose() * branches_[branch].data->residual(pose_->apply(end)), pose_->size(end);
  return residual;
}

VectorXd Specimen::residual(const Model& model, const VectorXd& ends) const {
  const Index d = problem_.source.rows(), n = problem_.source.cols();
  VectorXd residual(count_);
  Index first = 0;
  for (std::size_t b = 0; b < branches_.size(); ++b) {
    if (!branches_[b].data) continue;
    const VectorXd own = own_residual(b, ends.segment(static_cast<Index>(b) * d * n, d * n).reshaped(d, n));
    residual.segment(first, own.size()) = own;
    first += own.size();
  }
  if (sizes_ > 0) residual.tail(sizes_) -= centre_of_size(model);
  return residual.cwiseQuotient(units(model));
}

std::optional<Specimen::Shot> Specimen::shoot(const Model& model, const VectorXd& z) const {
  std::optional<std::vector<Trajectory>> found = paths(model, z);
  if (!found) return std::nullopt;
  Shot shot{std::move(*found), {}, 0};
  const Index size = problem_.source.size();
  VectorXd ends(size * std::ssize(shot.paths));
  for (std::size_t b = 0; b < shot.paths.size(); ++b)
    ends.segment(static_cast<Index>(b) * size, size) = shot.paths[b].final().q.reshaped();
  shot.residual = residual(model, ends);
  shot.log_likelihood = log_likelihood(model, shot.residual);
  if (!std::isfinite(shot.log_likelihood)) return std::nullopt;
  return shot;
}

double Specimen::log_volume(const Model& model) const {
  return 0.5 * log_determinant_ + static_cast<double>(coordinates()) * std::log(model.sigma) -
         half_square_at_one(model);
}

// By p0 = z0 L⁻¹/√λ.
VectorXd Specimen::whitened(const Model& model, const VectorXd& by_momenta) const {
  const MatrixXd rows = by_momenta.reshaped(problem_.source.rows(), problem_.source.cols()).transpose();
  const MatrixXd by_z = model.root->triangularView<Eigen::Lower>().solve(rows);
  return by_z.transpose().reshaped() / std::sqrt(model.lambda);
}

MatrixXd Specimen::by_end(std::size_t branch) const {
  const Index size = problem_.source.size();
  return branches_[branch].data->linearise(problem_.source, MatrixXd::Identity(size, size)).changes;
}

// Backwards through the branches: what depends on the end of one are its own data and the starts of its children.
VectorXd Specimen::transposed(const Model& model, const Shot& shot, const VectorXd& v) const {
  const Index d = problem_.source.rows(), n = problem_.source.cols(), size = problem_.source.size();
  VectorXd by_z(unknowns());
  const VectorXd of_data = v.cwiseQuotient(units(model));
  if (momenta_ > 0) {
    const MatrixXd by_end = projection(shot.paths.front().final().q.reshaped());
    const PhaseState bar{(by_end.transpose() * of_data).reshaped(d, n), Points::Zero(d, n)};
    const PathGradient gradient = problem_.integrator->adjoint(model.system, shot.paths.front(), bar, false);
    by_z.head(momenta_) = whitened(model, gradient.p0_bar.reshaped());
    by_z.tail(by_z.size() - momenta_) = std::sqrt(problem_.grid.dt()) * gradient.increments_bar.reshaped();
    return by_z;
  }
  const Index of_state = is_at_rest(model.system, shot.paths.front().initial()) ? size : 2 * size;
  std::vector<MatrixXd> rows(branches_.size(), MatrixXd::Zero(1, of_state));
  Index after = count_;
  for (std::size_t b = branches_.size(); b-- > 0;) {
    const Place& place = places_[b];
    if (branches_[b].data) {
      const MatrixXd own = by_end(b);
      after -= own.rows();
      rows[b].leftCols(size) += of_data.segment(after, own.rows()).transpose() * own;
    }
    const PathRows path = problem_.integrator->adjoint_rows(model.system, shot.paths[b], rows[b]);
    by_z.segment(place.first_unknown, place.unknowns) = std::sqrt(branches_[b].grid.dt()) * path.increments.transpose();
    if (branches_[b].parent >= 0) rows[static_cast<std::size_t>(branches_[b].parent)] += path.start;
  }
  return by_z;
}

Specimen::Slopes Specimen::slopes(const Model& model, const Shot& shot) const {
  const Index size = problem_.source.size();
  if (momenta_ > 0) {
    EndpointJacobian end = problem_.integrator->endpoint_jacobian(model.system, shot.paths.front());
    return {std::move(end.momenta),
            {{projection(shot.paths.front().final().q.reshaped()), std::sqrt(problem_.grid.dt()) * end.increments}}};
  }
  const Index of_state = is_at_rest(model.system, shot.paths.front().initial()) ? size : 2 * size;
  Slopes slopes{{}, std::vector<BranchSlopes>(branches_.size())};
  std::vector<MatrixXd> starts(branches_.size());
  parallel_for(static_cast<int>(branches_.size()), [&](int b) {
    const auto i = static_cast<std::size_t>(b);
    PathRows path =
        problem_.integrator->adjoint_rows(model.system, shot.paths[i], MatrixXd::Identity(of_state, of_state));
    path.increments *= std::sqrt(branches_[i].grid.dt());
    slopes.branches[i].end = std::move(path.increments);
    starts[i] = std::move(path.start);
  });
  for (std::size_t b = branches_.size(); b-- > 0;) {
    const Place& place = places_[b];
    MatrixXd& of_data = slopes.branches[b].by_end;
    if (of_data.size() == 0) of_data.setZero(place.data, of_state);
    if (branches_[b].data) {
      const MatrixXd own = by_end(b);
      of_data.topLeftCorner(own.rows(), size) = own;
    }
    if (branches_[b].parent < 0) continue;
    const auto parent = static_cast<std::size_t>(branches_[b].parent);
    MatrixXd& above = slopes.branches[parent].by_end;
    if (above.size() == 0) above.setZero(places_[parent].data, of_state);
    above.middleRows(place.first_datum - places_[parent].first_datum, place.data).noalias() = of_data * starts[b];
  }
  return slopes;
}

VectorXd refined(const Specimen& specimen, const VectorXd& z, const VectorXd& normals) {
  VectorXd fine(2 * z.size() - specimen.momentum_unknowns());
  fine.head(specimen.momentum_unknowns()) = z.head(specimen.momentum_unknowns());
  const Index channels = specimen.channels();
  for (Index to = specimen.momentum_unknowns(), from = to; channels > 0 && from < z.size(); from += channels) {
    const auto whole = z.segment(from, channels), apart = normals.segment(from, channels);
    fine.segment(to, channels) = (whole + apart) / std::numbers::sqrt2;
    fine.segment(to + channels, channels) = (whole - apart) / std::numbers::sqrt2;
    to += 2 * channels;
  }
  return fine;
}

}  // namespace pulson::posterior
