#include "robust_model.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <Eigen/Cholesky>

#include "pulson/core/parallel.hpp"

namespace pulson::cohort {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index kCoordinatesKept = 4;  // of each shape, beyond the directions of the alignment
constexpr int kMostRobustRounds = 40;
constexpr double kModelSettled = 0.005;  // difference(): a quarter of the standard error of log σ from 1000 numbers

// Of the numbers that are not NaN; 0 where there are none.
double known_median(const MatrixXd& values) {
  std::vector<double> known;
  for (const double value : values.reshaped())
    if (!std::isnan(value)) known.push_back(value);
  if (known.empty()) return 0;
  const auto middle = known.begin() + std::ssize(known) / 2;
  std::nth_element(known.begin(), middle, known.end());
  return *middle;
}

// c of each landmark. @param squares t² with c = 1, N×n
VectorXd landmark_scales(const MatrixXd& squares, Index d, std::optional<double> least) {
  const double normal = matching::kMedianSquare.at(static_cast<std::size_t>(d - 1));
  VectorXd scales(squares.rows());
  const double all = least ? *least : known_median(squares) / normal;
  for (Index a = 0; a < scales.size(); ++a) scales[a] = std::max(all, known_median(squares.row(a)) / normal);
  return scales;
}

}  // namespace

// Of the landmarks of one shape.
struct RobustShapes::Prediction {
  Alignment placing;
  Points placed, complete;      // with what is expected where a landmark does not count
  VectorXd squares;             // t² with c = 1; NaN where the landmark is missing
  std::vector<Index> left_out;  // places of the landmarks that do not count, or are missing
  MatrixXd covariance;          // of these
};

RobustShapes::RobustShapes(const matching::RobustLoss& loss, const Points& mean, std::size_t count)
    : dimension_(mean.rows()), weight_(loss, dimension_), weights_(count, VectorXd::Ones(mean.cols())) {}

void RobustShapes::take(const matching::RobustLoss& loss) { weight_ = matching::LossWeight(loss, dimension_); }

VectorXd RobustShapes::precision(std::size_t shape) const {
  const VectorXd& weights = weights_[shape];
  return (weights.array() < matching::kSuspectWeight).select(0, weights / weight_.consistency());
}

RobustShapes::Prediction RobustShapes::predict(const PosedShapes& law, const Points& shape, std::size_t i) const {
  const VectorXd given = precision(i);
  const Index d = shape.rows();
  Prediction made;
  made.placing = law.placing(shape, given);
  made.placed = made.placing.apply(shape);
  made.complete = made.placed;
  made.squares = VectorXd::Constant(shape.cols(), std::nan(""));
  PosedShapes::Conditional found = law.condition(made.placed, given);
  const VectorXd pr = found.information * (made.placed - law.mean()).reshaped()(found.observed);
  const auto square = [](const VectorXd& residual, const MatrixXd& covariance) {
    return residual.dot(covariance.ldlt().solve(residual));
  };
  for (Index at = 0; at < std::ssize(found.observed); at += d) {
    const Index a = found.observed[static_cast<std::size_t>(at)] / d;
    const MatrixXd whole = found.information.block(at, at, d, d).inverse();
    made.squares[a] =
        square(whole * pr.segment(at, d), whole + law.noise() * (1 - 1 / given[a]) * MatrixXd::Identity(d, d));
  }
  for (Index at = 0; at < std::ssize(found.missing); at += d) {
    const Index a = found.missing[static_cast<std::size_t>(at)] / d;
    made.complete.col(a) = law.mean().col(a) + found.displacement.segment(at, d);
    if (shape.col(a).allFinite())
      made.squares[a] = square(made.placed.col(a) - made.complete.col(a), found.covariance.block(at, at, d, d));
  }
  made.left_out = std::move(found.missing);
  made.covariance = std::move(found.covariance);
  return made;
}

ExpectedShapes RobustShapes::update(const PosedShapes& law, const std::vector<Points>& shapes,
                                    std::optional<double> least) {
  const Index size = law.mean().size();
  std::vector<Prediction> made(shapes.size());
  MatrixXd squares(law.mean().cols(), std::ssize(shapes));
  parallel_for(static_cast<int>(shapes.size()), [&](int i) {
    const auto s = static_cast<std::size_t>(i);
    made[s] = predict(law, shapes[s], s);
    squares.col(i) = made[s].squares;
  });
  const VectorXd scales = landmark_scales(squares, law.mean().rows(), least);
  ExpectedShapes expected;
  expected.uncertain = MatrixXd::Zero(size, size);
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const VectorXd next = made[i].squares.cwiseQuotient(scales).unaryExpr(
        [&](double square) { return std::isnan(square) ? 1 : weight_(square); });
    const auto counted = (next.array() >= matching::kSuspectWeight && !made[i].squares.array().isNaN()).count();
    if (law.mean().rows() * counted >= law.directions().cols() + kCoordinatesKept) weights_[i] = next;
    expected.uncertain(made[i].left_out, made[i].left_out) += made[i].covariance;
    expected.placed.push_back(std::move(made[i].placed));
    expected.complete.push_back(std::move(made[i].complete));
    expected.placings.push_back(std::move(made[i].placing));
  }
  return expected;
}

std::vector<Points> settle(RobustShapes& robust, const std::vector<Points>& shapes, Points mean,
                           const CohortFitOptions& options, std::optional<double> least, CohortDisplacements& model) {
  ExpectedShapes expected;
  for (int round = 0; round < kMostRobustRounds; ++round) {
    const PosedShapes law(mean, options.alignment,
                          displacement_covariance(model.kernel, model.lambda, model.sigma, mean),
                          model.sigma * model.sigma);
    expected = robust.update(law, shapes, least);
    mean = updated_mean(law, expected.complete, options.alignment);
    const CohortDisplacements before =
        std::exchange(model, fit_cohort_displacements(expected.complete, expected.uncertain, options));
    if (difference(before, model, mean) <= kModelSettled) break;
  }
  for (std::size_t i = 0; i < shapes.size(); ++i)
    expected.complete[i] = inverted(expected.placings[i]).apply(expected.complete[i]);
  return expected.complete;
}

}  // namespace pulson::cohort
