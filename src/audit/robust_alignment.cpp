#include "robust_alignment.hpp"

#include <algorithm>
#include <cmath>

#include "pulson/core/alignment.hpp"

namespace pulson::audit {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr int kAlignmentRounds = 20;  // reweighting contracts by a half or better

VectorXd geman_mcclure(const VectorXd& distances) {
  const double middle = median_of({distances.begin(), distances.end()});
  if (!(middle > 0)) return VectorXd::Ones(distances.size());
  return (1 + (distances.array() / (2 * middle)).square()).square().inverse();
}

struct DistanceRatios {
  double scale;         // of the shape over the target
  VectorXd deviations;  // of each landmark's distances from the others, as logarithms
};

DistanceRatios compare_distances(const Points& shape, const Points& target) {
  const Index n = shape.cols();
  Eigen::MatrixXd logs(n, n);
  std::vector<double> all;
  for (Index b = 0; b < n; ++b)
    for (Index a = 0; a < b; ++a) {
      const double ratio = (shape.col(a) - shape.col(b)).norm() / (target.col(a) - target.col(b)).norm();
      logs(a, b) = logs(b, a) = std::isfinite(ratio) && ratio > 0 ? std::log(ratio) : std::nan("");
      if (!std::isnan(logs(a, b))) all.push_back(logs(a, b));
    }
  if (all.empty()) return {1, VectorXd::Zero(n)};
  const double scale = median_of(all);
  VectorXd deviations(n);
  for (Index a = 0; a < n; ++a) {
    std::vector<double> own;
    for (Index b = 0; b < n; ++b)
      if (b != a && !std::isnan(logs(a, b))) own.push_back(std::abs(logs(a, b) - scale));
    deviations[a] = own.empty() ? 0 : median_of(std::move(own));
  }
  return {std::exp(scale), deviations};
}

}  // namespace

double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

std::vector<int> observed_in_both(const Points& a, const Points& b) {
  std::vector<int> observed;
  for (Index i = 0; i < a.cols(); ++i)
    if (a.col(i).allFinite() && b.col(i).allFinite()) observed.push_back(static_cast<int>(i));
  return observed;
}

Points robustly_aligned(const Points& shape, const Points& target) {
  const std::vector<int> observed = observed_in_both(shape, target);
  const Points fixed = target(Eigen::all, observed);
  const DistanceRatios ratios = compare_distances(shape(Eigen::all, observed), fixed);
  const Points sized = shape / ratios.scale;
  const Points moving = sized(Eigen::all, observed);
  AlignmentOptions options;
  options.weights = geman_mcclure(ratios.deviations);
  Alignment motion = align(moving, fixed, AlignmentKind::kRigid, options);
  for (int round = 0; round < kAlignmentRounds; ++round) {
    options.weights = geman_mcclure((motion.apply(moving) - fixed).colwise().norm().transpose());
    motion = align(moving, fixed, AlignmentKind::kRigid, options);
  }
  return motion.apply(sized);
}

double rms_apart(const Points& reference, const Points& shape) {
  const std::vector<int> observed = observed_in_both(reference, shape);
  const Points from = reference(Eigen::all, observed), to = shape(Eigen::all, observed);
  const Points moved = align(from, to, AlignmentKind::kSimilarity).apply(from);
  return (moved - to).norm() / std::sqrt(static_cast<double>(to.cols()));
}

}  // namespace pulson::audit
