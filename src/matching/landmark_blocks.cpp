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

Points by_blocks(const MatrixXd& blocks, const Points& v, bool transposed) {
  const Index d = v.rows();
  Points moved(d, v.cols());
  for (Index a = 0; a < v.cols(); ++a) {
    if (transposed)
      moved.col(a) = block(blocks, a, d).transpose() * v.col(a);
    else
      moved.col(a) = block(blocks, a, d) * v.col(a);
  }
  return moved;
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
