#include "cometric.hpp"

#include <algorithm>
#include <vector>

#include "kernels/line_sums.hpp"
#include "kernels/symmetric_matrix.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kRegularisation = 1e-10;

bool is_diagonal(const Eigen::SparseMatrix<double>& m) {
  for (Index column = 0; column < m.outerSize(); ++column)
    for (Eigen::SparseMatrix<double>::InnerIterator it(m, column); it; ++it)
      if (it.row() != column) return false;
  return true;
}

bool is_swept(const std::vector<KernelTerm>& terms) { return terms.size() == 1 && has_line_sums(terms); }

// Whether M = I ⊗ (N×N), index a·d + axis.
bool is_isotropic(const Eigen::SparseMatrix<double>& m, Index d) {
  Index of_first_axis = 0;
  for (Index column = 0; column < m.outerSize(); ++column)
    for (Eigen::SparseMatrix<double>::InnerIterator it(m, column); it; ++it) {
      if (it.row() % d != column % d) return false;
      if (it.value() != m.coeff(it.row() - it.row() % d, column - column % d)) return false;
      if (column % d == 0) ++of_first_axis;
    }
  return m.nonZeros() == d * of_first_axis;  // else some are of the first axis alone
}

Eigen::SparseMatrix<double> of_one_axis(const Eigen::SparseMatrix<double>& m, Index d) {
  std::vector<Eigen::Triplet<double>> entries;
  for (Index column = 0; column < m.outerSize(); column += d)
    for (Eigen::SparseMatrix<double>::InnerIterator it(m, column); it; ++it)
      entries.emplace_back(it.row() / d, column / d, it.value());
  Eigen::SparseMatrix<double> one(m.rows() / d, m.cols() / d);
  one.setFromTriplets(entries.begin(), entries.end());
  return one;
}

// The column of channel i.
void add_field(const Points& field, Index i, std::vector<Eigen::Triplet<double>>& entries) {
  for (Index row = 0; row < field.size(); ++row)
    if (field.data()[row] != 0) entries.emplace_back(row, i, field.data()[row]);
}

// By as many evaluations as a landmark has channels: those of different landmarks do not meet.
void add_fields_of_landmarks(const NoiseModel& noise, const PhaseState& rest, const std::vector<Index>& alone,
                             std::vector<Eigen::Triplet<double>>& entries) {
  std::vector<std::vector<Index>> rounds;  // channels
  std::vector<std::size_t> seen(static_cast<std::size_t>(rest.q.cols()), 0);
  for (std::size_t i = 0; i < alone.size(); ++i) {
    const std::size_t round = seen[static_cast<std::size_t>(alone[i])]++;
    if (round == rounds.size()) rounds.emplace_back();
    rounds[round].push_back(static_cast<Index>(i));
  }
  for (const std::vector<Index>& round : rounds) {
    VectorXd chosen = VectorXd::Zero(std::ssize(alone));
    chosen(round).setOnes();
    const Points fields = noise.gradient(rest, chosen).p;
    for (const Index i : round) {
      const Index a = alone[static_cast<std::size_t>(i)];
      for (Index axis = 0; axis < fields.rows(); ++axis)
        if (fields(axis, a) != 0) entries.emplace_back(a * fields.rows() + axis, i, fields(axis, a));
    }
  }
}

}  // namespace

std::vector<Index> landmarks_of_channels(const NoiseModel& noise, const Points& q) {
  if (!noise.traits().local) return {};
  std::vector<Index> alone;
  for (const NoiseChannel& channel : noise.describe_channels(static_cast<int>(q.rows()), static_cast<int>(q.cols()))) {
    if (channel.landmarks.size() != 1) return {};
    alone.push_back(channel.landmarks.front());
  }
  return alone;
}

bool sweeps_along_line(const KernelOperator& kernel, const NoiseCometric& noise, const Points& q) {
  return q.rows() == 1 && q.cols() >= kFewestOnLine && is_swept(kernel.terms()) && is_diagonal(noise.matrix) &&
         q.allFinite();
}

bool moves_each_along_line(const NoiseCometric& noise, const Points& q) {
  return q.rows() == 1 && is_diagonal(noise.matrix) && noise.matrix.nonZeros() == q.cols();
}

double regularisation(const KernelOperator& kernel) { return kRegularisation * kernel.at_zero(); }

