#include "fitted_draws.hpp"

#include <cmath>
#include <limits>

#include <Eigen/LU>

#include "core/secants.hpp"

namespace pulson::inference {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kMostChords = 40, kMostNewton = 20;
constexpr std::size_t kWindow = 3;       // of the secants of chord iterations
constexpr double kLeastPart = 1.0 / 64;  // of a step of Newton's method
constexpr double kFarther = 1e3;         // than before, where chord iterations lead nowhere
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// I + J(z)Jᵀ
MatrixXd slope_at(const Specimen& specimen, const Specimen::Model& model, const LinearAt& linear,
                  const Specimen::Shot& shot) {
  MatrixXd slope = linear.product(specimen.slopes(model, shot), model);
  slope.diagonal().array() += 1;
  return slope;
}

// Where a search for v is, and what it is for.
struct Search {
  const Specimen& specimen;
  const Specimen::Model& model;
  const LinearAt& linear;
  VectorXd zeta, epsilon;

  VectorXd z(const VectorXd& v) const { return zeta - linear.transposed(v); }
  VectorXd missing(const VectorXd& v, const Specimen::Shot& shot) const { return epsilon + shot.residual - v; }
};

// Steps of Newton's method from v, halved until they come nearer.
std::optional<VectorXd> by_newton(const Search& search, const VectorXd& begin, double accuracy) {
  VectorXd here = begin, step = VectorXd::Zero(begin.size());
  double error = kInfinity, part = 1;
  for (int iteration = 0; iteration < kMostNewton && part >= kLeastPart; ++iteration) {
    const VectorXd v = here + part * step;
    const VectorXd z = search.z(v);
    const auto shot = search.specimen.shoot(search.model, z);
    const VectorXd missing = shot ? search.missing(v, *shot) : VectorXd();
    if (!shot || !(missing.norm() < error)) {
      part /= 2;
      continue;
    }
    here = v;
    error = missing.norm();
    if (error <= accuracy) return z;
    part = 1;
    step = slope_at(search.specimen, search.model, search.linear, *shot).partialPivLu().solve(missing);
  }
  return std::nullopt;
}

}  // namespace

std::optional<VectorXd> fitted_draw(const Specimen& specimen, const Specimen::Model& model, const LinearAt& linear,
                                    const VectorXd& normals, double accuracy) {
  const Index unknowns = specimen.unknowns();
  const Search search{specimen, model, linear, normals.head(unknowns), normals.tail(normals.size() - unknowns)};
  VectorXd v = linear.solve(VectorXd(linear.apply(search.zeta) + linear.offset() + search.epsilon));
  VectorXd nearest = v;
  double least = kInfinity;
  Secants secants(kWindow);
  for (int iteration = 0; iteration < kMostChords; ++iteration) {
    const VectorXd z = search.z(v);
    const auto shot = specimen.shoot(model, z);
    if (!shot) break;
    const VectorXd missing = search.missing(v, *shot);
    if (missing.norm() <= accuracy) return z;
    if (!(missing.norm() < kFarther * least)) break;
    if (missing.norm() < least) {
      least = missing.norm();
      nearest = v;
    }
    v = secants.next(v, -linear.solve(missing));
  }
  return by_newton(search, nearest, accuracy);
}

double fitted_log_density(const Specimen& specimen, const Specimen::Model& model, const LinearAt& linear,
                          const VectorXd& z, const Specimen::Shot& shot) {
  const VectorXd eta = z + linear.transposed(shot.residual);
  const VectorXd image = linear.apply(eta);
  const Eigen::PartialPivLU<MatrixXd> lu(slope_at(specimen, model, linear, shot));
  return 0.5 * (z.squaredNorm() - eta.squaredNorm() + image.dot(linear.solve(image))) - linear.half_log_determinant() +
         lu.matrixLU().diagonal().array().abs().log().sum();
}

// By z it is −(J(z) − J)ᵀS⁻¹b.
VectorXd fitted_kick(const Specimen& specimen, const Specimen::Model& model, const LinearAt& linear, const VectorXd& z,
                     const Specimen::Shot& shot) {
  const VectorXd u = linear.solve(VectorXd(shot.residual - linear.apply(z)));
  return linear.pull_back(linear.transposed(u) - specimen.transposed(model, shot, u));
}

}  // namespace pulson::inference
