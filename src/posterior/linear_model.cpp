#include "linear_model.hpp"

#include <cmath>
#include <utility>

#include "core/factorisations.hpp"
#include "pulson/core/errors.hpp"
#include "random/normals.hpp"

namespace pulson::posterior {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kProbes = 4;
constexpr std::uint64_t kProbeSeed = 0x70726f6265ULL;  // any
constexpr double kNegligibleStrength = 1e-12;

// The columns of one axis.
MatrixXd axis_columns(const MatrixXd& rows, Index axis, Index d) {
  return rows(Eigen::all, Eigen::seqN(axis, rows.cols() / d, d));
}

// AAᵀ
MatrixXd gram_of(const MatrixXd& a) {
  MatrixXd gram = MatrixXd::Zero(a.rows(), a.rows());
  gram.selfadjointView<Eigen::Lower>().rankUpdate(a);
  return gram.selfadjointView<Eigen::Lower>();
}

// Σ_axis B_axis LLᵀ B_axisᵀ
MatrixXd gram_through(const MatrixXd& rows, const MatrixXd& root, Index d) {
  MatrixXd gram = MatrixXd::Zero(rows.rows(), rows.rows());
  for (Index axis = 0; axis < d && rows.cols() > 0; ++axis) {
    const MatrixXd image = axis_columns(rows, axis, d) * root.triangularView<Eigen::Lower>();
    gram.selfadjointView<Eigen::Lower>().rankUpdate(image);
  }
  return gram.selfadjointView<Eigen::Lower>();
}

}  // namespace

std::shared_ptr<const LinearModel> linear_at_rest(const Specimen& specimen, const Specimen::Model& model) {
  const VectorXd rest = VectorXd::Zero(specimen.unknowns());
  const auto shot = specimen.shoot(model, rest);
  if (!shot)
    throw NumericalError(
        "landmarks at rest have no path: the noise is too strong for the time step; use more `grid.steps`");
  return std::make_shared<const LinearModel>(specimen, model, *shot, rest);
}

LinearModel::LinearModel(const Specimen& specimen, const Specimen::Model& model, const Specimen::Shot& at,
                         const VectorXd& z)
    : LinearModel(specimen, model, specimen.slopes(model, at), at.residual, z) {}

LinearModel::LinearModel(const Specimen& specimen, const Specimen::Model& model, Specimen::Slopes slopes,
                         const VectorXd& residual, const VectorXd& z)
    : specimen_(&specimen),
      start_{specimen.problem().source, specimen.momenta(model, z)},
      noise_(model.system.noise),
      root_(model.root) {
  const matching::MatchingProblem& problem = specimen.problem();
  const Index d = problem.source.rows(), n = problem.source.cols(), channels = specimen.channels();
  branches_ = std::move(slopes.branches);
  const MatrixXd momenta =
      slopes.momenta.size() > 0 ? MatrixXd(branches_.front().by_end * slopes.momenta) : MatrixXd(specimen.data(), 0);
  take_velocities(momenta);
  offset_ = residual.cwiseProduct(specimen.units(model));
  if (momenta.cols() > 0) offset_ -= momenta * start_.p.reshaped();
  for (std::size_t b = 0; b < branches_.size(); ++b) {
    const Specimen::Place& place = specimen.places()[b];
    const VectorXd moved = branches_[b].end * z.segment(place.first_unknown, place.unknowns);
    offset_.segment(place.first_datum, place.data).noalias() -= branches_[b].by_end * moved;
  }

  for (int i = 0; i < kProbes; ++i) {
    const MatrixXd normals =
        standard_normals(kProbeSeed, static_cast<std::uint64_t>(i), static_cast<int>(d), static_cast<int>(2 * n));
    probes_.push_back({normals.leftCols(n), normals.rightCols(n)});
  }
  if (channels == 0) return;
  strengths_ = strengths(*noise_);
  group_.assign(static_cast<std::size_t>(channels), 0);  // 0: of channels that no number scales
  int groups = 1;
  for (const NoiseAmplitude& amplitude : noise_->amplitudes(static_cast<int>(d), static_cast<int>(n))) {
    for (const int i : amplitude.channels) group_[static_cast<std::size_t>(i)] = groups;
    ++groups;
  }
  gram_.assign(static_cast<std::size_t>(groups), MatrixXd::Zero(specimen.data(), specimen.data()));
  for (std::size_t b = 0; b < branches_.size(); ++b)
    for (int g = 0; g < groups; ++g) {
      const MatrixXd& end = branches_[b].end;
      std::vector<Index> columns;
      for (Index i = 0; i < end.cols(); ++i)
        if (group_[static_cast<std::size_t>(i % channels)] == g) columns.push_back(i);
      if (columns.empty()) continue;
      const MatrixXd of_end = std::ssize(columns) < end.cols() ? gram_of(end(Eigen::all, columns)) : gram_of(end);
      const Specimen::Place& place = specimen.places()[b];
      gram_[static_cast<std::size_t>(g)]
          .block(place.first_datum, place.first_datum, place.data, place.data)
          .noalias() += branches_[b].by_end * of_end * branches_[b].by_end.transpose();
    }
}

