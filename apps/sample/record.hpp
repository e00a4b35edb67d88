#pragma once

#include <string>
#include <vector>

#include "pulson/inference/posterior.hpp"

namespace pulson {

/// One row of the summary's numbers by name.
struct NamedSummary {
  std::string name;
  DrawSummary numbers;
};

/// Summaries of all that is drawn.
struct PosteriorSummary {
  std::vector<NamedSummary> parameters;                 ///< θ, and log_likelihood last
  std::vector<std::vector<DrawSummary>> momenta;        ///< [specimen][landmark·d + axis]
  std::vector<std::vector<DrawSummary>> middles, ends;  ///< q(T/2) and q(T), the same
  double rhat_max = 0, ess_min = 0;                     ///< over q(T/2) and q(T)
  double momenta_rhat_max = 0, momenta_ess_min = 0;
  bool converged = false;  ///< every R-hat at most kHighRhat
  double worst_rhat = 0;
  std::string worst;  ///< what has it
};

PosteriorSummary summarise_posterior(const PosteriorDraws& draws);

/// What scripts read: `summary.json`.
std::string summary_json(const PosteriorProblem& problem, const SamplerOptions& options, const PosteriorDraws& draws,
                         const PosteriorSummary& summary, const std::vector<std::string>& notes);

/// `draws.csv`: chain, draw, θ, log likelihood.
std::string draws_csv(const PosteriorDraws& draws);

/// `momenta.npy`: [chain][draw][specimen][landmark][axis].
std::string momenta_npy(const PosteriorProblem& problem, const PosteriorDraws& draws);

/// `paths.npy`: [kept][specimen][time][landmark][axis].
std::string paths_npy(const PosteriorProblem& problem, const PosteriorDraws& draws);

/// `calibration.json`
std::string calibration_json(const PosteriorProblem& problem, const CalibrationOptions& options,
                             const Calibration& calibration);

}  // namespace pulson
