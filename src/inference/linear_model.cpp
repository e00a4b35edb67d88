#include "linear_model.hpp"

#include <cmath>
#include <map>

#include "core/factorisations.hpp"
#include "random/normals.hpp"

namespace pulson::inference {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kProbes = 4;
constexpr std::uint64_t kProbeSeed = 0x70726f6265ULL;  // any
constexpr double kStretch = 1.1;                       // of a parameter, to find which channels it changes
constexpr double kNegligibleStrength = 1e-12;

// The columns of one axis.
MatrixXd axis_columns(const MatrixXd& rows, Index axis, Index d) {
  return rows(Eigen::all, Eigen::seqN(axis, rows.cols() / d, d));
}

// Σ_axis B_axis LLᵀ B_axisᵀ
MatrixXd gram_through(const MatrixXd& rows, const MatrixXd& root, Index d) {
  MatrixXd gram = MatrixXd::Zero(rows.rows(), rows.rows());
  for (Index axis = 0; axis < d; ++axis) {
    const MatrixXd image = axis_columns(rows, axis, d) * root.triangularView<Eigen::Lower>();
    gram.selfadjointView<Eigen::Lower>().rankUpdate(image);
  }
  return gram.selfadjointView<Eigen::Lower>();
}

}  // namespace

LinearModel::LinearModel(const Specimen& specimen, const Specimen::Model& model, const Specimen::Shot& at,
                         const VectorXd& z)
    : specimen_(&specimen), noise_(model.system.noise), root_(model.root) {
  const matching::MatchingProblem& problem = specimen.problem();
  const Index d = problem.source.rows(), n = problem.source.cols(), channels = specimen.channels();
  const EndpointJacobian end = problem.integrator->endpoint_jacobian(model.system, at.path);
  const Points& q = at.path.final().q;
  const MatrixXd by_momenta = problem.data->linearise(q, end.momenta).changes;
  by_velocity_.resize(by_momenta.rows(), d * n);
  for (Index axis = 0; axis < d; ++axis) {
    MatrixXd rows = axis_columns(by_momenta, axis, d).transpose();
    root_->triangularView<Eigen::Lower>().solveInPlace(rows);
    root_->transpose().triangularView<Eigen::Upper>().solveInPlace(rows);
    by_velocity_(Eigen::all, Eigen::seqN(axis, n, d)) = MatrixXd(rows.transpose());
  }
  momentum_gram_ = gram_through(by_velocity_, *root_, d);
  by_increments_ = problem.data->linearise(q, end.increments).changes;
  const VectorXd of_momenta = by_momenta * specimen.momenta(model, z).reshaped();
  offset_ = model.sigma * at.residual - of_momenta - by_increments_ * specimen.increments(z).reshaped();

  middle_ = at.path.states[at.path.states.size() / 2];
  for (int i = 0; i < kProbes; ++i) {
    const MatrixXd normals =
        standard_normals(kProbeSeed, static_cast<std::uint64_t>(i), static_cast<int>(d), static_cast<int>(2 * n));
    probes_.push_back({normals.leftCols(n), normals.rightCols(n)});
  }
  if (channels == 0) return;
  strengths_ = strengths(*noise_);
  const VectorXd theta = noise_->parameters();
  std::vector<std::vector<bool>> patterns(static_cast<std::size_t>(channels));
  for (Index j = 0; j < theta.size(); ++j) {
    VectorXd changed = theta;
    changed[j] *= kStretch;
    if (changed[j] == theta[j]) continue;
    const VectorXd stretched = strengths(*noise_->with_parameters(changed));
    for (Index i = 0; i < channels; ++i)
      patterns[static_cast<std::size_t>(i)].push_back(std::abs(stretched[i] - strengths_[i]) > 1e-9 * strengths_[i]);
  }
  std::map<std::vector<bool>, int> groups;
  for (const std::vector<bool>& pattern : patterns)
    group_.push_back(groups.try_emplace(pattern, static_cast<int>(groups.size())).first->second);
  for (int g = 0; g < static_cast<int>(groups.size()); ++g) {
    std::vector<Index> columns;
    for (Index k = 0; k < problem.grid.steps; ++k)
      for (Index i = 0; i < channels; ++i)
        if (group_[static_cast<std::size_t>(i)] == g) columns.push_back(k * channels + i);
    const MatrixXd some = by_increments_(Eigen::all, columns);
    gram_.emplace_back(problem.grid.dt() * some * some.transpose());
  }
}