LinearModel::LinearModel(LinearModel rest, const Specimen::Model& model, const MatrixXd& by_momenta)
    : LinearModel(std::move(rest)) {
  root_ = model.root;
  take_velocities(branches_.front().by_end * by_momenta);
}

void LinearModel::take_velocities(const MatrixXd& by_momenta) {
  const Index d = start_.q.rows(), n = start_.q.cols();
  by_velocity_.resize(by_momenta.rows(), by_momenta.cols());
  for (Index axis = 0; axis < d && by_velocity_.cols() > 0; ++axis) {
    MatrixXd rows = axis_columns(by_momenta, axis, d).transpose();
    root_->triangularView<Eigen::Lower>().solveInPlace(rows);
    root_->transpose().triangularView<Eigen::Upper>().solveInPlace(rows);
    by_velocity_(Eigen::all, Eigen::seqN(axis, n, d)) = MatrixXd(rows.transpose());
  }
  momentum_gram_ = gram_through(by_velocity_, *root_, d);
}

VectorXd LinearModel::strengths(const NoiseModel& noise) const {
  VectorXd squares = VectorXd::Zero(specimen_->channels());
  for (const PhaseState& probe : probes_) squares += noise.contract(start_, probe).cwiseAbs2();
  return squares.cwiseSqrt();
}

VectorXd LinearModel::group_ratios(const NoiseModel& noise) const {
  VectorXd now = VectorXd::Zero(std::ssize(gram_)), then = now;
  const VectorXd strengths = &noise == noise_.get() ? strengths_ : this->strengths(noise);
  for (Index i = 0; i < strengths.size(); ++i) {
    const int g = group_[static_cast<std::size_t>(i)];
    now[g] += strengths[i] * strengths[i];
    then[g] += strengths_[i] * strengths_[i];
  }
  for (Index g = 0; g < now.size(); ++g) now[g] = then[g] > kNegligibleStrength ? now[g] / then[g] : 1;
  return now;
}

MatrixXd LinearModel::covariance(const Specimen::Model& model) const {
  MatrixXd covariance = model.root == root_
                            ? momentum_gram_
                            : gram_through(by_velocity_, *model.root, specimen_->problem().source.rows());
  covariance /= model.lambda;
  if (!gram_.empty()) {
    const VectorXd ratios = group_ratios(*model.system.noise);
    for (std::size_t g = 0; g < gram_.size(); ++g) covariance += ratios[static_cast<Index>(g)] * gram_[g];
  }
  covariance.diagonal() += specimen_->units(model).cwiseAbs2();
  return covariance;
}

