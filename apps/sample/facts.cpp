#include "sample/facts.hpp"

#include <cmath>

#include "core/undefined.hpp"

namespace pulson {
namespace {

const inference::Branch& branch_of(const NodeRow& row) { return row.results->problem.tree[row.branch]; }
const std::vector<inference::DrawSummary>& ends_of(const NodeRow& row) { return row.results->summary.ends[row.branch]; }

double deviation_of(const NodeRow& row) {
  double variance = 0;
  for (const inference::DrawSummary& at : ends_of(row))
    variance += at.sd * at.sd / static_cast<double>(ends_of(row).size());
  return std::sqrt(variance);
}

double least_ess_of(const NodeRow& row) {
  double least = INFINITY;
  for (const inference::DrawSummary& at : ends_of(row))
    least = min_or_undefined(least, min_or_undefined(at.ess_bulk, at.ess_tail));
  return least;
}

}  // namespace

const Facts<inference::PosteriorDraws>& posterior_facts() {
  using R = inference::PosteriorDraws;
  static const Facts<R> facts = {
      {"chains", "chains", "of the sampler", "", &R::chains},
      {"draws", "draws of each", "of each chain, after the warm-up", "", &R::draws},
      {"acceptance", "acceptance of paths", "mean probability that a move of paths is accepted", "{:.2f}",
       &R::acceptance},
      {"parameter_acceptance", "of parameters", "the same of parameters, 0 without any", "{:.2f}",
       &R::parameter_acceptance},
      {"step_angle", "angle of a step", "mean over the chains, radians", "{:.3g}", &R::step_angle},
      {"modes", "modes found", "by the searches, of the specimen that has most", "", &R::modes},
      {"path_evaluations", "paths evaluated", "by all chains", "", &R::path_evaluations},
      {"log_evidence.value", "log evidence", "log p(y) by bridge sampling, nats", "{:.3f}", &R::log_evidence},
      {"log_evidence.laplace", "the same by Laplace's approximation", "nats", "{:.3f}", &R::laplace_log_evidence},
      {"log_evidence.pareto_k", "Pareto k", "of the weights of the reference's draws", "{:.2f}",
       [](const R& r) { return defined(r.pareto_k); }},
      {"log_evidence.chain_pareto_k", "of the chains", "Pareto k of the chains' weights", "{:.2f}",
       [](const R& r) { return defined(r.chain_pareto_k); }},
      {"log_evidence.of_finer_steps.value", "its change with twice as many steps", "nats", "{:+.3f}",
       &R::of_finer_steps},
      {"warmup_seconds", "seconds of the warm-up", "of the warm-up", "{:.1f}", &R::warmup_seconds},
      {"seconds", "seconds", "of all, warm-up included", "{:.1f}", &R::seconds}};
  return facts;
}

const Facts<PosteriorSummary>& convergence_facts() {
  using R = PosteriorSummary;
  static const Facts<R> facts = {
      {"converged", "converged", "each R-hat is at most 1.01, and nothing refutes the chains", "", &R::converged},
      {"rhat_max", "largest R-hat", "of all that is drawn", "{:.3f}", [](const R& r) { return defined(r.worst_rhat); }},
      {"path.rhat_max", "largest R-hat of a position", "over q(T/2) and q(T)", "{:.3f}",
       [](const R& r) { return defined(r.rhat_max); }},
      {"path.ess_min", "least ESS of a position", "effective sample size, over q(T/2) and q(T)", "{:.0f}",
       [](const R& r) { return defined(r.ess_min); }}};
  return facts;
}

const Facts<inference::Confirmation>& confirmation_facts() {
  using R = inference::Confirmation;
  static const Facts<R> facts = {
      {"by", "confirmed by", "weighted draws or tempered chains", "", confirmed_by_words},
      {"log_evidence.value", "log evidence by them", "nats", "{:.3f}", &R::log_evidence},
      {"furthest", "furthest", "greatest difference from the chains, in standard errors", "{:.1f}", &R::furthest},
      {"furthest_of", "of", "what has it", "", &R::furthest_of},
      {"furthest_allowed", "allowed", "exceeded by chance once in 500", "{:.1f}", &R::furthest_allowed},
      {"agrees", "agrees", "whether the chains do", "", &R::agrees}};
  return facts;
}

const Facts<inference::PosteriorProblem>& posterior_model_facts() {
  using R = inference::PosteriorProblem;
  static const Facts<R> facts = {
      {"source", "source", "where the paths begin", "", [](const R& r) { return r.sources.front().source; }},
      {"noise", "noise", "at the prior medians", "",
       [](const R& r) { return r.specimens.front().system.noise->spec(); }},
      {"kernel", "kernel", "of the flow", "{}", [](const R& r) { return r.specimens.front().system.kernel.spec(); }},
      {"sigma", "sigma", "standard deviation of an observed coordinate, length units", "{:.4g}",
       [](const R& r) { return r.specimens.front().sigma; }},
      {"lambda", "lambda", "weight of the energy", "{:.4g}", [](const R& r) { return r.specimens.front().lambda; }},
      {"momentum_prior", "prior of the momenta", "kernel or smooth", "",
       [](const R& r) { return posterior::kMomentumPriors.name(r.momenta); }},
      {"integrator", "integrator", "of the paths", "",
       [](const R& r) { return std::string(r.specimens.front().integrator->name()); }},
      {"time", "time", "T", "{:.4g}", [](const R& r) { return r.specimens.front().grid.time; }},
      {"steps", "steps", "of time T", "", [](const R& r) { return r.specimens.front().grid.steps; }}};
  return facts;
}

const Facts<inference::DrawSummary>& draw_facts() {
  using R = inference::DrawSummary;
  static const Facts<R> facts = {
      {"mean", "mean", "of the draws", "{:.4g}", &R::mean},
      {"sd", "sd", "standard deviation of the draws", "{:.4g}", &R::sd},
      {"mcse", "MCSE", "Monte Carlo standard error of the mean", "{:.2g}", [](const R& r) { return defined(r.mcse); }},
      {"rhat", "R-hat", "of ranks, rank-normalised and folded", "{:.3f}", [](const R& r) { return defined(r.rhat); }},
      {"ess_bulk", "bulk ESS", "effective sample size", "{:.0f}", [](const R& r) { return defined(r.ess_bulk); }},
      {"ess_tail", "tail ESS", "the lesser one of both tails", "{:.0f}",
       [](const R& r) { return defined(r.ess_tail); }},
      {"q05", "5 %", "quantile", "{:.4g}", &R::q05},
      {"q50", "50 %", "median", "{:.4g}", &R::q50},
      {"q95", "95 %", "quantile", "{:.4g}", &R::q95}};
  return facts;
}

const Facts<NodeRow>& node_facts() {
  using R = NodeRow;
  static const Facts<R> facts = {
      {"node", "node", "name, or number where it has none", "",
       [](const R& r) { return node_name(r.results->problem, r.branch); }},
      {"parent", "parent", "node that the branch begins at, none for the root", "",
       [](const R& r) {
         const int parent = branch_of(r).parent;
         return parent < 0 ? std::string() : node_name(r.results->problem, static_cast<std::size_t>(parent));
       }},
      {"time", "time from it", "length of the branch", "{:.4g}", [](const R& r) { return branch_of(r).grid.time; }},
      {"steps", "steps", "of the branch", "", [](const R& r) { return branch_of(r).grid.steps; }},
      {"observed", "observed", "whether a target is there", "",
       [](const R& r) { return branch_of(r).data != nullptr; }},
      {"sd", "sd of a coordinate", "root mean square posterior deviation of a coordinate, length units", "{:.4g}",
       [](const R& r) { return deviation_of(r); }},
      {"ess_min", "least ESS", "least effective sample size of a coordinate", "{:.0f}",
       [](const R& r) { return defined(least_ess_of(r)); }}};
  return facts;
}

std::vector<NodeRow> node_rows(const PosteriorResults& results) {
  std::vector<NodeRow> rows;
  for (std::size_t b = 0; b < results.problem.tree.size(); ++b) rows.push_back({&results, b});
  return rows;
}

}  // namespace pulson
