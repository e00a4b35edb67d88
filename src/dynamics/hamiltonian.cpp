#include <algorithm>
#include <utility>
#include <vector>

#include "pulson/dynamics/stochastic_system.hpp"

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
  std::vector<Eigen::Index> columns;  // of landmarks without momentum two stand for all
  int at_rest = 0;
  for (Eigen::Index a = 0; a < p.cols(); ++a)
    if (sizes[a] != 0 || ++at_rest <= 2) columns.push_back(a);
  double largest = 0;
  for (std::size_t b = 1; b < columns.size(); ++b)
    for (std::size_t a = 0; a < b; ++a)
      largest = std::max(largest, (p.col(columns[a]) - p.col(columns[b])).norm() +
                                      2 * (total - sizes[columns[a]] - sizes[columns[b]]));
  return dt * kernel.lipschitz() * largest;
}

}  // namespace pulson
