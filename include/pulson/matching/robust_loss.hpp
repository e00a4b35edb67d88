#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "pulson/core/landmarks.hpp"

namespace pulson::matching {

enum class LossKind : unsigned char { kStudent, kHuber, kCauchy, kTukey };

/// What takes the place of ½t², t = |r|/σ, for the residual r of a landmark, a vector of R^d:
///
///     student:ν   ½(ν + d) log(1 + t²/ν), −log of Student's density with ν degrees of freedom
///     huber:k     ½t² up to k, k t − ½k² beyond
///     cauchy:k    ½k² log(1 + t²/k²)
///     tukey:k     k²/6 (1 − (1 − t²/k²)³) up to k, constant beyond
///
/// (P. Huber and E. Ronchetti, Robust Statistics, 2009.) Only of Tukey's a landmark that is far off has no influence.
struct RobustLoss {
  LossKind kind = LossKind::kTukey;
  std::optional<double> constant{};  ///< ν or k; none: efficient_constant()
};

/// `student`, `huber`, `cauchy` or `tukey`, and perhaps `:` and a number above 0.
/// @throws InputError that lists the names
RobustLoss parse_loss(std::string_view text);
/// As parse_loss() reads it, with the constant for R^d.
std::string loss_spec(const RobustLoss& loss, Eigen::Index d);

/// The constant with which the mean of normal residuals in R^d, d = 1, 2, 3, has 95 % of the efficiency of least
/// squares for many landmarks. Student's scale is then that of greatest likelihood, of the others the standard
/// deviation.
double efficient_constant(LossKind kind, Eigen::Index d);

/// A landmark with less weight looks wrong.
inline constexpr double kSuspectWeight = 0.1;

/// "a.csv: 2 landmarks look wrong, of a weight below 0.1: 'tip', 7". @param suspects from 0, at least one
std::string note_of_suspects(const Landmarks& shape, const std::vector<int>& suspects);

/// Medians of χ² with 1, 2 and 3 degrees of freedom: of t² of normal residuals in R^d.
inline constexpr std::array<double, 3> kMedianSquare = {0.454936, 1.386294, 2.365974};

/// The weights w(t²) = 2 dρ/d(t²) of iterated least squares, in units of w(0): in [0, 1].
class LossWeight {
 public:
  LossWeight(const RobustLoss& loss, Eigen::Index d);

  /// @param square t²
  double operator()(double square) const;

  /// κ = E w(t²)t²/d, for Student's loss under its own law, else under the normal one: residuals of variance σ² and
  /// weight w have, where they are weighted by w/κ, the variance σ².
  double consistency() const { return consistency_; }

 private:
  LossKind kind_;
  double constant_;
  double consistency_;
};

}  // namespace pulson::matching
