#include "atlas/facts.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "core/text.hpp"
#include "shell/options.hpp"

namespace pulson {
namespace {

const cohort::AtlasSpecimen& specimen_of(const SpecimenRow& row) { return row.results->atlas.specimens[row.specimen]; }

double eigenvalue(const cohort::ShapeModes& modes, Eigen::Index k) {
  return k < modes.eigenvalues.size() ? modes.eigenvalues[k] : text::kMissing;
}

std::string fitted_names(const cohort::Atlas& atlas) {
  std::vector<std::string> names;
  if (atlas.fitted_kernel) names.emplace_back("kernel");
  if (atlas.fitted_lambda) names.emplace_back("lambda");
  if (atlas.fitted_sigma) names.emplace_back("sigma");
  return names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "));
}

}  // namespace

const Facts<AtlasResults>& atlas_facts() {
  using R = AtlasResults;
  static const Facts<R> facts = {
      {"kernel", "kernel", "of the flow", "{:.4g}", [](const R& r) { return r.atlas.kernel.spec(); }},
      {"lambda", "lambda", "weight of the energy", "{:.4g}", [](const R& r) { return r.atlas.lambda; }},
      {"sigma", "sigma", "standard deviation of an observed coordinate, length units", "{:.4g}",
       [](const R& r) { return r.atlas.sigma; }},
      {"fitted", "fitted", "those of kernel, lambda and sigma that the shapes determined", "",
       [](const R& r) { return fitted_names(r.atlas); }},
      {"noise", "noise", "the noise whose action is minimised with the energy", "{:.4g}",
       [](const R& r) { return r.atlas.beta > 0 ? fmt::format("ch-sd:beta={}", r.atlas.beta) : std::string("none"); }},
      {"mode", "mode", "deterministic, or metamorphosis with noise", "",
       [](const R& r) { return std::string(r.atlas.beta > 0 ? "metamorphosis" : "deterministic"); }},
      {"alignment", "aligned", "of each specimen onto the mean", "",
       [](const R& r) { return std::string(alignment_name(r.atlas.alignment)); }},
      {"steps", "steps", "of each geodesic", "", [](const R& r) { return long{r.atlas.steps}; }},
      {"converged", "converged", "whether the template and all matches did", "",
       [](const R& r) { return r.converged(); }},
      {"iterations", "iterations", "of the template", "", [](const R& r) { return long{r.atlas.iterations}; }},
      {"movement", "last movement of the template, in diameters", "of the template's landmarks, in diameters", "{:.4g}",
       [](const R& r) { return r.atlas.movement; }},
      {"shots", "geodesics shot", "geodesics shot in the search", "", [](const R& r) { return long{r.atlas.shots}; }},
      {"exp_log_error", "exp(log) error, in diameters",
       "largest distance between targets and shot targets, in diameters", "{:.4g}",
       [](const R& r) { return r.atlas.exp_log_error(); }},
      {"step_error", "error of the time steps, in diameters", "of the ends of the geodesics, in diameters", "{:.4g}",
       [](const R& r) { return r.atlas.step_error; }},
      {"seconds", "seconds", "of the search", "{:.2f}", [](const R& r) { return r.seconds; }}};
  return facts;
}

const Facts<SpecimenRow>& specimen_facts() {
  using R = SpecimenRow;
  static const Facts<R> facts = {
      {"specimen", "specimen", "name as given", "", [](const R& r) { return r.results->names[r.specimen]; }},
      {"rms", "rms", "root mean square distance of a landmark from its target, length units", "{:.4g}",
       [](const R& r) { return specimen_of(r).rms(); }},
      {"energy", "energy", "(lambda/2) p0'K p0", "{:.4g}", [](const R& r) { return specimen_of(r).cost.energy; }},
      {"action", "action", "1/2 sum |u|^2 dt of the noise", "{:.4g}",
       [](const R& r) { return specimen_of(r).cost.action; }},
      {"total", "J", "energy + action + data", "{:.4g}", [](const R& r) { return specimen_of(r).cost.total(); }},
      {"converged", "converged", "whether the match converged", "",
       [](const R& r) { return specimen_of(r).converged; }},
      {"centroid_size", "centroid size", "of the shape as given, length units", "{:.4g}",
       [](const R& r) { return specimen_of(r).centroid_size; }},
      {"momenta_norm", "norm of momenta", "sqrt(p0'K p0), the length of the geodesic", "{:.4g}",
       [](const R& r) { return r.momenta_norm; }},
      {"data", "data", "1/2 |q(1) - y|^2/sigma^2", "{:.4g}", [](const R& r) { return specimen_of(r).cost.data; }}};
  return facts;
}

const Facts<ModeRow>& mode_facts() {
  using R = ModeRow;
  static const Facts<R> facts = {
      {"mode", "mode", "number, by its variance", "", [](const R& r) { return static_cast<long>(r.mode + 1); }},
      {"eigenvalue", "variance", "variance of the momenta along the mode, in the kernel's metric", "{:.4g}",
       [](const R& r) { return eigenvalue(r.results->modes, r.mode); }},
      {"fraction", "part", "of the momenta's variance", "{:.2f} %",
       [](const R& r) { return eigenvalue(r.results->modes, r.mode) / r.results->modes.total(); }, 100},
      {"procrustes_eigenvalue", "of Procrustes coordinates", "variance of Procrustes coordinates along their mode",
       "{:.4g}", [](const R& r) { return eigenvalue(r.results->procrustes.modes, r.mode); }},
      {"procrustes_fraction", "part", "of the variance of Procrustes coordinates", "{:.2f} %",
       [](const R& r) { return eigenvalue(r.results->procrustes.modes, r.mode) / r.results->procrustes.modes.total(); },
       100}};
  return facts;
}

std::vector<SpecimenRow> specimen_rows(const AtlasResults& results) {
  const Eigen::MatrixXd gram = results.atlas.metric();
  std::vector<SpecimenRow> rows;
  for (std::size_t i = 0; i < results.names.size(); ++i) {
    const Points& momenta = results.atlas.specimens[i].momenta;
    rows.push_back({&results, i, std::sqrt(momenta.cwiseProduct(momenta * gram).sum())});
  }
  return rows;
}

std::vector<ModeRow> mode_rows(const AtlasResults& results) {
  std::vector<ModeRow> rows;
  const Eigen::Index count = std::max(results.modes.eigenvalues.size(), results.procrustes.modes.eigenvalues.size());
  for (Eigen::Index k = 0; k < count; ++k) rows.push_back({&results, k});
  return rows;
}

}  // namespace pulson
