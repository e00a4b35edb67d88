#pragma once

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "cohort/geodesics.hpp"
#include "core/factorisations.hpp"
#include "pulson/cohort/atlas.hpp"
#include "random/normals.hpp"

namespace pulson::cohort {

inline Landmarks shape_of(Points points, std::string source = "a.csv") {
  Landmarks shape;
  shape.points = std::move(points);
  shape.source = std::move(source);
  return shape;
}

/// An oval of diameter 2, in space with some height.
inline Points oval(int count, int dimension = 2) {
  Points points(dimension, count);
  for (int a = 0; a < count; ++a) {
    const double angle = 2 * std::numbers::pi * a / count;
    points(0, a) = std::cos(angle);
    points(1, a) = 0.6 * std::sin(angle);
    if (dimension == 3) points(2, a) = 0.3 * std::cos(2 * angle);
  }
  return points;
}

/// Of which shapes are drawn: p ~ N(0, (λK)⁻¹), y = q(1) + N(0, σ²).
struct CohortLaw {
  Points q0 = oval(12);
  KernelOperator kernel = make_kernel("matern32:alpha=0.5");
  double lambda = 400, sigma = 0.01;
};

inline std::vector<Landmarks> drawn_shapes(const CohortLaw& law, int count, std::uint64_t seed) {
  const Geodesics geodesics(law.kernel, 10);
  const auto d = static_cast<int>(law.q0.rows()), n = static_cast<int>(law.q0.cols());
  const Eigen::LLT<Eigen::MatrixXd> factors(law.kernel.gram(law.q0, law.q0));
  std::vector<Landmarks> shapes;
  for (int i = 0; i < count; ++i) {
    const Eigen::MatrixXd normals = standard_normals(seed, static_cast<std::uint64_t>(i), 2 * d * n, 1);
    const Points z = normals.topRows(d * n).reshaped(d, n), e = normals.bottomRows(d * n).reshaped(d, n);
    // p = L⁻ᵀz/√λ has the covariance (λK)⁻¹
    const Points p = factors.matrixU().solve(z.transpose()).transpose() / std::sqrt(law.lambda);
    shapes.push_back(shape_of(geodesics.shoot(law.q0, p).q + law.sigma * e, "drawn.csv#" + std::to_string(i + 1)));
    shapes.back().name = "shape_" + std::to_string(i + 1);
  }
  return shapes;
}

/// As the law has it, without alignment.
inline AtlasOptions options_of(const CohortLaw& law) {
  AtlasOptions options;
  options.kernel = law.kernel;
  options.lambda = law.lambda;
  options.sigma = law.sigma;
  options.align = AlignmentKind::kNone;
  return options;
}

}  // namespace pulson::cohort
