#include "fitted_draws.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/LU>

#include "core/secants.hpp"

namespace pulson::posterior {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// Chord iterations contract by a factor of 2 or more where the linear model is of use, so that 40 come to 1e-12; beyond
// them Newton's method, whose 20 steps of at least 1/64 go as far as one whole step.
constexpr int kMostChords = 40, kMostNewton = 20;
constexpr double kLeastPart = 1.0 / 64;
constexpr std::size_t kDrawWindow = 3;  // secants: as many as the bends of a path have directions that matter
constexpr double kFarther = 1e3;        // than before: chord iterations that lead away do not come back
constexpr double kSame = 10;            // accuracies between two ends of a search at one draw
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The search for all draws.
class DrawSearch {
 public:
  DrawSearch(const ShotBatch& shots, const LinearAt& linear, const MatrixXd& normals, double accuracy)
      : shots_(shots),
        linear_(linear),
        zeta_(normals.topRows(shots.specimen().unknowns())),
        epsilon_(normals.bottomRows(shots.specimen().data())),
        accuracy_(accuracy),
        nearest_(epsilon_.rows(), normals.cols()),
        least_(VectorXd::Constant(normals.cols(), kInfinity)),
        draws_{MatrixXd::Zero(zeta_.rows(), normals.cols()), MatrixXd::Zero(epsilon_.rows(), normals.cols()),
               MatrixXd::Zero(epsilon_.rows(), normals.cols()), std::vector<char>(at(normals.cols()))} {}

  FittedDraws run(const MatrixXd& begin) {
    for (Index l = 0; l < count(); ++l) {
      const bool known = begin.size() > 0 && !std::isnan(begin(0, l));
      draws_.v.col(l) = known ? VectorXd(begin.col(l)) : linear_start(l);
    }
    nearest_ = draws_.v;
    by_chords();
    by_newton();
    return std::move(draws_);
  }

 private:
  static std::size_t at(Index l) { return static_cast<std::size_t>(l); }
  Index count() const { return zeta_.cols(); }

  VectorXd linear_start(Index l) const {
    return linear_.solve(VectorXd(linear_.apply(zeta_.col(l)) + linear_.offset() + epsilon_.col(l)));
  }

  // Shoots those that are named from their v. @return which have a path
  std::vector<char> shoot(const std::vector<Index>& which) {
    MatrixXd z(zeta_.rows(), std::ssize(which));
    for (Index i = 0; i < z.cols(); ++i)
      z.col(i) = zeta_.col(which[at(i)]) - linear_.transposed(draws_.v.col(which[at(i)]));
    ShotBatch::Ends ends = shots_.ends(z);
    for (Index i = 0; i < z.cols(); ++i) {
      const Index l = which[at(i)];
      draws_.z.col(l) = z.col(i);
      if (!ends.found[at(i)]) continue;
      draws_.residuals.col(l) = shots_.specimen().residual(shots_.model(), ends.positions.col(i));
      ends.found[at(i)] = draws_.residuals.col(l).allFinite() ? 1 : 0;
    }
    return std::move(ends.found);
  }

  VectorXd missing(Index l) const { return epsilon_.col(l) + draws_.residuals.col(l) - draws_.v.col(l); }

  void by_chords() {
    std::vector<Index> left;
    for (Index l = 0; l < count(); ++l) left.push_back(l);
    std::vector<Secants> secants(at(count()), Secants(kDrawWindow));
    for (int iteration = 0; iteration < kMostChords && !left.empty(); ++iteration) {
      const std::vector<char> has_path = shoot(left);
      std::vector<Index> next;
      for (std::size_t i = 0; i < left.size(); ++i) {
        const Index l = left[i];
        if (!has_path[i]) continue;
        const VectorXd missing = this->missing(l);
        const double error = missing.norm();
        if (error <= accuracy_) draws_.found[at(l)] = 1;
        if (error <= accuracy_ || !(error < kFarther * least_[l])) continue;
        if (error < least_[l]) {
          least_[l] = error;
          nearest_.col(l) = draws_.v.col(l);
        }
        draws_.v.col(l) = secants[at(l)].next(draws_.v.col(l), -linear_.solve(missing));
        next.push_back(l);
      }
      left = std::move(next);
    }
  }

