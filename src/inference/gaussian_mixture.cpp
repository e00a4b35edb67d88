#include "gaussian_mixture.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

namespace pulson::inference {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kOfPriorLaw = 0.1, kOfAll = 0.1;
constexpr Index kClusters = 10;  // with 24 as few draws were effective of three hard problems of posterior_trial.py
constexpr int kTurnsOfClusters = 8;
// Covariances are larger than those of the points, as weights of a proposal that is too narrow have no bound. With the
// law of all, of a swap that is far (`swap-far`), Pareto's k was 0.65, and without 1.07.
constexpr double kLawInflation = 1.3, kInflationOfAll = 2;
constexpr double kLeastVariance = 1e-10;  // of unknowns whose variance a priori is 1

MatrixXd covariance_of(const MatrixXd& points, const ArrayXd& weights, const VectorXd& centre) {
  const MatrixXd scaled = (points.colwise() - centre) * weights.sqrt().matrix().asDiagonal();
  return scaled * scaled.transpose() / weights.sum();
}

// Points at equal parts of the summed weights.
MatrixXd first_centres(const MatrixXd& points, const ArrayXd& weights) {
  MatrixXd centres(points.rows(), std::min(kClusters, points.cols()));
  double below = 0;
  Index c = 0;
  for (Index i = 0; i < points.cols() && c < centres.cols(); ++i) {
    below += weights[i];
    for (; c < centres.cols() && below >= (static_cast<double>(c) + 0.5) / static_cast<double>(centres.cols()); ++c)
      centres.col(c) = points.col(i);
  }
  for (; c < centres.cols(); ++c) centres.col(c) = points.rightCols(1);
  return centres;
}

// Lloyd's algorithm. @return the cluster of each point
std::vector<Index> clusters_of(const MatrixXd& points, const ArrayXd& weights) {
  MatrixXd centres = first_centres(points, weights);
  std::vector<Index> nearest(static_cast<std::size_t>(points.cols()));
  for (int turn = 0; turn < kTurnsOfClusters; ++turn) {
    const MatrixXd products = centres.transpose() * points;
    const VectorXd squares = 0.5 * centres.colwise().squaredNorm();
    MatrixXd sums = MatrixXd::Zero(centres.rows(), centres.cols());
    VectorXd all = VectorXd::Zero(centres.cols());
    for (Index i = 0; i < points.cols(); ++i) {
      Index& c = nearest[static_cast<std::size_t>(i)];
      (products.col(i) - squares).maxCoeff(&c);
      sums.col(c) += weights[i] * points.col(i);
      all[c] += weights[i];
    }
    for (Index c = 0; c < centres.cols(); ++c)
      if (all[c] > 0) centres.col(c) = sums.col(c) / all[c];
  }
  return nearest;
}

}  // namespace

GaussianMixture::GaussianMixture(const MatrixXd& points, const ArrayXd& weights) {
  const Index unknowns = points.rows();
  const MatrixXd least = kLeastVariance * MatrixXd::Identity(unknowns, unknowns);
  const VectorXd mean = points * weights.matrix();
  const MatrixXd overall = covariance_of(points, weights, mean) + least;
  const MatrixXd white = Eigen::LLT<MatrixXd>(overall).matrixL().solve(points);
  const std::vector<Index> nearest = clusters_of(white, weights);
  std::vector<std::vector<Index>> members(kClusters);
  for (Index i = 0; i < points.cols(); ++i)
    members[static_cast<std::size_t>(nearest[static_cast<std::size_t>(i)])].push_back(i);
  double rest = 1;
  for (const std::vector<Index>& of : members) {
    if (of.size() < 2) continue;
    const ArrayXd mine = weights(of);
    const MatrixXd there = points(Eigen::all, of);
    const double sum = mine.sum(), effective = sum * sum / mine.square().sum();
    const VectorXd centre = there * (mine / sum).matrix();
    // As though so many points of all clusters were among them.
    const double shrink = 2 * static_cast<double>(unknowns) / (effective + 2 * static_cast<double>(unknowns));
    const MatrixXd covariance =
        kLawInflation * ((1 - shrink) * covariance_of(there, mine, centre) + shrink * overall) + least;
    const MatrixXd root = Eigen::LLT<MatrixXd>(covariance).matrixL();
    const double weight = (1 - kOfPriorLaw - kOfAll) * sum;
    rest -= weight;
    laws_.push_back({std::log(weight), centre, root, root.diagonal().array().log().sum()});
  }
  const MatrixXd root = Eigen::LLT<MatrixXd>(kInflationOfAll * overall).matrixL();
  laws_.push_back({std::log(kOfAll), mean, root, root.diagonal().array().log().sum()});
  rest -= kOfAll;
  laws_.push_back({std::log(rest), VectorXd::Zero(unknowns), MatrixXd::Identity(unknowns, unknowns), 0});
}

MatrixXd GaussianMixture::draw(const VectorXd& uniforms, const MatrixXd& normals) const {
  MatrixXd z(normals.rows(), normals.cols());
  for (Index i = 0; i < z.cols(); ++i) {
    double below = 0;
    std::size_t k = 0;
    for (; k + 1 < laws_.size(); ++k) {
      below += std::exp(laws_[k].log_weight);
      if (uniforms[i] < below) break;
    }
    z.col(i) = laws_[k].centre;
    z.col(i).noalias() += laws_[k].root.triangularView<Eigen::Lower>() * normals.col(i);
  }
  return z;
}

VectorXd GaussianMixture::log_densities(const MatrixXd& z) const {
  Eigen::ArrayXXd logs(std::ssize(laws_), z.cols());
  for (std::size_t k = 0; k < laws_.size(); ++k) {
    const Law& law = laws_[k];
    MatrixXd white = z.colwise() - law.centre;
    law.root.triangularView<Eigen::Lower>().solveInPlace(white);
    logs.row(static_cast<Index>(k)) =
        law.log_weight - law.log_determinant - 0.5 * white.colwise().squaredNorm().array();
  }
  const Eigen::RowVectorXd top = logs.colwise().maxCoeff();
  const Eigen::RowVectorXd sums = (logs.matrix().rowwise() - top).array().exp().colwise().sum().log();
  return (top + sums).transpose() + 0.5 * z.colwise().squaredNorm().transpose();
}

}  // namespace pulson::inference