NoiseCometric noise_cometric(const NoiseModel& noise, const Points& q) {
  const auto channels = static_cast<Index>(noise.channels(static_cast<int>(q.rows()), static_cast<int>(q.cols())));
  if (!noise.traits().moves_positions()) return {Eigen::SparseMatrix<double>(q.cols(), q.cols()), true};
  const PhaseState rest{q, Points::Zero(q.rows(), q.cols())};
  std::vector<Eigen::Triplet<double>> entries;
  const std::vector<Index> alone = landmarks_of_channels(noise, q);
  if (alone.empty()) {
    for (Index i = 0; i < channels; ++i) add_field(noise.gradient(rest, VectorXd::Unit(channels, i)).p, i, entries);
  } else {
    add_fields_of_landmarks(noise, rest, alone, entries);
  }
  Eigen::SparseMatrix<double> fields(q.size(), channels);
  fields.setFromTriplets(entries.begin(), entries.end());
  Eigen::SparseMatrix<double> all = fields * fields.transpose();
  if (is_isotropic(all, q.rows())) return {of_one_axis(all, q.rows()), true};
  return {all, false};
}

Cometric::Cometric(const KernelOperator& kernel, const NoiseCometric& noise, double lambda, const Points& q)
    : dimension_(q.rows()), isotropic_(noise.isotropic), kernel_(kernel), q_(q) {
  if (sweeps_along_line(kernel, noise, q)) {
    own_ = (lambda * noise.matrix.diagonal()).array() + regularisation(kernel);
    line_.emplace(kernel.terms().front(), q.transpose(), own_);
    regular_ = line_->is_regular();
    return;
  }
  const MatrixXd gram = kernel.gram(q, q);
  if (isotropic_) {
    matrix_ = gram;
  } else {
    matrix_ = MatrixXd::Zero(q.size(), q.size());
    for (Index axis = 0; axis < dimension_; ++axis) {
      const auto every = Eigen::seqN(axis, q.cols(), dimension_);
      matrix_(every, every) = gram;
    }
  }
  matrix_ += lambda * noise.matrix;
  matrix_.diagonal().array() += regularisation(kernel);
  diagonal_ = matrix_.diagonal();
  regular_ = factorise_in_place(matrix_);
}

namespace {

// V with a row or a column for each line of the matrix.
MatrixXd lines_of(const Points& v, bool isotropic) {
  return isotropic ? MatrixXd(v.transpose()) : MatrixXd(v.reshaped());
}

Points from_lines(const MatrixXd& lines, bool isotropic, Index d) {
  return isotropic ? Points(lines.transpose()) : Points(lines.reshaped(d, lines.size() / d));
}

}  // namespace

Points Cometric::apply(const Points& p) const {
  if (line_) return kernel_.apply(q_, q_, p) + p * own_.asDiagonal();
  return from_lines(symmetric_product(matrix_, diagonal_, lines_of(p, isotropic_)), isotropic_, dimension_);
}

Points Cometric::solve(const Points& v) const {
  if (line_) {
    MatrixXd solved = v.transpose();
    line_->solve_in_place(solved);
    return solved.transpose();
  }
  MatrixXd lines = lines_of(v, isotropic_);
  solve_factorised(matrix_, lines);
  return from_lines(lines, isotropic_, dimension_);
}

VectorXd Cometric::column(Index l, Index m, Index b) const {
  if (line_) {
    VectorXd part = kernel_.gram(q_.leftCols(b + 1), q_.col(b));
    part[b] += own_[b];
    return part;
  }
  if (isotropic_) {
    VectorXd part = matrix_.col(b).head(b + 1);
    part[b] = diagonal_[b];
    return part;
  }
  const Index d = dimension_, row = b * d + l, column = b * d + m;
  VectorXd part = matrix_(Eigen::seqN(l, b + 1, d), column);
  part[b] = row == column ? diagonal_[row] : matrix_(std::min(row, column), std::max(row, column));
  return part;
}

void Cometric::add_transformed(const MatrixXd& psi, double dt, Index b, MatrixXd& sum) const {
  const Index d = dimension_;
  const VectorXd same = isotropic_ ? column(0, 0, b) : VectorXd();
  VectorXd transformed(b + 1);  // an axis of Ψ_a A_ab
  for (Index m = 0; m < d; ++m)
    for (Index i = 0; i < d; ++i) {
      if (isotropic_) {
        transformed = psi.col(i + m * d).head(b + 1).cwiseProduct(same);
      } else {
        transformed.setZero();
        for (Index l = 0; l < d; ++l) transformed += psi.col(i + l * d).head(b + 1).cwiseProduct(column(l, m, b));
      }
      for (Index j = 0; j < d; ++j) sum.col(i + j * d) += (dt * psi(b, j + m * d)) * transformed;
    }
}

}  // namespace pulson::matching
