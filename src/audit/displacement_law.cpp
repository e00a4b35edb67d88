#include "displacement_law.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include <Eigen/Cholesky>

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
// Of y'Py, over that of the displacement itself: below it is rounding.
constexpr double kRounding = 1e-13;

MatrixXd motions_of(const Points& shape) {
  std::vector<Index> all(static_cast<std::size_t>(shape.size()));
  std::iota(all.begin(), all.end(), 0);
  return motion_directions(shape, AlignmentKind::kSimilarity, all);
}

}  // namespace

DisplacementLaw::DisplacementLaw(const Points& reference) : reference_(reference) {
  const Index n = reference.cols(), d = reference.rows();
  const MatrixXd motions = motions_of(reference);
  const double size = diameter(reference);
  const auto add = [&](const MatrixXd& covariance) {
    const Eigen::LLT<MatrixXd> factors(covariance);
    Member member{factors.solve(MatrixXd::Identity(n, n)), {}, 0};
    MatrixXd weighted(motions.rows(), motions.cols());  // C⁻¹X
    for (Index k = 0; k < motions.cols(); ++k)
      weighted.col(k) = (motions.col(k).reshaped(d, n) * member.inverse).reshaped();
    const Eigen::LLT<MatrixXd> normal(motions.transpose() * weighted);
    member.directions = normal.matrixL().solve(weighted.transpose()).transpose();
    member.log_determinants = -static_cast<double>(d) * factors.matrixLLT().diagonal().array().log().sum() -
                              normal.matrixLLT().diagonal().array().log().sum();
    members_.push_back(std::move(member));
  };
  add(MatrixXd::Identity(n, n));
  for (const double width : kWidths) {
    const MatrixXd gram = KernelOperator({{KernelProfile::kMatern32, width * size}}).gram(reference, reference);
    for (const double shared : kShared) add(shared * gram + (1 - shared) * MatrixXd::Identity(n, n));
  }
}

double DisplacementLaw::half_degrees() const {
  return 0.5 * static_cast<double>(reference_.size() - members_.front().directions.cols());
}

Points DisplacementLaw::projected(const Member& member, const Points& displacement) const {
  const VectorXd along = member.directions.transpose() * displacement.reshaped();
  return displacement * member.inverse - (member.directions * along).reshaped(displacement.rows(), displacement.cols());
}

double DisplacementLaw::log_likelihood(const Points& shape) const {
  const Points y = shape - reference_;
  const double least = kRounding * reference_.squaredNorm();
  double best = -std::numeric_limits<double>::infinity();
  for (const Member& member : members_) {
    const double square = std::max(y.cwiseProduct(projected(member, y)).sum(), least);
    best = std::max(best, member.log_determinants - half_degrees() * std::log(square));
  }
  return best;
}

Exchange DisplacementLaw::best_exchange(const Points& shape) const {
  const Points y = shape - reference_;
  const double least = kRounding * reference_.squaredNorm();
  const Index n = shape.cols(), d = shape.rows();
  Exchange best;
  best.log_likelihood = -std::numeric_limits<double>::infinity();
  for (const Member& member : members_) {
    const Points py = projected(member, y);
    const double square = y.cwiseProduct(py).sum();
    for (Index b = 1; b < n; ++b)
      for (Index a = 0; a < b; ++a) {
        const VectorXd t = shape.col(b) - shape.col(a);
        const VectorXd along =
            (member.directions.middleRows(a * d, d) - member.directions.middleRows(b * d, d)).transpose() * t;
        const double own = member.inverse(a, a) + member.inverse(b, b) - 2 * member.inverse(a, b);
        const double changed = square + 2 * t.dot(py.col(a) - py.col(b)) + t.squaredNorm() * own - along.squaredNorm();
        const double here = member.log_determinants - half_degrees() * std::log(std::max(changed, least));
        if (here > best.log_likelihood) best = {static_cast<int>(a), static_cast<int>(b), here};
      }
  }
  return best;
}

}  // namespace pulson::audit
