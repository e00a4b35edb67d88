#include "facts.hpp"

#include "core/undefined.hpp"
#include "shell/probability_text.hpp"

namespace pulson {

double SampledProbability::known_error() const { return value > 0 && value < 1 ? standard_error : kUndefined; }

std::string SampledProbability::text() const { return probability_text(*this, paths); }

const Facts<PairRun>& pair_equation_facts() {
  using R = PairRun;
  static const Facts<R> facts = {
      {"kernel", "kernel", "of the flow", "{}", [](const R& r) { return r.equation.kernel.spec(); }},
      {"noise", "noise", "the noise model", "{}", &R::noise},
      {"time", "time", "T", "{:.4g}", [](const R& r) { return r.equation.time; }},
      {"probability", "probability of crossing", "that the order has changed at T, by the finest grids", "{:.6g}",
       [](const R& r) { return r.crossing.probability; }},
      {"error", "its error", "of the last of the grids", "{:.1e}", [](const R& r) { return r.crossing.error; }},
      {"tolerance", "tolerance", "of the error, in parts of the probability", "{:g}", &R::tolerance},
      {"converged", "tolerance reached", "whether the error is within the tolerance", "",
       [](const R& r) { return r.crossing.converged; }},
      {"order", "observed order", "of the error in the spacing, where the grids show it", "{:.3g}",
       [](const R& r) { return defined(r.crossing.order > 0 ? r.crossing.order : kUndefined); }},
      {"gap_points", "gaps of the finest grid", "its points along the gap q2 - q1", "",
       [](const R& r) { return r.crossing.gap_points; }},
      {"momentum_lines", "momenta of the finest grid", "its lines along the momentum", "",
       [](const R& r) { return r.crossing.momentum_lines; }},
      {"steps", "steps of the finest grid", "in time", "", [](const R& r) { return r.crossing.steps; }},
      {"seconds", "seconds", "of all grids", "{:.2f}", [](const R& r) { return r.crossing.seconds; }},
      {"curve_error", "largest change of the curve", "of the probability over time, between the last two grids",
       "{:.1e}", [](const R& r) { return r.crossing.curve_error; }}};
  return facts;
}

const Facts<PairRun>& sampled_pair_facts() {
  using R = PairRun;
  static const Facts<R> facts = {{"sampled.probability", "sampled probability", "of clean sample paths", "{:.4g}",
                                  [](const R& r) { return defined(r.sampled.back().value); }},
                                 {"sampled.standard_error", "its standard error", "undefined where all paths are alike",
                                  "{:.2g}", [](const R& r) { return defined(r.sampled.back().known_error()); }},
                                 {"sampled.samples", "sample paths", "that were drawn", "", &R::samples},
                                 {"sampled.clean", "clean sample paths", "followed to the end", "",
                                  [](const R& r) { return r.sampled.back().paths; }},
                                 {"sampled.dt", "time step of the paths", "of the integrator", "{:.4g}", &R::dt}};
  return facts;
}

}  // namespace pulson