LinearAt::LinearAt(const LinearModel& linear, const Specimen::Model& model, double wider)
    : linear_(&linear), root_(model.root) {
  const Specimen& specimen = *linear.specimen_;
  const VectorXd units = specimen.units(model);
  scale_data_ = (wider * units).cwiseInverse();
  scale_velocity_ = 1 / std::sqrt(model.lambda);
  offset_ = scale_data_.cwiseProduct(linear.offset_);
  const Index channels = specimen.channels();
  scale_channels_ = VectorXd::Ones(channels);
  if (channels > 0) {
    const VectorXd ratios = linear.group_ratios(*model.system.noise);
    for (Index i = 0; i < channels; ++i)
      scale_channels_[i] *= std::sqrt(ratios[linear.group_[static_cast<std::size_t>(i)]]);
  }
  gram_ = linear.covariance(model);
  gram_.diagonal() -= units.cwiseAbs2();
  gram_ = scale_data_.asDiagonal() * gram_ * scale_data_.asDiagonal();
  log_volume_ = specimen.log_volume(model) + static_cast<double>(offset_.size()) * std::log(wider);
  factorise();
  excess_ = specimen.size_excess(model, solve(offset_));  // r at the mean is S⁻¹c
}

LinearAt LinearAt::wider(double factor) const {
  LinearAt made = *this;
  made.scale_data_ /= factor;
  made.offset_ /= factor;
  made.gram_ /= factor * factor;
  made.log_volume_ += static_cast<double>(offset_.size()) * std::log(factor);
  made.factorise();
  return made;
}

void LinearAt::factorise() {
  MatrixXd covariance = gram_;
  covariance.diagonal().array() += 1;
  factors_.compute(covariance);
  log_evidence_ = -0.5 * offset_.dot(factors_.solve(offset_)) - half_log_determinant() - log_volume_;
}

double LinearAt::half_log_determinant() const { return factors_.matrixLLT().diagonal().array().log().sum(); }

VectorXd LinearAt::apply(const VectorXd& z) const {
  const Specimen& specimen = *linear_->specimen_;
  VectorXd image = VectorXd::Zero(specimen.data());
  if (const Index momenta = specimen.momentum_unknowns(); momenta > 0) {
    const Points& source = specimen.problem().source;
    const MatrixXd velocity =
        z.head(momenta).reshaped(source.rows(), source.cols()) * root_->transpose().triangularView<Eigen::Upper>();
    image = scale_velocity_ * (linear_->by_velocity_ * velocity.reshaped());
  }
  const Index channels = scale_channels_.size();
  for (std::size_t b = 0; channels > 0 && b < linear_->branches_.size(); ++b) {
    const Specimen::Place& place = specimen.places()[b];
    const MatrixXd scaled =
        scale_channels_.asDiagonal() *
        z.segment(place.first_unknown, place.unknowns).reshaped(channels, place.unknowns / channels);
    const VectorXd moved = linear_->branches_[b].end * scaled.reshaped();
    image.segment(place.first_datum, place.data).noalias() += linear_->branches_[b].by_end * moved;
  }
  return scale_data_.cwiseProduct(image);
}

VectorXd LinearAt::transposed(const VectorXd& v) const {
  const Specimen& specimen = *linear_->specimen_;
  VectorXd z(specimen.unknowns());
  const VectorXd of_data = scale_data_.cwiseProduct(v);
  if (const Index momenta = specimen.momentum_unknowns(); momenta > 0) {
    const Points& source = specimen.problem().source;
    const VectorXd by_velocity = scale_velocity_ * (linear_->by_velocity_.transpose() * of_data);
    z.head(momenta) =
        MatrixXd(by_velocity.reshaped(source.rows(), source.cols()) * root_->triangularView<Eigen::Lower>()).reshaped();
  }
  const Index channels = scale_channels_.size();
  for (std::size_t b = 0; channels > 0 && b < linear_->branches_.size(); ++b) {
    const Specimen::Place& place = specimen.places()[b];
    const VectorXd by_end = linear_->branches_[b].by_end.transpose() * of_data.segment(place.first_datum, place.data);
    const VectorXd pulled = linear_->branches_[b].end.transpose() * by_end;
    z.segment(place.first_unknown, place.unknowns) =
        MatrixXd(scale_channels_.asDiagonal() * pulled.reshaped(channels, place.unknowns / channels)).reshaped();
  }
  return z;
}