VectorXd LinearModel::strengths(const NoiseModel& noise) const {
  VectorXd squares = VectorXd::Zero(specimen_->channels());
  for (const PhaseState& probe : probes_) squares += noise.contract(middle_, probe).cwiseAbs2();
  return squares.cwiseSqrt();
}

LinearAt::LinearAt(const LinearModel& linear, const Specimen::Model& model) : linear_(&linear), root_(model.root) {
  const Specimen& specimen = *linear.specimen_;
  const double precision = 1 / (model.sigma * model.sigma);
  scale_velocity_ = 1 / (model.sigma * std::sqrt(model.lambda));
  offset_ = linear.offset_ / model.sigma;
  MatrixXd s = (precision / model.lambda) *
               (root_ == linear.root_ ? linear.momentum_gram_
                                      : gram_through(linear.by_velocity_, *root_, specimen.problem().source.rows()));
  const Index channels = specimen.channels();
  scale_channels_ = VectorXd::Constant(channels, std::sqrt(specimen.problem().grid.dt()) / model.sigma);
  if (channels > 0) {
    const std::size_t groups = linear.gram_.size();
    VectorXd now = VectorXd::Zero(std::ssize(linear.gram_)), then = now;
    const bool same = model.system.noise == linear.noise_;
    const VectorXd strengths = same ? linear.strengths_ : linear.strengths(*model.system.noise);
    for (Index i = 0; i < channels; ++i) {
      const int g = linear.group_[static_cast<std::size_t>(i)];
      now[g] += strengths[i] * strengths[i];
      then[g] += linear.strengths_[i] * linear.strengths_[i];
    }
    for (std::size_t g = 0; g < groups; ++g) {
      const auto index = static_cast<Index>(g);
      const double ratio = then[index] > kNegligibleStrength ? now[index] / then[index] : 1;
      s += (precision * ratio) * linear.gram_[g];
      now[index] = std::sqrt(ratio);
    }
    for (Index i = 0; i < channels; ++i) scale_channels_[i] *= now[linear.group_[static_cast<std::size_t>(i)]];
  }
  s.diagonal().array() += 1;
  factors_.compute(s);
  log_evidence_ = -0.5 * offset_.dot(factors_.solve(offset_)) - factors_.matrixLLT().diagonal().array().log().sum() -
                  specimen.log_volume(model);
}

VectorXd LinearAt::apply(const VectorXd& z) const {
  const matching::MatchingProblem& problem = linear_->specimen_->problem();
  const Index d = problem.source.rows(), n = problem.source.cols();
  const MatrixXd velocity = z.head(d * n).reshaped(d, n) * root_->transpose().triangularView<Eigen::Upper>();
  VectorXd image = scale_velocity_ * (linear_->by_velocity_ * velocity.reshaped());
  const Index channels = scale_channels_.size();
  if (channels > 0) {
    const MatrixXd scaled =
        scale_channels_.asDiagonal() * z.tail(channels * problem.grid.steps).reshaped(channels, problem.grid.steps);
    image.noalias() += linear_->by_increments_ * scaled.reshaped();
  }
  return image;
}

VectorXd LinearAt::transposed(const VectorXd& v) const {
  const matching::MatchingProblem& problem = linear_->specimen_->problem();
  const Index d = problem.source.rows(), n = problem.source.cols(), channels = scale_channels_.size();
  VectorXd z(linear_->specimen_->unknowns());
  const VectorXd by_velocity = scale_velocity_ * (linear_->by_velocity_.transpose() * v);
  z.head(d * n) = MatrixXd(by_velocity.reshaped(d, n) * root_->triangularView<Eigen::Lower>()).reshaped();
  if (channels > 0) {
    const VectorXd pulled = linear_->by_increments_.transpose() * v;
    z.tail(pulled.size()) =
        MatrixXd(scale_channels_.asDiagonal() * pulled.reshaped(channels, problem.grid.steps)).reshaped();
  }
  return z;
}

VectorXd LinearAt::draw(const VectorXd& normals) const {
  const Index unknowns = linear_->specimen_->unknowns();
  const VectorXd zeta = normals.head(unknowns);
  return zeta - transposed(solve(apply(zeta) + offset_ + normals.tail(normals.size() - unknowns)));
}

VectorXd LinearAt::pull_back(const VectorXd& z_bar) const {
  const VectorXd weighed = solve(apply(z_bar));
  VectorXd normals(z_bar.size() + weighed.size());
  normals << z_bar - transposed(weighed), -weighed;
  return normals;
}

VectorXd LinearAt::mean() const { return -transposed(solve(offset_)); }

}  // namespace pulson::inference
