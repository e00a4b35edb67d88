#pragma once

#include "importance.hpp"

namespace pulson::inference {

/// Whether weighted draws or chains of other temperatures agree with the chains, and by how much not: in the log
/// evidence, and in the means of θ, p0, q(T) and q(T/2), in standard errors of the difference. The threshold is that of
/// all of these together: one in 500 is exceeded by chance.
Confirmation confirmed_by(const ImportanceEstimate& other, const ChainSetting& setting, const PosteriorDraws& draws);
Confirmation confirmed_by(const PosteriorDraws& tempered, const PosteriorDraws& draws);

/// Whether weighted draws determine anything: k at most kHighParetoK, and enough of them.
bool is_of_use(const ImportanceEstimate& estimate);
/// Whether tempered chains do: their exchanges bring points of the prior to the posterior, and they have mixed.
bool is_of_use(const PosteriorDraws& tempered);

}  // namespace pulson::inference
