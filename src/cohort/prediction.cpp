#include "pulson/cohort/prediction.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "core/factorisations.hpp"
#include "displacement_fit.hpp"
#include "matching/maximum.hpp"
#include "posed_shapes.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson::cohort {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kPredictorRounds = 100;
constexpr double kCovarianceSettled = 1e-3;  // change of the covariance, of its size: bands change by half as much
constexpr std::size_t kParts = 10;           // in which specimens are left out by turns
constexpr double kCentral = 0.9;             // of a coordinate, within the band

// log Γ_m(x), but for a constant
double log_gamma(Index m, double x) {
  double sum = 0;
  for (Index j = 0; j < m; ++j) sum += std::lgamma(x - 0.5 * static_cast<double>(j));
  return sum;
}

// The weight δ and scale s of the prior with the greatest marginal likelihood of a scatter with n degrees of freedom,
// whose eigenvalues in the metric V⁻¹ are `scatter`.
struct PriorFit {
  double weight, scale;

  PriorFit(double given_weight, double given_scale) : weight(given_weight), scale(given_scale) {}

  PriorFit(const VectorXd& scatter, double n) {
    const Index m = scatter.size();
    const auto log_marginal = [&](const VectorXd& logs) {
      const double delta = std::exp(logs[0]), nu = delta + static_cast<double>(m) + 1;
      const auto dimension = static_cast<double>(m);
      return 0.5 * nu * dimension * logs[0] - 0.5 * n * dimension * logs[1] -
             0.5 * (nu + n) * (delta + scatter.array() * std::exp(-logs[1])).log().sum() + log_gamma(m, (nu + n) / 2) -
             log_gamma(m, nu / 2);
    };
    // Weights from a twentieth of a specimen to a million; scales about that of the scatter.
    constexpr double kLeast = -3, kMost = 14, kScales = 1.5;
    const double middle = std::log(std::max(scatter.sum() / (n * static_cast<double>(m)), 1e-300));
    const matching::Box box{VectorXd{{kLeast, middle - kScales}}, VectorXd{{kMost, middle + kScales}}};
    const VectorXd found = maximise_from_grid(log_marginal, box, {18, 3}).x;
    weight = std::exp(found[0]);
    scale = std::exp(found[1]);
  }
};

}  // namespace

// The law of the shapes, and what it is known from.
struct ShapePredictor::Fit {
  AlignmentKind alignment;
  PosedShapes law;
  double prior_weight = 1, prior_scale = 1;
  double specimens = 0;
  VectorXd observed{};         // specimens that have a landmark, N
  MatrixXd mean_covariance{};  // of the estimated mean, dN×dN

  void maximise(const MatrixXd& prior, const ExpectedShapes& expected);
  void find_mean_covariance(const std::vector<Points>& placed);
  MatrixXd covariance_by_mean(const PosedShapes::Conditional& found) const;
};

void ShapePredictor::Fit::maximise(const MatrixXd& prior, const ExpectedShapes& expected) {
  const auto n = static_cast<double>(expected.complete.size());
  const MatrixXd basis = law.basis();
  MatrixXd displacements(basis.rows(), static_cast<Index>(expected.complete.size()));
  for (std::size_t i = 0; i < expected.complete.size(); ++i)
    displacements.col(static_cast<Index>(i)) = (expected.complete[i] - law.mean()).reshaped();
  MatrixXd free = basis.transpose() * displacements;
  free.colwise() -= free.rowwise().mean().eval();
  const MatrixXd scatter = free * free.transpose() + basis.transpose() * expected.uncertain * basis;
  const MatrixXd v = basis.transpose() * prior * basis;
  const Eigen::LLT<MatrixXd> factors(v);
  const MatrixXd half = factors.matrixL().solve(scatter);
  const MatrixXd whitened = factors.matrixL().solve(half.transpose());
  const VectorXd values = Eigen::SelfAdjointEigenSolver<MatrixXd>(whitened, Eigen::EigenvaluesOnly).eigenvalues();
  // One shape alone has no scatter: the prior is that of the atlas, which as many coordinates determined as one
  // displacement from its mean has.
  const PriorFit fit = n > 1 ? PriorFit(values.cwiseMax(0), n - 1) : PriorFit{static_cast<double>(basis.cols()), 1};
  prior_weight = fit.weight;
  prior_scale = fit.scale;
  const MatrixXd covariance = (fit.weight * fit.scale * v + scatter) / (fit.weight + n - 1);
  law = PosedShapes(updated_mean(law, expected.complete, alignment), alignment, basis * covariance * basis.transpose());
}

// The inverse of the information that the shapes hold of the mean. A landmark that none of them has is where the atlas
// has it: information of one shape.
void ShapePredictor::Fit::find_mean_covariance(const std::vector<Points>& placed) {
  const MatrixXd& basis = law.basis();
  const MatrixXd free = basis.transpose() * law.covariance() * basis;
  const Index n = law.mean().cols();
  observed = VectorXd::Zero(n);
  MatrixXd information = MatrixXd::Zero(free.rows(), free.cols());
  double complete = 0;
  for (const Points& shape : placed) {
    for (Index a = 0; a < n; ++a) observed[a] += shape.col(a).allFinite() ? 1 : 0;
    if (shape.allFinite()) {
      complete += 1;
      continue;
    }
    const PosedShapes::Conditional found = law.condition(shape);
    const MatrixXd part = basis(found.observed, Eigen::all);
    information += part.transpose() * found.information * part;
  }
  if (observed.minCoeff() < 1) complete += 1;
  const MatrixXd identity = MatrixXd::Identity(free.rows(), free.cols());
  if (complete > 0) information += complete * free.llt().solve(identity);
  mean_covariance = basis * information.llt().solve(identity) * basis.transpose();
}

