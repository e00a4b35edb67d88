#include "pulson/matching/landmark_predictions.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include <fmt/core.h>

#include "core/factorisations.hpp"
#include "core/landmark_pairs.hpp"
#include "core/text.hpp"
#include "displacement_likelihood.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kQuantile = 0.999;
constexpr Index kMostKnown = 512;
constexpr int kMostRefits = 4;

// P(χ_d > x), in closed form.
double chi_tail(int d, double x) {
  const double tail = std::erfc(x / std::numbers::sqrt2), density = std::exp(-x * x / 2);
  if (d == 1) return tail;
  return d == 2 ? density : tail + std::sqrt(2 / std::numbers::pi) * x * density;
}

// P(χ_d > x √(χ_m²/m)), the regularised incomplete beta function I_w(a, b) with w = 1/(1 + x²/m), a = m/2, b = d/2, as
// w^a/(a B(a, b)) ∫ e^{−y} (1 − w e^{−y/a})^{b−1} dy over y > 0, by Simpson's rule.
double student_tail(int d, double m, double x) {
  constexpr int kIntervals = 400;
  constexpr double kEnd = 40;  // e^{−40} is rounding
  const double w = 1 / (1 + x * x / m), a = m / 2, b = d / 2.0, step = kEnd / kIntervals;
  double sum = 0;
  for (int i = 0; i <= kIntervals; ++i) {
    const double y = i * step, weight = i == 0 || i == kIntervals ? 1 : i % 2 == 1 ? 4 : 2;
    sum += weight * std::exp(-y) * std::pow(1 - w * std::exp(-y / a), b - 1);
  }
  const double log_beta = std::lgamma(a) + std::lgamma(b) - std::lgamma(a + b);
  return std::exp(a * std::log(w) - std::log(a) - log_beta) * sum * step / 3;
}

// x with 0.999^{1/count} below it. @param tail P(· > x), falling
template <class Tail>
double largest_of(Index count, const Tail& tail) {
  const double part = -std::expm1(std::log(kQuantile) / static_cast<double>(count));
  double low = 1, high = 2;
  while (tail(high) > part) low = high, high *= 2;
  while (high - low > 1e-9 * high) {
    const double middle = (low + high) / 2;
    (tail(middle) > part ? low : high) = middle;
  }
  return high;
}

std::vector<Index> others_than(const std::vector<Index>& sorted, Index count) {
  std::vector<Index> all(static_cast<std::size_t>(count)), others;
  std::iota(all.begin(), all.end(), 0);
  std::set_difference(all.begin(), all.end(), sorted.begin(), sorted.end(), std::back_inserter(others));
  return others;
}

// Of coordinates a·d + axis, those of these landmarks.
std::vector<Index> coordinates_of(const std::vector<Index>& landmarks, Index d) {
  std::vector<Index> all;
  for (const Index a : landmarks)
    for (Index axis = 0; axis < d; ++axis) all.push_back(a * d + axis);
  return all;
}

// (A ⊗ I) columns, A of landmarks.
MatrixXd times(const MatrixXd& a, const MatrixXd& columns, Index d) {
  MatrixXd result(a.rows() * d, columns.cols());
  for (Index i = 0; i < columns.cols(); ++i)
    result.col(i) = (columns.col(i).reshaped(d, a.cols()) * a.transpose()).reshaped();
  return result;
}

std::vector<Index> observed_landmarks(const Registration& match) {
  std::vector<Index> observed;
  for (Index a = 0; a < match.source.points.cols(); ++a)
    if (match.target.points.col(a).allFinite()) observed.push_back(a);
  return observed;
}

std::vector<Index> every_few(const std::vector<Index>& all) {
  if (std::ssize(all) <= kMostKnown) return all;
  std::vector<Index> few;
  for (Index i = 0; i < kMostKnown; ++i) few.push_back(all[static_cast<std::size_t>(i * std::ssize(all) / kMostKnown)]);
  return few;
}

std::vector<int> beyond(const VectorXd& values, double limit) {
  std::vector<int> found;
  for (Index a = 0; a < values.size(); ++a)
    if (values[a] > limit) found.push_back(static_cast<int>(a));
  return found;
}

