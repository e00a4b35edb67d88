#pragma once

#include "pulson/core/name_table.hpp"

namespace pulson::posterior {

/// The prior of the momenta of one shape,
///
///     kernel:  p0 ~ N(0, (λK)⁻¹),
///     smooth:  p0 ~ N(0, (λ(K + λ²S K⁻¹S))⁻¹),   S = 3²(σ²I + T C)/T²,
///
/// K of the source, C the covariance by which noise moves landmarks in unit time there at rest, as a mean over the
/// axes, N×N. A direction of K with eigenvalue κ moves landmarks by a variance of κT²/λ; `smooth` has half of it where
/// that is three standard deviations of noise and errors of the data, and a hundredth where it is a tenth of that
/// variance. Momenta of `kernel` at neighbours have no bound as landmarks become dense, and each moves with noise of
/// its own, so that paths depend on both in a strongly bent way. (An outline of 77 landmarks: log p(y) is 185 with
/// `kernel`, 202, 208, 211.6 and 200 where S is that of 1, √3, √10 and √30 deviations.)
enum class MomentumPrior { kKernel, kSmooth };

inline constexpr EnumNames<MomentumPrior, 2> kMomentumPriors{
    "prior of the momenta", {{{"kernel", MomentumPrior::kKernel}, {"smooth", MomentumPrior::kSmooth}}}};

}  // namespace pulson::posterior
