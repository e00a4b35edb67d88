#include "path_curvature.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>

#include "pulson/random/brownian.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr int kMostVectors = 40;
// The chance to overlook a direction of negative curvature.
constexpr double kOverlooked = 1e-2;

NodeCovector random_covector(const Points& source, int steps, std::uint64_t seed) {
  const MatrixXd normals = brownian_increments(seed, 0, static_cast<int>(source.size()), {1, steps});
  NodeCovector covector{Points::Zero(source.rows(), source.cols())};
  for (Index k = 0; k < steps; ++k) covector.emplace_back(normals.col(k).reshaped(source.rows(), source.cols()));
  return covector;
}

// That Lanczos' method has found no eigenvalue below `part` of the largest after k steps, but there is one below 0
// (Kuczyński & Woźniakowski 1992, theorem 4.2).
double chance_of_less_than_zero(Index k, double part, double unknowns) {
  return 1.648 * std::sqrt(unknowns) * std::exp(-static_cast<double>(2 * k - 1) * std::sqrt(std::max(0.0, part)));
}

}  // namespace

// In exact arithmetic the projection of H is tridiagonal, and beside its diagonal are the norms of what was left of the
// products: what differs is round-off.
Curvature least_curvature(const PathModel& model, const Points& source, int steps, std::uint64_t seed) {
  std::vector<PathDirection> basis;
  std::vector<NodeCovector> images;  // M times these
  MatrixXd projected = MatrixXd::Zero(kMostVectors, kMostVectors);
  Curvature found;
  NodeCovector image = random_covector(source, steps, seed);
  for (Index k = 0; k < kMostVectors; ++k) {
    basis.push_back(model.solve(image));
    const double norm = std::sqrt(pairing(image, basis.back()));
    if (!(norm > 0)) break;
    basis.back().scale(1 / norm);
    for (Points& x : image) x /= norm;
    images.push_back(std::move(image));
    image = model.hessian(basis.back());
    for (const bool again : {false, true})
      for (std::size_t i = 0; i < basis.size(); ++i) {
        const double part = pairing(image, basis[i]);
        if (!again) projected(static_cast<Index>(i), k) = part;
        for (std::size_t j = 0; j < image.size(); ++j) image[j] -= part * images[i][j];
      }
    for (Index i = 0; i < k; ++i)
      found.rounding = std::max(found.rounding, std::abs(projected(i, k) - (i + 1 == k ? norm : 0)));
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(
        MatrixXd(projected.topLeftCorner(k + 1, k + 1).selfadjointView<Eigen::Upper>()));
    found.least = eigen.eigenvalues()[0];
    if (found.is_negative()) {
      found.direction = std::move(basis.front());
      found.direction.scale(eigen.eigenvectors()(0, 0));
      for (Index i = 1; i <= k; ++i)
        found.direction.add(eigen.eigenvectors()(i, 0), basis[static_cast<std::size_t>(i)]);
      break;
    }
    const auto unknowns = static_cast<double>(source.size() * steps);
    if (chance_of_less_than_zero(k + 1, found.least / eigen.eigenvalues()[k], unknowns) < kOverlooked) break;
  }
  return found;
}

}  // namespace pulson::matching
