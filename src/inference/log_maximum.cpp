#include "inference/log_maximum.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <vector>

#include <Eigen/Cholesky>
#include <nlopt.hpp>

namespace pulson::inference {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kDifference = 0.05;
constexpr double kFailure = 100;  // how far below all others a point without a value is put, of the start's size

class BobyqaSearch {
 public:
  BobyqaSearch(const std::function<double(const VectorXd&)>& f, const LogSearch& search) : f_(f), search_(search) {
    maximum_.x = VectorXd::Zero(search.least.size());
    first_ = lowest_ = maximum_.value = f(maximum_.x);
    maximum_.evaluations = 1;
  }

  void run() {
    const auto n = static_cast<unsigned>(maximum_.x.size());
    nlopt::opt maximiser(nlopt::LN_BOBYQA, n);
    maximiser.set_max_objective(call, this);
    maximiser.set_lower_bounds(std::vector<double>(search_.least.begin(), search_.least.end()));
    maximiser.set_upper_bounds(std::vector<double>(search_.most.begin(), search_.most.end()));
    maximiser.set_initial_step(search_.first_step);
    maximiser.set_xtol_abs(search_.tolerance);
    maximiser.set_maxeval(search_.max_evaluations);
    std::vector<double> x(n, 0.0);
    double value = 0;
    try {
      maximum_.converged = maximiser.optimize(x, value) != nlopt::MAXEVAL_REACHED;
    } catch (const nlopt::forced_stop&) {
      std::rethrow_exception(error_);
    } catch (const nlopt::roundoff_limited&) {
      maximum_.converged = true;  // no step changes the model any more, before the tolerance is reached
    }
    const double near = 10 * search_.tolerance;
    maximum_.at_bound = (maximum_.x - search_.least).array() <= near || (search_.most - maximum_.x).array() <= near;
  }

  const LogMaximum& maximum() const { return maximum_; }

  LogMaximum with_deviations() {
    std::vector<Index> free;
    for (Index i = 0; i < maximum_.x.size(); ++i)
      if (!maximum_.at_bound[i]) free.push_back(i);
    maximum_.deviations = VectorXd::Constant(maximum_.x.size(), std::numeric_limits<double>::quiet_NaN());
    if (free.empty()) return maximum_;
    const MatrixXd bend = curvature(free);
    const Eigen::LLT<MatrixXd> factors(bend);
    if (!bend.allFinite() || factors.info() != Eigen::Success) return maximum_;
    const MatrixXd covariance = factors.solve(MatrixXd::Identity(bend.rows(), bend.cols()));
    maximum_.deviations(free) = covariance.diagonal().cwiseSqrt();
    return maximum_;
  }

 private:
  static double call(const std::vector<double>& x, std::vector<double>& /*gradient*/, void* search) {
    auto& self = *static_cast<BobyqaSearch*>(search);
    try {
      return self.value_for_model(VectorXd::Map(x.data(), std::ssize(x)));
    } catch (...) {  // NLopt would forget what it was
      self.error_ = std::current_exception();
      throw nlopt::forced_stop();
    }
  }

  // BOBYQA fits quadratics through values, so that they have to be finite.
  double value_for_model(const VectorXd& x) {
    if (x.isZero(0)) return first_;
    const double value = evaluate(x);
    if (!std::isfinite(value)) return lowest_ - kFailure * (1 + std::abs(first_));
    lowest_ = std::min(lowest_, value);
    if (value > maximum_.value) {
      maximum_.value = value;
      maximum_.x = x;
    }
    return value;
  }

  double evaluate(const VectorXd& x) {
    ++maximum_.evaluations;
    return f_(x);
  }

  // −∇²f over x_i, i in `free`.
  MatrixXd curvature(const std::vector<Index>& free) {
    const auto n = std::ssize(free);
    MatrixXd result(n, n);
    const auto at = [&](Index i, double step_i, Index j, double step_j) {
      VectorXd x = maximum_.x;
      x[free[static_cast<std::size_t>(i)]] += step_i * kDifference;
      x[free[static_cast<std::size_t>(j)]] += step_j * kDifference;
      return evaluate(x);
    };
    const double area = kDifference * kDifference;
    for (Index i = 0; i < n; ++i) {
      result(i, i) = (2 * maximum_.value - at(i, 1, i, 0) - at(i, -1, i, 0)) / area;
      for (Index j = 0; j < i; ++j)
        result(i, j) = result(j, i) =
            (at(i, 1, j, -1) + at(i, -1, j, 1) - at(i, 1, j, 1) - at(i, -1, j, -1)) / (4 * area);
    }
    return result;
  }

  const std::function<double(const VectorXd&)>& f_;
  const LogSearch& search_;
  LogMaximum maximum_;
  double first_ = 0;
  double lowest_ = 0;
  std::exception_ptr error_;  // thrown by f
};

}  // namespace

LogSearch log_search(Index size, double bound, double tolerance, int max_evaluations) {
  LogSearch search{VectorXd::Constant(size, -bound), VectorXd::Constant(size, bound)};
  search.tolerance = tolerance;
  search.max_evaluations = max_evaluations;
  return search;
}

LogMaximum maximise_over_logs(const std::function<double(const VectorXd&)>& f, const LogSearch& search) {
  BobyqaSearch bobyqa(f, search);
  bobyqa.run();
  return search.with_deviations ? bobyqa.with_deviations() : bobyqa.maximum();
}

}  // namespace pulson::inference
