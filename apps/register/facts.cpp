#include "register/facts.hpp"

#include <limits>

namespace pulson {
namespace {

using matching::Registration;

// NaN where there is no match.
template <class Value>
double of_match(const SpecimenMatch& row, const Value& value) {
  return row.registration ? double{value(*row.registration)} : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

const Facts<SpecimenMatch>& match_facts() {
  using R = SpecimenMatch;
  static const Facts<R> facts = {
      {"specimen", "specimen", "name as given", "", [](const R& r) { return r.name; }},
      {"rms", "rms", "root mean square distance of a landmark from its target, length units", "{:.4g}",
       [](const R& r) { return of_match(r, [](const Registration& m) { return m.rms(); }); }},
      {"energy", "energy", "(lambda/2) p0'K p0", "{:.4g}",
       [](const R& r) { return of_match(r, [](const Registration& m) { return m.cost.energy; }); }},
      {"action", "action", "1/2 sum |dW|^2/dt", "{:.4g}",
       [](const R& r) { return of_match(r, [](const Registration& m) { return m.cost.action; }); }},
      {"total", "J", "energy + action + data", "{:.4g}",
       [](const R& r) { return of_match(r, [](const Registration& m) { return m.cost.total(); }); }},
      {"converged", "converged", "whether the search converged", "",
       [](const R& r) { return r.registration && r.registration->converged; }},
      {"centroid_size", "centroid size", "of the shape as given, length units", "{:.4g}",
       [](const R& r) { return r.centroid_size; }},
      {"momenta_norm", "momenta norm", "sqrt(p0'K p0), the length of the geodesic, length units", "{:.4g}",
       [](const R& r) { return r.registration ? r.momenta_norm() : std::numeric_limits<double>::quiet_NaN(); }},
      {"data", "data", "1/2 |q(T) - y|^2/sigma^2", "{:.4g}",
       [](const R& r) { return of_match(r, [](const Registration& m) { return m.cost.data; }); }},
      {"initial_rms", "rms before", "the same as rms, of the aligned source", "{:.4g}",
       [](const R& r) { return of_match(r, [](const Registration& m) { return m.initial_rms(); }); }},
      {"matched", "matched", "whether rms is at most 3 sigma", "",
       [](const R& r) { return r.registration && r.registration->matched(); }}};
  return facts;
}

}  // namespace pulson
