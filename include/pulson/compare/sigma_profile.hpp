#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "pulson/noise/noise_table.hpp"

namespace pulson::compare {

struct Comparison;

/// The scores of all models if σ were known, over σ.
struct SigmaProfile {
  Eigen::VectorXd sigma;   ///< length units, increasing, from half the least to twice the greatest of models that the
                           ///< fits do not distinguish
  Eigen::MatrixXd scores;  ///< [σ][model], nats; NaN where a model has no evidence there
  std::vector<Eigen::MatrixXd> shapes{};  ///< of each σ, [shape][model]: the evidence of which the scores are sums
  double seconds = 0;                     ///< that it took

  /// Models that the shapes do not distinguish at a σ: those whose score is at most 3, or two standard errors of the
  /// difference there, below the greatest.
  struct Range {
    double low = 0, high = 0;  ///< of σ
    std::vector<std::size_t> models;
    bool has_noise = true;     ///< false: a model without noise is among them
    bool is_favoured = false;  ///< it is, but below noise
  };
  /// From the least to the greatest σ. Neighbours differ in the models that are ahead where these have noise, in
  /// whether they have, and in whether it is favoured. A border is in the middle of log σ between two places.
  std::vector<Range> ranges(const Comparison& comparison) const;
};

/// At 5 values of σ a factor of √2 apart where σ is given, else at up to 9, from that of each fit outwards, and between
/// two at which the verdict differs, down to 5 % apart. At each, matches and numbers in turn, by the models linear
/// about the matches; the evidence is Laplace's, shifted to the score of the fit.
/// @param noises as compared
SigmaProfile profile_sigma(const Comparison& comparison, const std::vector<NoiseChoice>& noises);

}  // namespace pulson::compare