void require_law(int d, Index count) {
  if (d < 1 || d > 3 || count < 1) throw InputError("the largest of chi needs 1 to 3 dimensions and a number of them");
}

// Without the landmarks listed, as if they were not observed.
Points hidden(Points target, const std::vector<int>& landmarks) {
  for (const int a : landmarks) target.col(a).setConstant(std::nan(""));
  return target;
}

}  // namespace

double largest_of_chi(int d, Index count) {
  require_law(d, count);
  return largest_of(count, [d](double x) { return chi_tail(d, x); });
}

double largest_of_student(int d, Index count, double degrees) {
  require_law(d, count);
  require_positive("degrees of freedom", degrees);
  return largest_of(count, [&](double x) { return student_tail(d, degrees, x); });
}

double LandmarkPredictions::weighted_error(const VectorXd& weights) const {
  double sum = 0, all = 0;
  for (Index a = 0; a < residuals.cols(); ++a) {
    if (weights[a] == 0 || !residuals.col(a).allFinite()) continue;
    sum += weights[a] * residuals.col(a).squaredNorm();
    all += weights[a];
  }
  return std::sqrt(sum / all);
}

double LandmarkPredictions::error(const std::vector<int>& without) const {
  VectorXd weights = VectorXd::Ones(residuals.cols());
  weights(without).setZero();
  return weighted_error(weights);
}

VectorXd LandmarkPredictions::over_sigma() const {
  VectorXd parts(residuals.cols());
  for (Index a = 0; a < parts.size(); ++a)
    parts[a] =
        residuals.col(a).allFinite()
            ? std::sqrt(residuals.col(a).dot(covariances[static_cast<std::size_t>(a)].ldlt().solve(residuals.col(a))))
            : std::nan("");
  return parts;
}

DisplacementNoise::DisplacementNoise(double variance, const std::vector<MatrixXd>& each, const VectorXd& weights)
    : variances(weights.size()), covariances(each) {
  for (Index a = 0; a < weights.size(); ++a) {
    const double weight = weights[a] > 0 ? weights[a] : 1;
    variances[a] = variance / weight;
    if (!covariances.empty()) covariances[static_cast<std::size_t>(a)] /= weight;
  }
}

MatrixXd DisplacementNoise::of(Index landmark, Index d) const {
  if (covariances.empty()) return variances[landmark] * MatrixXd::Identity(d, d);
  return covariances[static_cast<std::size_t>(landmark)];
}

namespace {

/// V⁻¹ of the known landmarks: n×n of each axis where the noise is the same on all of them, else dn×dn.
class InverseCovariance {
 public:
  InverseCovariance(const KnownDisplacements& from, const MatrixXd& gram)
      : d_(from.shape.rows()), is_of_each_axis_(from.noise.covariances.empty()) {
    MatrixXd v = is_of_each_axis_ ? gram : on_each_axis(gram, d_);
    for (Index i = 0; i < gram.rows(); ++i) {
      const Index a = from.known[static_cast<std::size_t>(i)];
      if (is_of_each_axis_)
        v(i, i) += from.noise.variances[a];
      else
        v.block(i * d_, i * d_, d_, d_) += from.noise.of(a, d_);
    }
    inverse_ = v.llt().solve(MatrixXd::Identity(v.rows(), v.cols()));
  }

  MatrixXd operator*(const MatrixXd& columns) const { return product(inverse_, columns); }

  // Of landmark i with itself, d×d.
  MatrixXd block(Index i) const {
    if (is_of_each_axis_) return inverse_(i, i) * MatrixXd::Identity(d_, d_);
    return inverse_.block(i * d_, i * d_, d_, d_);
  }

  // CV⁻¹ for C = K of other landmarks and these: m×n of each axis, or dm×dn.
  MatrixXd weights(const MatrixXd& cross) const {
    return (is_of_each_axis_ ? cross : on_each_axis(cross, d_)) * inverse_;
  }

