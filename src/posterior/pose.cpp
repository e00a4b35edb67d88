#include "pose.hpp"

#include <limits>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>

namespace pulson::posterior {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

MatrixXd directions_of(const Points& shape, AlignmentKind kind, const std::vector<Index>& coordinates) {
  const MatrixXd of_those = motion_directions(shape, kind, coordinates);
  MatrixXd directions = MatrixXd::Zero(shape.size(), of_those.cols());
  directions(coordinates, Eigen::all) = of_those;
  return directions;
}

std::vector<Index> all_coordinates(Index size) {
  std::vector<Index> all(static_cast<std::size_t>(size));
  for (Index i = 0; i < size; ++i) all[static_cast<std::size_t>(i)] = i;
  return all;
}

}  // namespace

MatrixXd Pose::directions(const matching::LandmarkTerm& data, const Points& shape, AlignmentKind kind) {
  const Index d = shape.rows();
  std::vector<Index> observed;
  for (Index a = 0; a < shape.cols(); ++a)
    for (Index axis = 0; axis < d; ++axis)
      if (data.precision(a)(axis, axis) > 0) observed.push_back(a * d + axis);
  return directions_of(shape, kind, observed);
}

Pose::Pose(const matching::LandmarkTerm& data, const Points& source, AlignmentKind kind)
    : kind_(kind), weights_(VectorXd::Zero(source.cols())) {
  const Index d = source.rows();
  const Points target = data.target();
  Points shape = source;  // y, completed
  for (Index a = 0; a < source.cols(); ++a) {
    const VectorXd precision = data.precision(a).diagonal();
    shape.col(a) = (precision.array() > 0).select(target.col(a), source.col(a));
    if (precision.minCoeff() > 0) weights_[a] = precision.mean();
  }
  directions_ = directions(data, shape, kind);
  weights_ /= weights_.sum();
  mean_ = shape * weights_;
  shape.colwise() -= mean_;
  weighted_ = shape * weights_.asDiagonal();
  square_ = weighted_ * shape.transpose();
  std::vector<Index> complete;
  for (Index a = 0; a < source.cols(); ++a)
    for (Index axis = 0; weights_[a] > 0 && axis < d; ++axis) complete.push_back(a * d + axis);
  const auto weighed = [&](MatrixXd directions) {
    for (Index a = 0; a < source.cols(); ++a) directions.middleRows(a * d, d) *= weights_[a];
    return directions;
  };
  gauge_ = weighed(directions_of(shape, kind, complete));
  if (kind_ == AlignmentKind::kSimilarity) {
    size_rows_ = weighted_.reshaped().transpose() / square_.trace();
  } else if (kind_ == AlignmentKind::kAffine) {
    const MatrixXd columns = square_.ldlt().solve(MatrixXd(weighted_));  // B = Σ_a q_a columns_aᵀ
    size_rows_ = MatrixXd::Zero(d * d, source.size());
    for (Index a = 0; a < source.cols(); ++a)
      for (Index i = 0; i < d; ++i) size_rows_(Eigen::seqN(i, d, d), a * d + i) = columns.col(a);
  }
  if (sizes() > 0) turning_ = weighed(directions_of(shape, AlignmentKind::kRigid, complete));
}

// Of a rotation Σ w y(Rq)ᵀ is symmetric, as of the one that fits best; of an affine map Σ w y(Gq)ᵀ = Σ w yyᵀ.
Pose::Motion Pose::motion(AlignmentKind kind, const Points& q) const {
  const Index d = q.rows();
  Motion motion{SmallMatrix::Identity(d, d), VectorXd::Zero(d)};
  const SmallMatrix products = weighted_ * q.transpose();
  if (kind == AlignmentKind::kAffine) {
    motion.linear = products.partialPivLu().solve(square_).transpose();
  } else if (kind != AlignmentKind::kTranslation) {
    motion.linear = nearest_orthogonal(products, std::numeric_limits<double>::infinity());
    if (kind == AlignmentKind::kSimilarity)
      motion.linear *= square_.trace() / motion.linear.cwiseProduct(products).sum();
  }
  motion.shift = mean_ - motion.linear * (q * weights_);
  return motion;
}

Points Pose::apply(const Points& q) const {
  const Motion motion = this->motion(kind_, q);
  return (motion.linear * q).colwise() + motion.shift;
}

// As q moves, g moves gq along its own directions Z: gaugeᵀ(Z da + G dq) = 0.
MatrixXd Pose::slopes(AlignmentKind kind, const MatrixXd& gauge, const MatrixXd& rows, const Points& q) const {
  const Index d = q.rows();
  const Motion motion = this->motion(kind, q);
  const MatrixXd own = motion_directions(motion.linear * q, kind, all_coordinates(q.size()));
  const MatrixXd by_gauge = (gauge.transpose() * own).completeOrthogonalDecomposition().pseudoInverse();
  MatrixXd slopes = rows - (rows * own) * by_gauge * gauge.transpose();
  for (Index a = 0; a < q.cols(); ++a) slopes.middleCols(a * d, d) *= motion.linear;
  return slopes;
}

MatrixXd Pose::slopes(const MatrixXd& rows, const Points& q) const { return slopes(kind_, gauge_, rows, q); }

VectorXd Pose::size(const Points& q) const {
  if (sizes() == 0) return {};
  return size_rows_ * (motion(AlignmentKind::kRigid, q).linear * q).reshaped();
}

MatrixXd Pose::size_slopes(const Points& q) const {
  if (sizes() == 0) return MatrixXd::Zero(0, q.size());
  return slopes(AlignmentKind::kRigid, turning_, size_rows_, q);
}

}  // namespace pulson::posterior
