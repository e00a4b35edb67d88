#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "pulson/inference/posterior.hpp"

namespace pulson {

/// One row of the summary's numbers by name.
struct NamedSummary {
  std::string name;
  inference::DrawSummary numbers;
};

/// Summaries of all that is drawn.
struct PosteriorSummary {
  std::vector<NamedSummary> parameters;                            ///< θ, and log_likelihood last
  std::vector<std::vector<inference::DrawSummary>> momenta;        ///< [specimen][landmark·d + axis]
  std::vector<std::vector<inference::DrawSummary>> middles, ends;  ///< q(T/2) and q(T), the same
  // The worst of several are undefined, NaN, where one is.
  double rhat_max = 0, ess_min = INFINITY;  ///< over q(T/2) and q(T)
  double momenta_rhat_max = 0, momenta_ess_min = INFINITY;
  /// Every R-hat at most kHighRhat, no diagnostic undefined, no weight too heavy, and what confirms the chains agrees.
  bool converged = false;
  bool refuted = false;     ///< it does not
  bool heavy_tail = false;  ///< of the weights, where tempered chains do not confirm that it does no harm
  double worst_rhat = 0;
  std::string worst;      ///< what has it
  std::string undefined;  ///< what has undefined diagnostics, empty: nothing
};

/// What `sample` found, and for which problem.
struct PosteriorResults {
  inference::PosteriorProblem problem;
  inference::SamplerOptions options;
  inference::PosteriorDraws draws;
  PosteriorSummary summary;
  std::vector<std::string> notes, warnings;
};

/// Of the node at the end of a branch; counted with the root where it has none.
std::string node_name(const inference::PosteriorProblem& problem, std::size_t branch);

PosteriorSummary summarise_posterior(const inference::PosteriorDraws& draws);

/// "weighted draws" or "tempered chains".
std::string confirmed_by_words(const inference::Confirmation& confirmation);

/// An R-hat, or an effective sample size, in words where it is undefined.
std::string rhat_text(double rhat);
std::string ess_text(double ess);

/// What scripts read: `summary.json`.
std::string summary_json(const PosteriorResults& results);

/// `draws.csv`: chain, draw, θ, log likelihood.
std::string draws_csv(const inference::PosteriorDraws& draws);

/// `momenta.npy`: [chain][draw][specimen][landmark][axis].
std::string momenta_npy(const inference::PosteriorProblem& problem, const inference::PosteriorDraws& draws);

/// `paths.npy`: [kept][specimen][time][landmark][axis].
std::string paths_npy(const inference::PosteriorProblem& problem, const inference::PosteriorDraws& draws);

/// Of a tree, `nodes.csv`: the shapes at its nodes, a row for each coordinate.
std::string nodes_csv(const PosteriorResults& results);

/// Of a tree, `nodes.npy`: [chain][draw][node][landmark][axis], in the order of nodes.csv.
std::string nodes_npy(const inference::PosteriorProblem& problem, const inference::PosteriorDraws& draws);

/// `calibration.json`
std::string calibration_json(const inference::PosteriorProblem& problem, const inference::CalibrationOptions& options,
                             const inference::Calibration& calibration);

}  // namespace pulson
