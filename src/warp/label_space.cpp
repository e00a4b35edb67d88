#include <cmath>
#include <optional>
#include <utility>

#include "core/factorisations.hpp"
#include "core/text.hpp"
#include "kernels/line_covariance.hpp"
#include "kernels/line_sums.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/warp/material_flow.hpp"

namespace pulson::warp {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kMostCondition = 1e12;  // in the norm of the largest column

constexpr EnumNames<LabelKernel, 2> kNames = {
    "interpolation", {{{"metric", LabelKernel::kMetric}, {"thin-plate", LabelKernel::kThinPlate}}}};

class MetricLabels final : public LabelSpace {
 public:
  MetricLabels(const KernelOperator& metric, const Points& labels) : metric_(metric), labels_(labels) {
    if (is_swept()) {
      factorise_along_line();
      return;
    }
    MatrixXd gram = metric.gram(labels, labels);
    factors_.compute(gram);
    if (factors_.info() == Eigen::Success && factors_.rcond() * kMostCondition > 1) return;
    ridge_ = gram.colwise().lpNorm<1>().maxCoeff() / kMostCondition;
    gram.diagonal().array() += ridge_;
    factors_.compute(gram);
    if (factors_.info() != Eigen::Success)
      throw NumericalError("the kernel's matrix of the landmarks is not positive definite");
  }

  Points coefficients(const Points& displacements) const override {
    require_size("the displacements of landmarks", displacements, labels_.rows(), labels_.cols());
    if (!line_) return factors_.solve(displacements.transpose()).transpose();
    MatrixXd solved = displacements.transpose();
    line_->solve_in_place(solved);
    return solved.transpose();
  }
  MatrixXd basis(const Points& x) const override { return metric_.gram(labels_, x); }
  MatrixXd gradients(const Points& x, const Points& coefficients) const override {
    MatrixXd gradients;
    metric_.apply_with_jacobian(x, labels_, coefficients, gradients);
    return gradients;
  }

 private:
  bool is_swept() const {
    return labels_.rows() == 1 && labels_.cols() >= kFewestOnLine && metric_.terms().size() == 1 &&
           has_line_sums(metric_.terms());
  }

  // The least variance of an innovation is at least the least eigenvalue.
  void factorise_along_line() {
    const double largest = metric_.apply(labels_, labels_, Points::Ones(1, labels_.cols())).maxCoeff();
    const KernelTerm& term = metric_.terms().front();
    line_.emplace(term, labels_.transpose(), VectorXd::Zero(labels_.cols()));
    if (line_->least_variance() * kMostCondition > largest) return;
    ridge_ = largest / kMostCondition;
    line_.emplace(term, labels_.transpose(), VectorXd::Constant(labels_.cols(), ridge_));
  }

  KernelOperator metric_;
  Points labels_;
  Eigen::LLT<MatrixXd> factors_;
  std::optional<LineCovariance> line_;  ///< in its place
};

// Duchon's splines: φ of the distances, and 1, x, y, z.
class ThinPlateLabels final : public LabelSpace {
 public:
  explicit ThinPlateLabels(const Points& labels) : labels_(labels) {
    const Index n = labels.cols();
    const Index affine = labels.rows() + 1;
    MatrixXd system = MatrixXd::Zero(n + affine, n + affine);
    system.leftCols(n).topRows(n) = radial(labels);
    system.topRightCorner(n, affine) = polynomials(labels);
    if (Eigen::ColPivHouseholderQR<MatrixXd>(system.topRightCorner(n, affine)).rank() < affine)
      throw InputError("the thin plate needs landmarks that do not all lie on one line or plane");
    system.bottomLeftCorner(affine, n) = system.topRightCorner(n, affine).transpose();
    factors_.compute(system);
  }

  Points coefficients(const Points& displacements) const override {
    require_size("the displacements of landmarks", displacements, labels_.rows(), labels_.cols());
    MatrixXd values = MatrixXd::Zero(factors_.rows(), displacements.rows());
    values.topRows(displacements.cols()) = displacements.transpose();
    return factors_.solve(values).transpose();
  }

  MatrixXd basis(const Points& x) const override {
    require_size("the points of an interpolation", x, labels_.rows(), x.cols());
    MatrixXd basis(factors_.rows(), x.cols());
    basis << radial(x).transpose(), polynomials(x).transpose();
    return basis;
  }

  MatrixXd gradients(const Points& x, const Points& coefficients) const override {
    const Index d = x.rows();
    MatrixXd gradients(d * d, x.cols());
    for (Index m = 0; m < x.cols(); ++m) {
      MatrixXd gradient = coefficients.rightCols(d);
      for (Index a = 0; a < labels_.cols(); ++a) {
        const VectorXd offset = x.col(m) - labels_.col(a);
        gradient += slope_by_distance(offset.norm()) * coefficients.col(a) * offset.transpose();
      }
      gradients.col(m) = gradient.reshaped();
    }
    return gradients;
  }

 private:
  double value(double r) const {
    switch (labels_.rows()) {
      case 1:
        return r * r * r;
      case 2:
        return r > 0 ? r * r * std::log(r) : 0;
      default:
        return -r;
    }
  }

  // φ'(r)/r
  double slope_by_distance(double r) const {
    if (!(r > 0)) return 0;
    switch (labels_.rows()) {
      case 1:
        return 3 * r;
      case 2:
        return 2 * std::log(r) + 1;
      default:
        return -1 / r;
    }
  }

  MatrixXd radial(const Points& x) const {
    MatrixXd radial(x.cols(), labels_.cols());
    for (Index a = 0; a < labels_.cols(); ++a)
      for (Index m = 0; m < x.cols(); ++m) radial(m, a) = value((x.col(m) - labels_.col(a)).norm());
    return radial;
  }

  static MatrixXd polynomials(const Points& x) {
    MatrixXd polynomials(x.cols(), x.rows() + 1);
    polynomials << VectorXd::Ones(x.cols()), x.transpose();
    return polynomials;
  }

  Points labels_;
  Eigen::PartialPivLU<MatrixXd> factors_;
};

}  // namespace

LabelKernel parse_label_kernel(std::string_view name) { return kNames.parse(name); }

std::string label_kernel_name(LabelKernel kernel) { return kNames.name(kernel); }

std::unique_ptr<const LabelSpace> LabelSpace::make(LabelKernel kernel, const KernelOperator& metric,
                                                   const Points& labels) {
  if (kernel == LabelKernel::kThinPlate) return std::make_unique<ThinPlateLabels>(labels);
  return std::make_unique<MetricLabels>(metric, labels);
}

}  // namespace pulson::warp
