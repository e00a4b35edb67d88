#include "matching/maximum.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>

#include <Eigen/Eigenvalues>
#include <nlopt.hpp>

#include "pulson/core/parallel.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// How far below all others a place without a value is put, of the first value's size: far more than a quadratic through
// the others would differ there, so that no step leads to it.
constexpr double kFailure = 100;
constexpr double kNearBound = 10;  // tolerances: the search ends within a few of a bound to which the function rises
// Curvatures below this part of the greatest are rounding of differences of step 1e-3.
constexpr double kLeastCurvature = 1e-6;

class BobyqaSearch {
 public:
  BobyqaSearch(const ValueAt& f, const Box& box, Maximum start, double tolerance)
      : f_(f), box_(box), tolerance_(tolerance), start_(start), maximum_(std::move(start)), lowest_(start_.value) {
    for (Index i = 0; i < start_.x.size(); ++i)
      if (box.least[i] < box.most[i]) free_.push_back(i);
  }

  Maximum run(const VectorXd& first_steps, int max_evaluations) {
    maximum_.converged = free_.empty();
    if (!free_.empty() && std::isfinite(start_.value)) search(first_steps, max_evaluations);
    const double near = kNearBound * tolerance_;
    maximum_.at_bound = (maximum_.x - box_.least).array() <= near || (box_.most - maximum_.x).array() <= near;
    return maximum_;
  }

 private:
  std::vector<double> of_free(const VectorXd& all) const {
    const VectorXd some = all(free_);
    return {some.begin(), some.end()};
  }

  void search(const VectorXd& first_steps, int max_evaluations) {
    nlopt::opt maximiser(nlopt::LN_BOBYQA, static_cast<unsigned>(free_.size()));
    maximiser.set_max_objective(call, this);
    maximiser.set_lower_bounds(of_free(box_.least));
    maximiser.set_upper_bounds(of_free(box_.most));
    maximiser.set_initial_step(of_free(first_steps.cwiseMin(0.5 * (box_.most - box_.least))));
    maximiser.set_xtol_abs(tolerance_);
    maximiser.set_maxeval(max_evaluations);
    std::vector<double> x = of_free(start_.x);
    double value = 0;
    try {
      maximum_.converged = maximiser.optimize(x, value) != nlopt::MAXEVAL_REACHED;
    } catch (const nlopt::forced_stop&) {
      std::rethrow_exception(error_);
    } catch (const nlopt::roundoff_limited&) {
      maximum_.converged = true;  // no step changes the model any more, before the tolerance is reached
    }
  }

  static double call(const std::vector<double>& x, std::vector<double>& /*gradient*/, void* search) {
    auto& self = *static_cast<BobyqaSearch*>(search);
    VectorXd all = self.start_.x;
    all(self.free_) = VectorXd::Map(x.data(), std::ssize(x));
    try {
      return self.value_for_model(all);
    } catch (...) {  // NLopt would forget what it was
      self.error_ = std::current_exception();
      throw nlopt::forced_stop();
    }
  }

  // BOBYQA fits quadratics through values, so that they have to be finite.
  double value_for_model(const VectorXd& x) {
    if (x == start_.x) return start_.value;
    ++maximum_.evaluations;
    const double value = f_(x);
    if (!std::isfinite(value)) return lowest_ - kFailure * (1 + std::abs(start_.value));
    lowest_ = std::min(lowest_, value);
    if (value > maximum_.value) maximum_.x = x, maximum_.value = value;
    return value;
  }

  const ValueAt& f_;
  const Box& box_;
  double tolerance_;
  Maximum start_, maximum_;
  double lowest_;
  std::vector<Index> free_;
  std::exception_ptr error_;  // thrown by f
};

// information⁻¹·gradient with the sizes of the eigenvalues.
VectorXd solved(const MatrixXd& information, const VectorXd& gradient) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> axes(information);
  const VectorXd sizes = axes.eigenvalues().cwiseAbs();
  const double least = std::max(kLeastCurvature * sizes.maxCoeff(), 1e-12);
  const VectorXd along = axes.eigenvectors().transpose() * gradient;
  return axes.eigenvectors() * along.cwiseQuotient(sizes.cwiseMax(least));
}

}  // namespace