// The covariance of predictions by the mean's: of an error e of the mean they have e_M − W e_O.
MatrixXd ShapePredictor::Fit::covariance_by_mean(const PosedShapes::Conditional& found) const {
  const auto& present = found.observed;
  const auto& missing = found.missing;
  const MatrixXd across = found.weights * mean_covariance(present, missing);
  return mean_covariance(missing, missing) - across - across.transpose() +
         found.weights * mean_covariance(present, present) * found.weights.transpose();
}

void ShapePredictor::fit(const Atlas& atlas, const std::vector<Points>& shapes) {
  const SerialBlas serial;
  const Points& start = atlas.mean.points;
  const MatrixXd prior = displacement_covariance(atlas.kernel, atlas.lambda, atlas.sigma, start);
  const auto found = std::make_shared<Fit>(Fit{atlas.alignment, PosedShapes(start, atlas.alignment, prior)});
  std::vector<Points> placed = shapes;
  for (int round = 0; round < kPredictorRounds; ++round) {
    const MatrixXd before = found->law.covariance();
    ExpectedShapes expected = expected_shapes(found->law, placed);
    found->maximise(prior, expected);
    placed = std::move(expected.placed);
    if ((found->law.covariance() - before).norm() <= kCovarianceSettled * before.norm()) break;
  }
  found->specimens = static_cast<double>(shapes.size());
  found->find_mean_covariance(placed);
  fit_ = found;
}

double ShapePredictor::prior_weight() const { return fit_->prior_weight; }
double ShapePredictor::prior_scale() const { return fit_->prior_scale; }
const Points& ShapePredictor::mean() const { return fit_->law.mean(); }
const MatrixXd& ShapePredictor::covariance() const { return fit_->law.covariance(); }

ShapePredictor::ShapePredictor(const Atlas& atlas) {
  std::vector<Points> shapes;
  for (const AtlasSpecimen& specimen : atlas.specimens) shapes.push_back(specimen.without_suspects());
  fit(atlas, shapes);
}

ShapePredictor::ShapePredictor(const Atlas& atlas, const std::vector<Points>& shapes) { fit(atlas, shapes); }

PredictedLandmarks ShapePredictor::predict(const Landmarks& shape) const {
  const PosedShapes& law = fit_->law;
  Landmarks mean;
  mean.points = law.mean();
  mean.source = "the atlas";
  require_alike(mean, shape);
  PredictedLandmarks predicted;
  Points points = shape.points;
  predicted.landmarks = missing_landmarks(shape);
  const std::vector<int> incomplete = incomplete_points(points);
  for (const int a : incomplete) points.col(a).setConstant(std::nan(""));
  const Index d = points.rows(), left = points.cols() - std::ssize(incomplete);
  const Index parameters = law.directions().cols();
  if (d * left <= parameters)
    throw InputError(
        fmt::format("{}: {} landmarks are not missing; the alignment alone needs more", shape.source, left));
  const Alignment map = law.placing(points), back = inverted(map);
  const PosedShapes::Conditional found = law.condition(map.apply(points));
  predicted.positions.resize(d, std::ssize(predicted.landmarks));
  predicted.half_widths.resize(d, std::ssize(predicted.landmarks));
  if (predicted.landmarks.empty()) return predicted;
  const MatrixXd covariance = found.covariance + fit_->covariance_by_mean(found);
  const double distance = found.distance / (1 + 1 / fit_->specimens);
  const auto count = static_cast<double>(std::ssize(found.observed) - parameters);
  for (Index k = 0; k < predicted.positions.cols(); ++k) {
    const int a = predicted.landmarks[static_cast<std::size_t>(k)];
    const Index at = d * (std::lower_bound(incomplete.begin(), incomplete.end(), a) - incomplete.begin());
    predicted.positions.col(k) = back.apply(law.mean().col(a) + found.displacement.segment(at, d));
    // Student's distribution of a landmark given others: with ν = δ + m + 1 as many degrees as there are shapes with
    // this landmark, and a scale by how much this shape is more or less unusual than most.
    const double degrees = fit_->prior_weight + fit_->observed[a] + 1 + count;
    const double unusual = (std::max(degrees - count - 2, 0.0) + distance) / degrees;
    const MatrixXd scale = unusual * back.linear * covariance.block(at, at, d, d) * back.linear.transpose();
    predicted.half_widths.col(k) =
        student_quantile(0.5 * (1 + kCentral), degrees) * back.scale * scale.diagonal().cwiseMax(0).cwiseSqrt();
  }
  return predicted;
}

std::vector<PredictedLandmarks> predict_missing(const Atlas& atlas, const std::vector<Landmarks>& shapes) {
  const SerialBlas serial;
  std::vector<std::size_t> incomplete;
  for (std::size_t i = 0; i < shapes.size(); ++i)
    if (!missing_landmarks(shapes[i]).empty()) incomplete.push_back(i);
  std::vector<PredictedLandmarks> predicted(shapes.size());
  const std::size_t parts = std::min(kParts, incomplete.size());
  parallel_for(static_cast<int>(parts), [&](int part) {
    std::vector<bool> left_out(shapes.size());
    for (auto k = static_cast<std::size_t>(part); k < incomplete.size(); k += parts) left_out[incomplete[k]] = true;
    std::vector<Points> others;
    for (std::size_t i = 0; i < shapes.size(); ++i)
      if (!left_out[i]) others.push_back(atlas.specimens[i].without_suspects());
    const ShapePredictor predictor(atlas, others);
    for (std::size_t i = 0; i < shapes.size(); ++i)
      if (left_out[i]) predicted[i] = predictor.predict(shapes[i]);
  });
  return predicted;
}

}  // namespace pulson::cohort
