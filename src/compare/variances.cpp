#include "variances.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <Eigen/Cholesky>

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kMostScorings = 100;
constexpr int kMostStepHalvings = 20;
constexpr double kLongestStep = 2;   // of a logarithm
constexpr double kLeastStep = 1e-5;  // step at which the search ends
constexpr double kRidge = 1e-9;      // added to the information where parameters cannot be distinguished

struct Slope {
  double log_likelihood = 0;
  VectorXd gradient;
  MatrixXd information;
};

// One shape at given u.
struct ShapeModel {
  ShapeModel(const VarianceData& shape, const VectorXd& u) {
    MatrixXd covariance = shape.fixed;
    VectorXd innovation = shape.innovation;
    for (Index g = 0; g < u.size(); ++g) {
      covariance += std::exp(u[g]) * shape.groups[static_cast<std::size_t>(g)];
      innovation -= (std::exp(u[g]) - 1) * shape.drifts[static_cast<std::size_t>(g)];
    }
    factors.compute(covariance);
    weighed = factors.solve(innovation);
    log_likelihood = -0.5 * innovation.dot(weighed) - factors.matrixLLT().diagonal().array().log().sum();
  }

  Eigen::LLT<MatrixXd> factors;  // of C
  VectorXd weighed;              // C⁻¹t
  double log_likelihood;
};

double likelihood(const std::vector<VarianceData>& shapes, const VectorXd& u) {
  double sum = 0;
  for (const VarianceData& shape : shapes) sum += ShapeModel(shape, u).log_likelihood;
  return sum;
}

Slope slope(const std::vector<VarianceData>& shapes, const VectorXd& u) {
  const Index groups = u.size();
  Slope all{0, VectorXd::Zero(groups), MatrixXd::Zero(groups + 1, groups + 1)};
  for (const VarianceData& shape : shapes) {
    const Index n = shape.innovation.size();
    const ShapeModel model(shape, u);
    all.log_likelihood += model.log_likelihood;
    std::vector<MatrixXd> parts;   // C⁻¹ ∂C
    std::vector<VectorXd> slopes;  // −∂t
    for (Index g = 0; g < groups; ++g) {
      const MatrixXd change = std::exp(u[g]) * shape.groups[static_cast<std::size_t>(g)];
      slopes.emplace_back(std::exp(u[g]) * shape.drifts[static_cast<std::size_t>(g)]);
      parts.emplace_back(model.factors.solve(change));
      all.gradient[g] +=
          0.5 * (model.weighed.dot(change * model.weighed) - parts.back().trace()) + model.weighed.dot(slopes.back());
    }
    parts.emplace_back(model.factors.solve(MatrixXd::Identity(n, n)));
    slopes.emplace_back(VectorXd::Zero(n));
    for (Index g = 0; g <= groups; ++g)
      for (Index h = 0; h <= g; ++h) {
        const auto a = static_cast<std::size_t>(g);
        const auto b = static_cast<std::size_t>(h);
        all.information(g, h) +=
            0.5 * parts[a].cwiseProduct(parts[b].transpose()).sum() + slopes[a].dot(model.factors.solve(slopes[b]));
      }
  }
  all.information = MatrixXd(all.information.selfadjointView<Eigen::Lower>());
  return all;
}

VectorXd lower_ends(const std::vector<VarianceData>& shapes, Index groups) {
  VectorXd ends(groups);
  for (Index g = 0; g < groups; ++g) {
    double trace = 0;
    Index count = 0;
    for (const VarianceData& shape : shapes) {
      trace += shape.groups[static_cast<std::size_t>(g)].trace();
      count += shape.innovation.size();
    }
    ends[g] =
        trace > 0 ? std::log(kNegligible * static_cast<double>(count) / trace) : 0;  // of nothing there is no less
  }
  return ends;
}

// The first of u + step, u + step/2, … above the likelihood now.
std::optional<VectorXd> better(const std::vector<VarianceData>& shapes, double now, const VectorXd& u, VectorXd step,
                               const VectorXd& least) {
  for (int halving = 0; halving < kMostStepHalvings; ++halving, step /= 2) {
    VectorXd tried = (u + step).cwiseMax(least);
    if (likelihood(shapes, tried) > now) return tried;
  }
  return std::nullopt;
}

std::optional<VectorXd> along_slope(const std::vector<VarianceData>& shapes, double now, const VectorXd& u,
                                    const VectorXd& way, const VectorXd& gradient, const VectorXd& least) {
  const auto shortened = [](const VectorXd& step) {
    return VectorXd(step * std::min(1.0, kLongestStep / step.cwiseAbs().maxCoeff()));
  };
  if (gradient.isZero(0)) return std::nullopt;
  if (auto found = better(shapes, now, u, shortened(way), least)) return found;
  return better(shapes, now, u, gradient * (kLongestStep / gradient.cwiseAbs().maxCoeff()), least);
}

}  // namespace

VarianceFit fit_variances(const std::vector<VarianceData>& shapes, Index groups) {
  const VectorXd least = lower_ends(shapes, groups);
  VectorXd u = VectorXd::Zero(groups).cwiseMax(least);
  Slope here = slope(shapes, u);
  const MatrixXd first_information = here.information;
  for (int count = 0; count < kMostScorings && groups > 0; ++count) {
    MatrixXd information = here.information.topLeftCorner(groups, groups);
    information.diagonal() += VectorXd::Constant(groups, kRidge * (1 + information.trace()));
    VectorXd gradient = here.gradient;
    for (Index g = 0; g < groups; ++g)  // those at their end stay there
      if (u[g] <= least[g] && gradient[g] <= 0) {
        information.row(g).setZero();
        information.col(g).setZero();
        information(g, g) = 1;
        gradient[g] = 0;
      }
    const VectorXd way = information.ldlt().solve(gradient);
    // Cut off, one by one, as long as that leads up; else shortened as a whole, or along the slope.
    const std::optional<VectorXd> found =
        better(shapes, here.log_likelihood, u, way.cwiseMin(kLongestStep).cwiseMax(-kLongestStep), least);
    const std::optional<VectorXd> next =
        found ? found : along_slope(shapes, here.log_likelihood, u, way, gradient, least);
    if (!next) break;
    const VectorXd step = *next - u;
    u = *next;
    here = slope(shapes, u);
    if (step.cwiseAbs().maxCoeff() < kLeastStep) break;
  }
  return {u, here.information, first_information, here.log_likelihood, least};
}

}  // namespace pulson::compare