MatrixXd LinearAt::by_momenta() const {
  const Index d = linear_->specimen_->problem().source.rows(), n = linear_->specimen_->problem().source.cols();
  MatrixXd of_momenta(offset_.size(), linear_->by_velocity_.cols());
  for (Index axis = 0; axis < d && of_momenta.cols() > 0; ++axis)
    of_momenta(Eigen::all, Eigen::seqN(axis, n, d)) =
        axis_columns(linear_->by_velocity_, axis, d) * root_->triangularView<Eigen::Lower>();
  return scale_velocity_ * (scale_data_.asDiagonal() * of_momenta);
}

// By p0 = (K + ε)^{-½}z/√λ the root in Jᵀ is undone by that in J'.
MatrixXd LinearAt::product(const Specimen::Slopes& slopes, const Specimen::Model& model) const {
  const Specimen& specimen = *linear_->specimen_;
  MatrixXd product = MatrixXd::Zero(specimen.data(), specimen.data());
  if (slopes.momenta.size() > 0)
    product.noalias() += slopes.branches.front().by_end * (slopes.momenta * momentum_changes(model));
  const Index channels = scale_channels_.size();
  const bool alike = channels > 0 && (scale_channels_.array() == scale_channels_[0]).all();
  for (std::size_t b = 0; channels > 0 && b < slopes.branches.size(); ++b) {
    const Specimen::Place& place = specimen.places()[b];
    const Specimen::BranchSlopes &there = slopes.branches[b], &here = linear_->branches_[b];
    MatrixXd of_ends;
    if (alike) {
      of_ends.noalias() = scale_channels_[0] * there.end * here.end.transpose();
    } else {
      const VectorXd scales = scale_channels_.replicate(place.unknowns / channels, 1);
      of_ends.noalias() = there.end * (here.end * scales.asDiagonal()).transpose();
    }
    product.block(place.first_datum, place.first_datum, place.data, place.data).noalias() +=
        there.by_end * of_ends *
        (here.by_end.transpose() * scale_data_.segment(place.first_datum, place.data).asDiagonal());
  }
  return specimen.units(model).cwiseInverse().asDiagonal() * product;
}

MatrixXd LinearAt::momentum_changes(const Specimen::Model& model) const {
  return scale_velocity_ / std::sqrt(model.lambda) * linear_->by_velocity_.transpose() * scale_data_.asDiagonal();
}

MatrixXd LinearAt::increment_changes() const {
  const Specimen& specimen = *linear_->specimen_;
  const Index channels = scale_channels_.size();
  MatrixXd changes = MatrixXd::Zero(specimen.unknowns() - specimen.momentum_unknowns(), specimen.data());
  for (std::size_t b = 0; channels > 0 && b < linear_->branches_.size(); ++b) {
    const Specimen::Place& place = specimen.places()[b];
    const VectorXd scales = scale_channels_.replicate(place.unknowns / channels, 1);
    changes.block(place.first_unknown - specimen.momentum_unknowns(), place.first_datum, place.unknowns, place.data) =
        scales.asDiagonal() * (linear_->branches_[b].end.transpose() * linear_->branches_[b].by_end.transpose());
  }
  return changes * scale_data_.asDiagonal();
}

double LinearAt::momentum_share() const {
  return gram_.diagonal().head(linear_->specimen_->coordinates()).sum() - noise_share();
}

double LinearAt::noise_share() const {
  const Index coordinates = linear_->specimen_->coordinates();
  const Index channels = scale_channels_.size();
  VectorXd squares = VectorXd::Zero(std::ssize(linear_->gram_));
  for (Index i = 0; i < channels; ++i)
    squares[linear_->group_[static_cast<std::size_t>(i)]] = scale_channels_[i] * scale_channels_[i];
  double trace = 0;
  for (Index g = 0; g < squares.size(); ++g)
    trace += squares[g] * linear_->gram_[static_cast<std::size_t>(g)]
                              .diagonal()
                              .head(coordinates)
                              .dot(scale_data_.head(coordinates).cwiseAbs2());
  return trace;
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

}  // namespace pulson::posterior
