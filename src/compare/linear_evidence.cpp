// The evidence of models linear about matches, as a function of the numbers.

#include <cmath>

#include <Eigen/Cholesky>

#include "cohort_model.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson::compare {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using posterior::Specimen;

namespace {

constexpr double kDifference = 1e-3;  // of x, for derivatives of covariances: exact to 1e-6

// −½ cᵀC⁻¹c − ½ log det C − log volume, and what derivatives take of it.
struct OfShape {
  OfShape(const posterior::LinearModel& linear, const Specimen::Model& model)
      : covariance(linear.covariance(model)),
        factors(covariance),
        weighed(factors.solve(linear.offset())),
        units(linear.specimen().units(model)) {
    Specimen::Model of_data = model;
    of_data.sigma = 1;  // C has σ, and the units of sizes
    value = -0.5 * linear.offset().dot(weighed) - factors.matrixLLT().diagonal().array().log().sum() -
            linear.specimen().log_volume(of_data) + linear.specimen().size_excess(model, residual()) +
            units.tail(units.size() - linear.specimen().coordinates()).array().log().sum();
  }

  // At the mean.
  VectorXd residual() const { return units.cwiseProduct(weighed); }
  // Of ½|r_B|² by what C changes by.
  double slope_of_size(const MatrixXd& change, Index coordinates) const {
    const Index sizes = weighed.size() - coordinates;
    if (sizes == 0) return 0;
    const VectorXd moved = units.cwiseProduct(factors.solve(change * weighed));
    return -residual().tail(sizes).dot(moved.tail(sizes));
  }

  MatrixXd covariance;
  Eigen::LLT<MatrixXd> factors;
  VectorXd weighed;
  VectorXd units;
  double value = 0;
};

}  // namespace

double CohortModel::linear_value(const Matches& about, const VectorXd& x) const {
  const Specimen::Model model = this->model(x, about);
  VectorXd values(shapes());
  parallel_for(shapes(), [&](int s) { values[s] = OfShape(*about.minima[at(s)].linear, model).value; });
  return values.sum() + of_own_mean(about, model);
}

SecondOrder CohortModel::linear_evidence_with(const Matches& about, const VectorXd& x, bool with_sigma) const {
  const Index n = count() + (with_sigma ? 1 : 0);
  const Specimen::Model model = this->model(x, about);
  std::vector<Specimen::Model> aside;
  for (Index i = 0; i < count(); ++i) aside.push_back(this->model(x + kDifference * VectorXd::Unit(count(), i), about));
  if (with_sigma) {
    aside.push_back(model);
    aside.back().sigma *= std::exp(kDifference);
  }
  std::vector<SecondOrder> all(at(shapes()), {0, VectorXd(n), MatrixXd(n, n)});
  parallel_for(shapes(), [&](int s) {
    const posterior::LinearModel& linear = *about.minima[at(s)].linear;
    const OfShape here(linear, model);
    SecondOrder& of_shape = all[at(s)];
    of_shape.value = here.value;
    std::vector<MatrixXd> parts;  // L⁻¹ C_i L⁻ᵀ
    for (Index i = 0; i < n; ++i) {
      const MatrixXd change = (linear.covariance(aside[at(i)]) - here.covariance) / kDifference;
      const MatrixXd half = here.factors.matrixL().solve(change);
      parts.emplace_back(here.factors.matrixL().solve(MatrixXd(half.transpose())));
      of_shape.gradient[i] = 0.5 * (here.weighed.dot(change * here.weighed) - parts.back().trace()) +
                             here.slope_of_size(change, linear.specimen().coordinates());
      for (Index j = 0; j <= i; ++j)
        of_shape.information(i, j) = of_shape.information(j, i) = 0.5 * parts[at(i)].cwiseProduct(parts[at(j)]).sum();
    }
  });
  SecondOrder sum{0, VectorXd::Zero(n), MatrixXd::Zero(n, n)};
  for (const SecondOrder& of_shape : all) {
    sum.value += of_shape.value;
    sum.gradient += of_shape.gradient;
    sum.information += of_shape.information;
  }
  if (!own_mean_) return sum;
  // Of complete shapes the information is that of all but one.
  const double of_mean = of_own_mean(about, model);
  sum.value += of_mean;
  for (Index i = 0; i < n; ++i) sum.gradient[i] += (of_own_mean(about, aside[at(i)]) - of_mean) / kDifference;
  sum.information *= 1 - 1 / static_cast<double>(shapes());
  return sum;
}

SecondOrder CohortModel::linear_evidence(const Matches& about, const VectorXd& x) const {
  return linear_evidence_with(about, x, false);
}

VectorXd CohortModel::correlations_with_sigma(const Matches& about) const {
  const MatrixXd information = linear_evidence_with(about, about.x, true).information;
  const Index n = count();
  return information.col(n).head(n).cwiseQuotient((information.diagonal().head(n) * information(n, n)).cwiseSqrt());
}

}  // namespace pulson::compare
