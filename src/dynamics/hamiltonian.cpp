#include "pulson/dynamics/hamiltonian.hpp"

#include <algorithm>

namespace pulson {

double hamiltonian(const KernelOperator& kernel, const PhaseState& state) {
  return 0.5 * state.p.cwiseProduct(hamiltonian_p(kernel, state.q, state.p)).sum();
}

Points hamiltonian_p(const KernelOperator& kernel, const Points& q, const Points& p) { return kernel.apply(q, q, p); }

Points hamiltonian_q(const KernelOperator& kernel, const Points& q, const Points& p) {
  return 0.5 * kernel.gradient(q, p, p);
}

double contraction_bound(const KernelOperator& kernel, const Points& p, double dt) {
  const Eigen::VectorXd sizes = p.colwise().norm();
  const double total = sizes.sum();
  double largest = 0;
  for (Eigen::Index b = 1; b < p.cols(); ++b)
    for (Eigen::Index a = 0; a < b; ++a)
      largest = std::max(largest, (p.col(a) - p.col(b)).norm() + 2 * (total - sizes[a] - sizes[b]));
  return dt * kernel.lipschitz() * largest;
}

}  // namespace pulson
