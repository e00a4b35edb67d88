#include "landmark_law.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include <Eigen/Cholesky>
#include <Eigen/QR>

#include "pulson/core/alignment.hpp"
#include "pulson/kernels/kernel_operator.hpp"

namespace pulson::audit {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// The grid: widths in diameters, and the part of the variance that neighbours share.
constexpr std::array kWidths = {0.1, 0.2, 0.4, 0.8, 1.6};
constexpr std::array kShared = {0.5, 0.8, 0.95, 0.99};
// Landmarks of one shape differ from where the others predict them more often by much than a normal law says; a pair
// shows no tail of its own. Of 300 pairs of three published cohorts none is accused with 4, and one with 8.
constexpr double kTailOfPairs = 4;
// Of yᵀPy, in squared diameters: below it is rounding.
constexpr double kRounding = 1e-13;

MatrixXd motions_of(const Points& shape) {
  std::vector<Index> all(static_cast<std::size_t>(shape.size()));
  std::iota(all.begin(), all.end(), 0);
  return motion_directions(shape, AlignmentKind::kSimilarity, all);
}

// P of the covariance C ⊗ I.
LandmarkLaw::Member kernel_member(const MatrixXd& covariance, const MatrixXd& motions, Index d) {
  const Index n = covariance.rows();
  const Eigen::LLT<MatrixXd> factors(covariance);
  const MatrixXd inverse = factors.solve(MatrixXd::Identity(n, n));
  LandmarkLaw::Member member{MatrixXd::Zero(n * d, n * d), 0};
  for (Index a = 0; a < n; ++a)
    for (Index b = 0; b < n; ++b) member.precision.block(a * d, b * d, d, d).diagonal().setConstant(inverse(a, b));
  const MatrixXd weighted = member.precision * motions;
  const Eigen::LLT<MatrixXd> normal(motions.transpose() * weighted);
  member.precision -= weighted * normal.solve(weighted.transpose());
  member.log_constant = -static_cast<double>(d) * factors.matrixLLT().diagonal().array().log().sum() -
                        normal.matrixLLT().diagonal().array().log().sum();
  return member;
}

double log_student(double degrees, double dimension, double square) {
  return std::lgamma((degrees + dimension) / 2) - std::lgamma(degrees / 2) - dimension / 2 * std::log(M_PI * degrees) -
         (degrees + dimension) / 2 * std::log1p(square / degrees);
}

}  // namespace

LandmarkLaw::LandmarkLaw(Points reference, std::vector<Member> members, double directions, double degrees,
                         double offset)
    : reference_(std::move(reference)),
      members_(std::move(members)),
      directions_(directions),
      degrees_(degrees),
      offset_(offset),
      is_dropped_(static_cast<std::size_t>(reference_.cols()), false) {}

int LandmarkLaw::landmarks() const {
  return static_cast<int>(std::count(is_dropped_.begin(), is_dropped_.end(), false));
}

void LandmarkLaw::drop(int landmark) {
  const Index d = reference_.rows(), row = landmark * d;
  for (Member& member : members_) {
    const Eigen::LLT<MatrixXd> own(member.precision.block(row, row, d, d));
    const MatrixXd columns = member.precision.middleCols(row, d);
    member.precision -= columns * own.solve(columns.transpose());
    member.precision.middleCols(row, d).setZero();
    member.precision.middleRows(row, d).setZero();
    member.log_constant -= own.matrixLLT().diagonal().array().log().sum();
  }
  directions_ -= static_cast<double>(d);
  is_dropped_[static_cast<std::size_t>(landmark)] = true;
}

double LandmarkLaw::log_density(const Member& member, double square) const {
  return member.log_constant + log_factor(directions_, square);
}

// Of a Student distribution in m dimensions, up to a constant that does not depend on m.
double LandmarkLaw::log_factor(double directions, double square) const {
  const double least = offset_ > 0 ? 0 : kRounding * reference_.squaredNorm();
  return std::lgamma((degrees_ + directions) / 2) - directions / 2 * std::log(M_PI) -
         (degrees_ + directions) / 2 * std::log(offset_ + std::max(square, least));
}

double LandmarkLaw::log_density(const VectorXd& displacement) const {
  double best = -std::numeric_limits<double>::infinity();
  for (const Member& member : members_)
    best = std::max(best, log_density(member, displacement.dot(member.precision * displacement)));
  return best;
}