  // Of such weights or of V⁻¹ with columns of dn numbers.
  MatrixXd product(const MatrixXd& rows, const MatrixXd& columns) const {
    return is_of_each_axis_ ? times(rows, columns, d_) : MatrixXd(rows * columns);
  }

  // Of CV⁻¹Cᵀ that of the other landmark i, d×d.
  MatrixXd explained(const MatrixXd& weights, const MatrixXd& cross, Index i) const {
    if (is_of_each_axis_) return weights.row(i).dot(cross.row(i)) * MatrixXd::Identity(d_, d_);
    return weights.middleRows(i * d_, d_) * on_each_axis(cross.row(i), d_).transpose();
  }

 private:
  Index d_;
  bool is_of_each_axis_;
  MatrixXd inverse_;
};

}  // namespace

LandmarkPredictions predict_displacements(const KnownDisplacements& from, const std::optional<KernelOperator>& kernel) {
  const Index d = from.shape.rows(), n = std::ssize(from.known), r = from.directions.cols();
  const auto gram = [&](const Points& x, const Points& y) {
    return kernel ? kernel->gram(x, y) : MatrixXd(MatrixXd::Zero(x.cols(), y.cols()));
  };
  const Points shape = from.shape(Eigen::all, from.known);
  const MatrixXd z = from.directions(coordinates_of(from.known, d), Eigen::all);
  const VectorXd y = from.displacements(Eigen::all, from.known).reshaped();
  const InverseCovariance inverse(from, gram(shape, shape));
  const MatrixXd vz = inverse * z;  // V⁻¹Z
  const Eigen::LDLT<MatrixXd> normal(z.transpose() * vz);
  const VectorXd b = r > 0 ? VectorXd(normal.solve(vz.transpose() * y)) : VectorXd(0);
  const VectorXd py = inverse * MatrixXd(y - z * b);  // Pr
  LandmarkPredictions found{Points::Constant(d, from.shape.cols(), std::nan("")),
                            std::vector<MatrixXd>(static_cast<std::size_t>(from.shape.cols()))};
  found.square = y.dot(py);
  for (Index i = 0; i < n; ++i) {
    const MatrixXd rows = vz.middleRows(i * d, d);
    MatrixXd block = inverse.block(i);
    if (r > 0) block -= rows * normal.solve(rows.transpose());
    const MatrixXd covariance = block.ldlt().solve(MatrixXd::Identity(d, d));
    const Index a = from.known[static_cast<std::size_t>(i)];
    found.residuals.col(a) = covariance * py.segment(i * d, d);
    found.covariances[static_cast<std::size_t>(a)] = covariance;
  }
  const std::vector<Index> rest = others_than(from.known, from.shape.cols());
  if (rest.empty()) return found;
  const MatrixXd cross = gram(from.shape(Eigen::all, rest), shape);
  const MatrixXd weights = inverse.weights(cross);
  const MatrixXd zr = from.directions(coordinates_of(rest, d), Eigen::all);
  const VectorXd predicted = zr * b + times(cross, py, d);
  const MatrixXd moved = zr - inverse.product(weights, z);
  for (Index i = 0; i < std::ssize(rest); ++i) {
    const Index a = rest[static_cast<std::size_t>(i)];
    const MatrixXd rows = moved.middleRows(i * d, d);
    MatrixXd covariance = from.noise.of(a, d) - inverse.explained(weights, cross, i);
    if (kernel) covariance.diagonal().array() += kernel->at_zero();
    if (r > 0) covariance += rows * normal.solve(rows.transpose());
    found.residuals.col(a) = from.displacements.col(a) - predicted.segment(i * d, d);
    found.covariances[static_cast<std::size_t>(a)] = covariance;
  }
  return found;
}

