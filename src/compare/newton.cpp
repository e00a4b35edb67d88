#include "newton.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Eigenvalues>

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kMostNewtonHalvings = 10;
constexpr double kLeastCurvature = 1e-6;  // of the greatest

// information⁻¹·gradient with the sizes of the eigenvalues.
VectorXd solved(const MatrixXd& information, const VectorXd& gradient) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> axes(information);
  const VectorXd sizes = axes.eigenvalues().cwiseAbs();
  const double least = std::max(kLeastCurvature * sizes.maxCoeff(), 1e-12);
  const VectorXd along = axes.eigenvectors().transpose() * gradient;
  return axes.eigenvectors() * along.cwiseQuotient(sizes.cwiseMax(least));
}

}  // namespace

VectorXd newton_step(const SecondOrder& here, const VectorXd& x, const Box& box, double longest) {
  std::vector<Index> free, held;
  for (Index i = 0; i < x.size(); ++i) {
    const bool at_least = x[i] <= box.least[i] && here.gradient[i] <= 0;
    const bool at_most = x[i] >= box.most[i] && here.gradient[i] >= 0;
    (at_least || at_most ? held : free).push_back(i);
  }
  VectorXd step = VectorXd::Zero(x.size());
  while (!free.empty()) {
    const VectorXd gradient = here.gradient(free) - here.information(free, held) * step(held);
    const VectorXd of_free = solved(here.information(free, free), gradient);
    step(free) = of_free * std::min(1.0, longest / std::max(of_free.cwiseAbs().maxCoeff(), 1e-300));
    const VectorXd to = x + step;
    const VectorXd inside = box.clipped(to);
    const auto crosses = [&](Index i) { return inside[i] != to[i]; };
    if (std::none_of(free.begin(), free.end(), crosses)) break;
    for (const Index i : free) {
      if (!crosses(i)) continue;
      held.push_back(i);
      step[i] = inside[i] - x[i];
    }
    std::erase_if(free, crosses);
  }
  return step;
}

BoxMaximum maximise_in_box(const std::function<double(const VectorXd&)>& value,
                           const std::function<SecondOrder(const VectorXd&)>& model, const Box& box,
                           const VectorXd& start, const NewtonOptions& options) {
  BoxMaximum best{box.clipped(start), 0, false};
  best.value = value(best.x);
  for (int count = 0; count < options.most_steps; ++count) {
    const SecondOrder here = model(best.x);
    VectorXd step = newton_step(here, best.x, box, options.longest_step);
    const double gain = 0.5 * here.gradient.dot(box.clipped(best.x + step) - best.x);
    if (gain < options.tolerance) {
      best.converged = true;
      break;
    }
    bool risen = false;
    for (int halving = 0; halving < kMostNewtonHalvings && !risen; ++halving, step /= 2) {
      const VectorXd to = box.clipped(best.x + step);
      const double there = value(to);
      if (!(there > best.value)) continue;
      risen = true;
      best.converged = there - best.value < options.tolerance && halving == 0;
      best = {to, there, best.converged};
    }
    if (!risen || best.converged) break;
  }
  return best;
}

}  // namespace pulson::compare
