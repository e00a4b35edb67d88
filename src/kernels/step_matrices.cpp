// The matrices of a time step, pair by pair.

#include <cstddef>
#include <vector>

#include <fmt/core.h>

#include "core/text.hpp"
#include "own_kernels.hpp"
#include "pulson/kernels/kernel_operator.hpp"

namespace pulson {
namespace {

// Jets of all pairs a < b at once, b slowest, where a kernel of one's own takes a call; else each when it is needed.
class PairJets {
 public:
  PairJets(const KernelOperator& kernel, const Points& q) : kernel_(kernel) {
    if (!has_own(kernel.terms())) return;
    Eigen::ArrayXd s(q.cols() * (q.cols() - 1) / 2);
    Eigen::Index pair = 0;
    for (Eigen::Index b = 0; b < q.cols(); ++b)
      for (Eigen::Index a = 0; a < b; ++a) s[pair++] = (q.col(a) - q.col(b)).squaredNorm();
    jets_ = jets_of(kernel.terms(), s, 2);
  }
  RadialJet next(double s) { return jets_.empty() ? kernel_.jet(s) : jets_[next_++]; }

 private:
  const KernelOperator& kernel_;
  std::vector<RadialJet> jets_;
  std::size_t next_ = 0;
};

template <int d>
StepMatrices step_matrices_in(const KernelOperator& kernel, const Points& q, const Points& p, double dt,
                              CoordinateOrder order) {
  using Vector = Eigen::Matrix<double, d, 1>;
  using Block = Eigen::Matrix<double, d, d>;
  const Eigen::Index n = q.cols();
  const auto place = [&](Eigen::Index a, int axis) {
    return order == CoordinateOrder::kByLandmark ? a * d + axis : axis * n + a;
  };
  StepMatrices step{Eigen::MatrixXd(n, n), Eigen::MatrixXd::Zero(d * n, d * n), Eigen::MatrixXd::Zero(d * n, d * n)};
  const auto add = [&](Eigen::MatrixXd& matrix, Eigen::Index a, Eigen::Index b, const Block& block) {
    for (int j = 0; j < d; ++j)
      for (int i = 0; i < d; ++i) matrix(place(a, i), place(b, j)) += block(i, j);
  };
  PairJets jets(kernel, q);
  const double at_zero = kernel.at_zero();
  for (Eigen::Index b = 0; b < n; ++b) {
    step.gram(b, b) = dt * at_zero;
    for (Eigen::Index a = 0; a < b; ++a) {
      const Vector z = q.col(a) - q.col(b);
      const RadialJet k = jets.next(z.squaredNorm());
      step.gram(a, b) = step.gram(b, a) = dt * k.value;
      const Vector slope = dt * k.first * z;
      const Block of_b = Vector(p.col(b)) * slope.transpose();  // p_b ∇K(q_a − q_b)
      const Block of_a = -Vector(p.col(a)) * slope.transpose();
      add(step.tangent, a, a, of_b);
      add(step.tangent, a, b, -of_b);
      add(step.tangent, b, b, of_a);
      add(step.tangent, b, a, -of_a);
      const Block bend =
          dt * Vector(p.col(a)).dot(Vector(p.col(b))) * (k.first * Block::Identity() + k.second * z * z.transpose());
      add(step.hessian, a, a, bend);
      add(step.hessian, b, b, bend);
      add(step.hessian, a, b, -bend);
      add(step.hessian, b, a, -bend);
    }
  }
  return step;
}

}  // namespace

StepMatrices KernelOperator::step_matrices(const Points& q, const Points& p, double dt, CoordinateOrder order) const {
  if (q.rows() < 1 || q.rows() > 3) throw InputError(fmt::format("points are in {}D; 1D to 3D are known", q.rows()));
  require_size("the momenta of a time step", p, q.rows(), q.cols());
  if (q.rows() == 1) return step_matrices_in<1>(*this, q, p, dt, order);
  return q.rows() == 2 ? step_matrices_in<2>(*this, q, p, dt, order) : step_matrices_in<3>(*this, q, p, dt, order);
}

}  // namespace pulson
