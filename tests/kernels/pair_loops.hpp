#pragma once

// The sums of KernelOperator as plain loops over all pairs, from the definition of its kernel.

#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "kernel_definition.hpp"

namespace pulson {

/// A sum per column, with the size of its terms.
class Sums {
 public:
  Sums(Eigen::Index rows, Eigen::Index columns)
      : sum_(Eigen::MatrixXd::Zero(rows, columns)), size_(Eigen::VectorXd::Zero(columns)) {}

  void add(Eigen::Index column, const Eigen::VectorXd& term, double size) {
    sum_.col(column) += term;
    size_[column] += size;
  }

  void expect_near(const Eigen::MatrixXd& actual, const std::string& what) const {
    ASSERT_EQ(actual.rows(), sum_.rows()) << what;
    ASSERT_EQ(actual.cols(), sum_.cols()) << what;
    for (Eigen::Index i = 0; i < sum_.cols(); ++i)
      EXPECT_LE((actual.col(i) - sum_.col(i)).cwiseAbs().maxCoeff(), 1e-13 * size_[i]) << what << ", column " << i;
  }

 private:
  Eigen::MatrixXd sum_;
  Eigen::VectorXd size_;
};

/// Checks the sums over sources y with momenta p at targets x.
inline void expect_field_sums(const DefinedKernel& definition, const KernelOperator& kernel, const Points& x,
                              const Points& y, const Points& p) {
  const Eigen::Index d = x.rows();
  Sums velocity(d, x.cols());
  Sums slope(d * d, x.cols());
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    for (Eigen::Index j = 0; j < y.cols(); ++j) {
      const Eigen::VectorXd z = x.col(i) - y.col(j);
      const RadialJet k = definition.factors(z.norm());
      velocity.add(i, k.value * p.col(j), k.value * p.col(j).norm());
      slope.add(i, Points(k.first * p.col(j) * z.transpose()).reshaped(),
                std::abs(k.first) * z.norm() * p.col(j).norm());
    }
  }
  Eigen::MatrixXd jacobian;
  velocity.expect_near(kernel.apply(x, y, p), "apply");
  velocity.expect_near(kernel.apply_with_jacobian(x, y, p, jacobian), "apply_with_jacobian");
  slope.expect_near(jacobian, "jacobian");
}

/// Checks the sums over the pairs of one point set.
inline void expect_self_sums(const DefinedKernel& definition, const KernelOperator& kernel, const Points& q,
                             const Points& a, const Points& p, const Points& delta) {
  const Eigen::Index d = q.rows();
  Sums tangent(d, q.cols());
  Sums gradient(d, q.cols());
  Sums hessian(d, q.cols());
  Sums velocity(d, q.cols()), force(d, q.cols());
  Sums velocity_change(d, q.cols()), force_change(d, q.cols());
  for (Eigen::Index i = 0; i < q.cols(); ++i) {
    for (Eigen::Index j = 0; j < q.cols(); ++j) {
      const Eigen::VectorXd z = q.col(i) - q.col(j);
      const Eigen::VectorXd w = delta.col(i) - delta.col(j);
      const RadialJet k = definition.factors(z.norm());
      const double slope = std::abs(k.first) * z.norm();
      const double both = p.col(i).dot(p.col(j)), sizes = p.col(i).norm() * p.col(j).norm();
      const Eigen::VectorXd shift = p.col(j) * k.first * z.dot(w);
      const double shift_size = p.col(j).norm() * slope * w.norm();
      tangent.add(i, shift, shift_size);
      const Eigen::VectorXd pull = (a.col(i).dot(p.col(j)) + p.col(i).dot(a.col(j))) * k.first * z;
      const double pull_size = (a.col(i).norm() * p.col(j).norm() + p.col(i).norm() * a.col(j).norm()) * slope;
      gradient.add(i, pull, pull_size);
      const Eigen::VectorXd bend = both * (k.first * w + k.second * z.dot(w) * z);
      const double bend_size = sizes * w.norm() * (std::abs(k.first) + std::abs(k.second) * z.squaredNorm());
      hessian.add(i, bend, bend_size);
      velocity.add(i, k.value * p.col(j), k.value * p.col(j).norm());
      force.add(i, both * k.first * z, sizes * slope);
      velocity_change.add(i, k.value * a.col(j) + shift, k.value * a.col(j).norm() + shift_size);
      force_change.add(i, bend + pull, bend_size + pull_size);
    }
  }
  tangent.expect_near(kernel.apply_tangent(q, p, delta), "apply_tangent");
  gradient.expect_near(kernel.gradient(q, a, p), "gradient");
  hessian.expect_near(kernel.hessian(q, p, delta), "hessian");
  const Flow flow = kernel.flow(q, p), change = kernel.flow_tangent(q, p, delta, a);
  velocity.expect_near(flow.velocity, "velocity of flow");
  force.expect_near(flow.force, "force of flow");
  velocity_change.expect_near(change.velocity, "velocity of flow_tangent");
  force_change.expect_near(change.force, "force of flow_tangent");
}

}  // namespace pulson
