#include "landmark_blocks.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

namespace pulson::matching {

using Eigen::Index;
using Eigen::MatrixXd;

LandmarkBlock symmetric_root(const MatrixXd& m) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(m);
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal() *
         eigen.eigenvectors().transpose();
}

namespace {

template <int D>
Points by_blocks_of(const MatrixXd& blocks, const Points& v, bool transposed) {
  using Fixed = Eigen::Matrix<double, D, D>;
  using Vector = Eigen::Matrix<double, D, 1>;
  Points moved(D, v.cols());
  for (Index a = 0; a < v.cols(); ++a) {
    const Eigen::Map<const Fixed> matrix(blocks.col(a).data());
    const Eigen::Map<const Vector> from(v.col(a).data());
    Eigen::Map<Vector> to(moved.col(a).data());
    if (transposed)
      to.noalias() = matrix.transpose() * from;
    else
      to.noalias() = matrix * from;
  }
  return moved;
}

}  // namespace

Points by_blocks(const MatrixXd& blocks, const Points& v, bool transposed) {
  switch (v.rows()) {
    case 1:
      return blocks.cwiseProduct(v);
    case 2:
      return by_blocks_of<2>(blocks, v, transposed);
    default:
      return by_blocks_of<3>(blocks, v, transposed);
  }
}

Points half_step(const MatrixXd& gradients, double dt, const Points& v, bool transposed) {
  return v + 0.5 * dt * by_blocks(gradients, v, transposed);
}

MatrixXd half_step_inverses(const MatrixXd& gradients, double dt, Index d) {
  MatrixXd inverses(d * d, gradients.cols());
  for (Index a = 0; a < gradients.cols(); ++a) {
    const LandmarkBlock slope = LandmarkBlock::Identity(d, d) - 0.5 * dt * block(gradients, a, d);
    inverses.col(a) = LandmarkBlock(slope.inverse()).reshaped();
  }
  return inverses;
}

}  // namespace pulson::matching
