#include "passive_model.hpp"

#include <Eigen/LU>

#include "landmark_blocks.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Beside the largest, what a Cholesky factor of the carriers' matrix needs.
constexpr double kJitter = 1e-11;

// U, UUᵀ nearly the matrix that has these columns; none of them where own noise is so large that there are no carriers.
MatrixXd root_of(const MatrixXd& columns, const std::vector<Index>& which) {
  if (which.empty()) return columns;
  MatrixXd square = columns(which, Eigen::all);
  square.diagonal().array() += kJitter * square.diagonal().maxCoeff();
  const Eigen::LLT<MatrixXd> factors(square);
  MatrixXd root = columns;
  factors.matrixU().solveInPlace<Eigen::OnTheRight>(root);
  return root;
}

}  // namespace

PassiveModel::PassiveModel(const EffectiveHamiltonian& system, const LandmarkTerm& data, const CanonicalPath& path,
                           std::vector<MatrixXd> gradients, double own, double weight,
                           const std::vector<Index>& carriers)
    : system_(system), path_(path), gradients_(std::move(gradients)), own_rate_(own) {
  const Index d = path.nodes.front().rows(), n = path.nodes.front().cols();
  precisions_.resize(d * d, n);
  for (Index a = 0; a < n; ++a) precisions_.col(a) = (weight * data.precision(a)).reshaped();
  inverses_.resize(gradients_.size());
  for (std::size_t k = 0; k < gradients_.size(); ++k)
    inverses_[k] = half_step_inverses(gradients_[k], path.grid.dt(), d);
  propagate();
  factorise(own, carriers);
}

void PassiveModel::propagate() {
  const Index d = path_.nodes.front().rows(), n = path_.nodes.front().cols();
  from_steps_.assign(gradients_.size(), MatrixXd(d * d, n));
  for (Index a = 0; a < n; ++a) {
    LandmarkBlock suffix = LandmarkBlock::Identity(d, d);
    for (std::size_t k = gradients_.size(); k-- > 0;) {
      const LandmarkBlock psi = suffix * block(inverses_[k], a, d);
      suffix = psi + 0.5 * path_.grid.dt() * psi * block(gradients_[k], a, d);
      from_steps_[k].col(a) = psi.reshaped();
    }
  }
}

void PassiveModel::factorise(double own, const std::vector<Index>& carriers) {
  const KernelOperator& kernel = system_.system().kernel;
  const Index d = path_.nodes.front().rows(), n = path_.nodes.front().cols(), m = std::ssize(carriers);
  const double dt = path_.grid.dt();
  // The columns of the carriers of the smooth part of P.
  smooth_ = MatrixXd::Zero(d * n, d * m);
  MatrixXd squares = MatrixXd::Zero(d * d, n);  // Σ Δt ΨΨᵀ
  for (std::size_t k = 0; k < gradients_.size(); ++k) {
    const Points middle = path_.middle(k);
    MatrixXd gram = kernel.gram(middle, middle(Eigen::all, carriers));
    smooth_kernels_.push_back(root_of(gram, carriers));
    gram *= dt;
    const MatrixXd psi = from_steps_[k].transpose();
    parallel_for(static_cast<int>(m), [&](int c) {
      const Index carrier = carriers[static_cast<std::size_t>(c)];
      for (Index l = 0; l < d; ++l)
        for (Index i = 0; i < d; ++i) {
          const VectorXd moved = psi.col(i + l * d).cwiseProduct(gram.col(c));
          for (Index j = 0; j < d; ++j) smooth_(Eigen::seqN(i, n, d), c * d + j) += psi(carrier, j + l * d) * moved;
        }
    });
    for (Index a = 0; a < n; ++a) {
      const LandmarkBlock b = block(from_steps_[k], a, d);
      squares.col(a) += (dt * LandmarkBlock(b * b.transpose())).reshaped();
    }
  }
  std::vector<Index> rows_of_carriers;
  for (const Index carrier : carriers)
    for (Index i = 0; i < d; ++i) rows_of_carriers.push_back(carrier * d + i);
  smooth_ = root_of(smooth_, rows_of_carriers);
  own_.resize(d * d, n);
  answers_.resize(d * d, n);
  MatrixXd weighed(d * n, d * m);  // FV
  for (Index a = 0; a < n; ++a) {
    const auto rows = smooth_.middleRows(a * d, d);
    const LandmarkBlock all = block(squares, a, d);
    const LandmarkBlock left = symmetric_root(kernel.at_zero() * all - rows * rows.transpose());
    const LandmarkBlock e = own * all + left * left;  // without what round-off makes negative
    const LandmarkBlock c = symmetric_root(block(precisions_, a, d));
    const LandmarkBlock f = c * LandmarkBlock(LandmarkBlock::Identity(d, d) + c * e * c).inverse() * c;
    own_.col(a) = e.reshaped();
    answers_.col(a) = f.reshaped();
    weighed.middleRows(a * d, d) = f * rows;
  }
  MatrixXd inner = smooth_.transpose() * weighed;
  inner.diagonal().array() += 1;
  factors_.compute(inner);
}

Points PassiveModel::velocity(std::size_t k, const Points& p) const {
  const MatrixXd carried = p * smooth_kernels_[k];
  return own_rate_ * p + carried * smooth_kernels_[k].transpose();
}

Points PassiveModel::pull(const Points& end_change) const { return by_blocks(precisions_, end_change, false); }

Points PassiveModel::smooth_product(const VectorXd& carried, const Points& like) const {
  return (smooth_ * carried).reshaped(like.rows(), like.cols());
}

Points PassiveModel::answer(const Points& costate, const Points& end) const {
  const Points moved =
      end + by_blocks(own_, costate, false) + smooth_product(smooth_.transpose() * costate.reshaped(), costate);
  const Points own = by_blocks(answers_, moved, false);
  const Points smooth = smooth_product(factors_.solve(smooth_.transpose() * own.reshaped()), own);
  return costate - own + by_blocks(answers_, smooth, false);
}

PathVariation PassiveModel::swept(const PathResidual& change, const Points& end_costate) const {
  const auto steps = gradients_.size();
  const double dt = path_.grid.dt();
  const Points none = Points::Zero(end_costate.rows(), end_costate.cols());
  PathVariation swept{std::vector<Points>(steps + 1, none), std::vector<Points>(steps), std::vector<Points>(steps)};
  Points costate = end_costate;
  for (std::size_t k = steps; k-- > 0;) {
    swept.momenta[k] = by_blocks(inverses_[k], costate, true);
    costate = half_step(gradients_[k], dt, swept.momenta[k], true);
    if (k > 0) costate += change.momenta[k];
  }
  for (std::size_t k = 0; k < steps; ++k) swept.velocities[k] = velocity(k, swept.momenta[k]);
  for (std::size_t k = 0; k < steps; ++k)
    swept.nodes[k + 1] = by_blocks(
        inverses_[k],
        half_step(gradients_[k], dt, swept.nodes[k], false) + dt * (swept.velocities[k] + change.velocities[k]), false);
  return swept;
}

PathVariation PassiveModel::solve(const PathResidual& change) const {
  const Points none = Points::Zero(path_.nodes.front().rows(), path_.nodes.front().cols());
  const PathVariation free = swept(change, none);
  return swept(change, answer(change.momenta.back(), free.nodes.back()));
}

}  // namespace pulson::matching