Maximum maximise(const ValueAt& f, const Box& box, const VectorXd& start, const MaximumSearch& search) {
  return BobyqaSearch(f, box, {start, f(start), 1}, search.tolerance)
      .run(VectorXd::Constant(start.size(), search.first_step), search.max_evaluations);
}

Maximum maximise_from_grid(const ValueAt& f, const Box& box, const std::vector<int>& counts,
                           const MaximumSearch& search) {
  const VectorXd spacing = (box.most - box.least)
                               .cwiseQuotient(Eigen::VectorXi::Map(counts.data(), std::ssize(counts))
                                                  .unaryExpr([](int count) { return std::max(count - 1, 1); })
                                                  .cast<double>());
  Maximum best{box.least, -std::numeric_limits<double>::infinity()};
  Eigen::VectorXi place = Eigen::VectorXi::Zero(spacing.size());
  for (Index i = 0; i >= 0;) {
    const VectorXd x = box.clipped(box.least + spacing.cwiseProduct(place.cast<double>()));
    ++best.evaluations;
    if (const double value = f(x); value > best.value) best.x = x, best.value = value;
    for (i = place.size() - 1; i >= 0 && ++place[i] == counts[static_cast<std::size_t>(i)]; --i) place[i] = 0;
  }
  return BobyqaSearch(f, box, std::move(best), search.tolerance).run(spacing / 2, search.max_evaluations);
}

SecondOrder second_order(const ValueAt& f, const VectorXd& x, double step, bool at_once) {
  const Index k = x.size();
  MatrixXd plus(k, k), minus(k, k);
  std::vector<std::function<void()>> tasks;
  for (Index i = 0; i < k; ++i)
    for (Index j = 0; j <= i; ++j)
      for (const double sign : {1.0, -1.0})
        tasks.emplace_back([&, i, j, sign] {
          VectorXd there = x;
          there[i] += sign * step;
          if (i != j) there[j] += sign * step;
          (sign > 0 ? plus : minus)(i, j) = f(there);
        });
  SecondOrder model{f(x), VectorXd(k), MatrixXd(k, k)};
  if (at_once)
    parallel_for(static_cast<int>(std::ssize(tasks)), [&](int task) { tasks[static_cast<std::size_t>(task)](); });
  else
    for (const auto& task : tasks) task();
  const MatrixXd along = (2 * model.value - (plus + minus).array()) / (step * step);  // of i and j together
  model.gradient = (plus - minus).diagonal() / (2 * step);
  for (Index i = 0; i < k; ++i) {
    model.information(i, i) = along(i, i);
    for (Index j = 0; j < i; ++j)
      model.information(i, j) = model.information(j, i) = 0.5 * (along(i, j) - along(i, i) - along(j, j));
  }
  return model;
}

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

NewtonMaximum maximise_by_newton(const ValueAt& value, const std::function<SecondOrder(const VectorXd&)>& model,
                                 const Box& box, const VectorXd& start, const NewtonOptions& options) {
  NewtonMaximum best{box.clipped(start), {}};
  for (int count = 0;; ++count) {
    best.about = model(best.x);
    VectorXd step = newton_step(best.about, best.x, box, options.longest_step);
    if (!step.allFinite()) return best;  // nor is the model
    best.gain = 0.5 * best.about.gradient.dot(box.clipped(best.x + step) - best.x);
    best.converged = best.gain < options.tolerance;
    if (best.converged || count == options.most_steps) return best;
    bool risen = false;
    for (int halving = 0; halving < options.most_halvings && !risen; ++halving, step /= 2) {
      const VectorXd to = box.clipped(best.x + step);
      risen = value(to) > best.about.value;
      if (risen) best.x = to;
    }
    if (!risen) return best;
  }
}

}  // namespace pulson::matching