  // From the nearest places, steps halved until they come nearer.
  void by_newton() {
    std::vector<Index> left;
    for (Index l = 0; l < count(); ++l)
      if (!draws_.found[at(l)]) left.push_back(l);
    MatrixXd step = MatrixXd::Zero(nearest_.rows(), count());
    VectorXd part = VectorXd::Ones(count());
    least_.setConstant(kInfinity);
    for (int iteration = 0; iteration < kMostNewton && !left.empty(); ++iteration) {
      for (const Index l : left) draws_.v.col(l) = nearest_.col(l) + part[l] * step.col(l);
      const std::vector<char> has_path = shoot(left);
      std::vector<Index> next, nearer;
      for (std::size_t i = 0; i < left.size(); ++i) {
        const Index l = left[i];
        const double error = has_path[i] ? missing(l).norm() : kInfinity;
        if (error < least_[l]) {
          least_[l] = error;
          nearest_.col(l) = draws_.v.col(l);
          part[l] = 1;
          draws_.found[at(l)] = error <= accuracy_ ? 1 : 0;
          if (!draws_.found[at(l)]) nearer.push_back(l);
        } else {
          part[l] /= 2;
        }
        if (!draws_.found[at(l)] && part[l] >= kLeastPart) next.push_back(l);
      }
      if (!nearer.empty()) {
        std::vector<MatrixXd> slopes = shots_.products(draws_.z(Eigen::all, nearer));
        for (std::size_t i = 0; i < nearer.size(); ++i) {
          if (slopes[i].size() == 0) {  // derivatives that overflow
            part[nearer[i]] = 0;
            continue;
          }
          slopes[i].diagonal().array() += 1;
          step.col(nearer[i]) = slopes[i].partialPivLu().solve(missing(nearer[i]));
        }
      }
      std::erase_if(next, [&](Index l) { return part[l] == 0; });
      left = std::move(next);
    }
  }

  const ShotBatch& shots_;
  const LinearAt& linear_;
  MatrixXd zeta_, epsilon_;
  double accuracy_;
  MatrixXd nearest_;  // v of the places with a path
  VectorXd least_;    // what is missing there
  FittedDraws draws_;
};

}  // namespace

FittedDraws fitted_draws(const ShotBatch& shots, const LinearAt& linear, const MatrixXd& normals, double accuracy,
                         const MatrixXd& begin) {
  return DrawSearch(shots, linear, normals, accuracy).run(begin);
}

VectorXd fitted_log_densities(const ShotBatch& shots, const LinearAt& linear, const MatrixXd& z,
                              const MatrixXd& residuals) {
  std::vector<MatrixXd> slopes = shots.products(z);
  VectorXd densities = VectorXd::Constant(z.cols(), std::numeric_limits<double>::quiet_NaN());
  for (Index l = 0; l < z.cols(); ++l) {
    MatrixXd& slope = slopes[static_cast<std::size_t>(l)];
    if (slope.size() == 0) continue;
    slope.diagonal().array() += 1;
    const VectorXd eta = z.col(l) + linear.transposed(residuals.col(l));
    const VectorXd image = linear.apply(eta);
    const Eigen::PartialPivLU<MatrixXd> lu(slope);
    densities[l] = 0.5 * (z.col(l).squaredNorm() - eta.squaredNorm() + image.dot(linear.solve(image))) -
                   linear.half_log_determinant() + lu.matrixLU().diagonal().array().abs().log().sum();
  }
  return densities;
}

// With ζ = η and ε = 0 the search is that of all (ζ, ε) of this η: it begins at the same z, and takes the same steps.
std::vector<char> are_fitted_draws(const ShotBatch& shots, const LinearAt& linear, const MatrixXd& z,
                                   const MatrixXd& residuals, double accuracy) {
  MatrixXd normals = MatrixXd::Zero(z.rows() + residuals.rows(), z.cols());
  for (Index l = 0; l < z.cols(); ++l) normals.col(l).head(z.rows()) = z.col(l) + linear.transposed(residuals.col(l));
  FittedDraws draws = fitted_draws(shots, linear, normals, accuracy);
  for (Index l = 0; l < z.cols(); ++l) {
    const double apart =
        std::hypot((draws.z.col(l) - z.col(l)).norm(), (draws.residuals.col(l) - residuals.col(l)).norm());
    if (!(apart <= kSame * accuracy)) draws.found[static_cast<std::size_t>(l)] = 0;
  }
  return std::move(draws.found);
}

// By z it is −(J(z) − J)ᵀS⁻¹b.
VectorXd fitted_kick(const Specimen& specimen, const Specimen::Model& model, const LinearAt& linear, const VectorXd& z,
                     const Specimen::Shot& shot) {
  const VectorXd u = linear.solve(VectorXd(shot.residual - linear.apply(z)));
  return linear.pull_back(linear.transposed(u) - specimen.transposed(model, shot, u));
}

}  // namespace pulson::posterior