/// What a member says of one landmark.
struct LandmarkLaw::Block {
  VectorXd deviation;  // (P_aa)⁻¹(Py)_a
  double rest;         // yᵀPy without the landmark
  double here;         // what the landmark adds
  double log_root;     // ½ log det P_aa
  double log_density;  // of the other landmarks
};

// @param weighted Py @param square yᵀPy
LandmarkLaw::Block LandmarkLaw::block(const Member& member, int landmark, const VectorXd& weighted,
                                      double square) const {
  const Index d = reference_.rows(), row = landmark * d;
  const Eigen::LLT<MatrixXd> own(member.precision.block(row, row, d, d));
  Block block{own.solve(weighted.segment(row, d)), 0, 0, own.matrixLLT().diagonal().array().log().sum(), 0};
  block.here = block.deviation.dot(weighted.segment(row, d));
  block.rest = square - block.here;
  block.log_density =
      member.log_constant - block.log_root + log_factor(directions_ - static_cast<double>(d), block.rest);
  return block;
}

double LandmarkLaw::log_density_without(int landmark, const VectorXd& displacement) const {
  double best = -std::numeric_limits<double>::infinity();
  for (const Member& member : members_) {
    const VectorXd weighted = member.precision * displacement;
    best = std::max(best, block(member, landmark, weighted, displacement.dot(weighted)).log_density);
  }
  return best;
}

LandmarkLaw::Prediction LandmarkLaw::predict(const Block& block, int landmark) const {
  const auto d = static_cast<double>(reference_.rows());
  const double degrees = degrees_ + directions_ - d;
  const double least = offset_ > 0 ? 0 : kRounding * reference_.squaredNorm();
  const double variance = (offset_ + std::max(block.rest, least)) / degrees;  // times (P_aa)⁻¹
  const double scale = tail_.scales.size() > 0 ? tail_.scales[landmark] : 1;
  const double log_density =
      log_student(tail_.degrees > 0 ? tail_.degrees : degrees, d, block.here / variance / scale) -
      d / 2 * std::log(variance * scale) + block.log_root;
  return {log_density, block.log_density, block.deviation, std::sqrt(variance * scale) * std::exp(-block.log_root / d),
          std::sqrt(std::max(block.here, 0.0) / variance / scale)};
}

std::vector<LandmarkLaw::Prediction> LandmarkLaw::predict(const VectorXd& displacement) const {
  std::vector<Block> best(is_dropped_.size());
  std::vector<double> most(best.size(), -std::numeric_limits<double>::infinity());
  for (const Member& member : members_) {
    const VectorXd weighted = member.precision * displacement;
    const double square = displacement.dot(weighted);
    for (std::size_t a = 0; a < best.size(); ++a) {
      if (is_dropped_[a]) continue;
      Block here = block(member, static_cast<int>(a), weighted, square);
      if (here.log_density > most[a]) most[a] = here.log_density, best[a] = std::move(here);
    }
  }
  std::vector<Prediction> predictions(best.size());
  for (std::size_t a = 0; a < best.size(); ++a) {
    if (is_dropped_[a]) continue;
    predictions[a] = predict(best[a], static_cast<int>(a));
  }
  return predictions;
}

std::vector<MatrixXd> kernel_covariances(const Points& reference) {
  const Index n = reference.cols();
  const double size = diameter(reference);
  std::vector<MatrixXd> covariances = {MatrixXd::Identity(n, n)};
  for (const double width : kWidths) {
    const MatrixXd gram = KernelOperator({{KernelProfile::kMatern32, width * size}}).gram(reference, reference);
    for (const double shared : kShared)
      covariances.emplace_back(shared * gram + (1 - shared) * MatrixXd::Identity(n, n));
  }
  return covariances;
}

LandmarkLaw pair_law(const Points& reference) {
  const MatrixXd motions = motions_of(reference);
  std::vector<LandmarkLaw::Member> members;
  for (const MatrixXd& covariance : kernel_covariances(reference))
    members.push_back(kernel_member(covariance, motions, reference.rows()));
  LandmarkLaw law(reference, std::move(members), static_cast<double>(reference.size() - motions.cols()), 0, 0);
  law.set_tail({.degrees = kTailOfPairs, .scales = {}});
  return law;
}

MatrixXd directions_of_shape(const Points& reference) {
  const MatrixXd motions = motions_of(reference);
  const Eigen::HouseholderQR<MatrixXd> factors(motions);
  const MatrixXd all = factors.householderQ() * MatrixXd::Identity(reference.size(), reference.size());
  return all.rightCols(reference.size() - motions.cols());
}

}  // namespace pulson::audit