namespace {

// In units of the diameter.
DisplacementNoise noise_of(const Registration& match, const VectorXd& weights) {
  const double area = std::pow(diameter(match.source.points), 2);
  std::vector<MatrixXd> each = match.data.covariances;
  for (MatrixXd& covariance : each) covariance /= area;
  return {match.sigma * match.sigma / area, each, weights};
}

// In place of that by which they predict others, as a loss lowers the weights of what is wrong.
void add_own_noise(LandmarkPredictions& predictions, const std::vector<Index>& known, const DisplacementNoise& among,
                   const DisplacementNoise& own) {
  const Index d = predictions.residuals.rows();
  for (const Index a : known) predictions.covariances[static_cast<std::size_t>(a)] += own.of(a, d) - among.of(a, d);
}

// In units of the diameter, as fit_displacements() has them: sums of squares stay in the range of numbers.
std::optional<PredictionOfMatch> predicted_without(const Registration& match, const std::vector<Index>& observed,
                                                   const std::vector<int>& doubted) {
  const Points& q0 = match.source.points;
  const double size = diameter(q0);
  DisplacementOptions options;
  options.alignment = match.alignment.kind;
  options.sigma = match.sigma;
  options.weights = match.data.weights;
  options.covariances = match.data.covariances;
  const VectorXd weights = landmark_weights(match.data.weights, q0.cols());
  const auto model = fit_displacements(q0, hidden(match.target.points, doubted), options);
  if (!model) return std::nullopt;
  std::vector<Index> known;
  for (const Index a : observed)
    if (weights[a] > 0 && !std::binary_search(doubted.begin(), doubted.end(), static_cast<int>(a))) known.push_back(a);
  known = every_few(known);
  std::vector<Index> all(static_cast<std::size_t>(q0.size()));
  std::iota(all.begin(), all.end(), 0);
  const Points shape = q0 / size, displacements = (match.target.points - q0) / size;
  const MatrixXd directions = motion_directions(shape, match.alignment.kind, all);
  const DisplacementNoise noise = noise_of(match, weights);
  const KnownDisplacements from{shape, displacements, directions, known, noise};
  const double variance = 1 / (model->lambda * size * size);
  const KernelTerm term{model->kernel.profile, model->kernel.alpha / size, variance};
  PredictionOfMatch found{*model, predict_displacements(from, KernelOperator({term})),
                          predict_displacements(from, std::nullopt)};
  if (match.robust) add_own_noise(found.predictions, known, noise, noise_of(match, VectorXd::Ones(q0.cols())));
  for (LandmarkPredictions* of : {&found.predictions, &found.aligned}) of->residuals *= size;
  for (MatrixXd& covariance : found.predictions.covariances) covariance *= size * size;
  const Index d = q0.rows();
  found.degrees = static_cast<double>(d * model->landmarks - directions.cols());
  found.limit = largest_of_student(static_cast<int>(d), std::ssize(observed), found.degrees - static_cast<double>(d));
  found.doubted = beyond(found.predictions.over_sigma(), found.limit);
  return found;
}

// Besides those doubted, the landmarks that would be if the variance were that of the others: in units of
// s² = (rᵀPr − z²)/(ν − d) without landmark a.
std::vector<int> suspects(const PredictionOfMatch& match) {
  VectorXd parts = match.predictions.over_sigma();
  const double degrees = match.degrees - static_cast<double>(match.predictions.residuals.rows());
  for (double& part : parts) {
    const double others = (match.predictions.square - part * part) / degrees;
    if (others < 1) part /= std::sqrt(std::max(others, 1e-12));
  }
  return beyond(parts, match.limit);
}

}  // namespace

std::optional<PredictionOfMatch> predict_match(const Registration& registration) {
  const SerialBlas serial;
  const std::vector<Index> observed = observed_landmarks(registration);
  if (registration.data.kind != DataKind::kLandmarks || std::ssize(observed) < kFewestPredicted) return std::nullopt;
  std::vector<int> left_out;
  auto found = predicted_without(registration, observed, left_out);
  for (int refit = 0; found && refit < kMostRefits; ++refit) {
    std::vector<int> now = suspects(*found);
    if (now == left_out || std::ssize(observed) - std::ssize(now) < kFewestPredicted) break;
    auto again = predicted_without(registration, observed, now);
    if (!again) break;
    found = std::move(again);
    left_out = std::move(now);
  }
  return found;
}

}  // namespace pulson::matching
