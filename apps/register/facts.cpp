#include "register/facts.hpp"

#include <limits>
#include <optional>

namespace pulson {
namespace {

using matching::Registration;

// NaN where there is no match.
template <class Value>
double of_match(const SpecimenMatch& row, const Value& value) {
  return row.registration ? double{value(*row.registration)} : std::numeric_limits<double>::quiet_NaN();
}

using Prediction = matching::PredictionOfMatch;

// Nothing where prediction is undetermined, as for few landmarks, and for curves.
template <class Value>
std::optional<double> of_prediction(const SpecimenMatch& row, const Value& value) {
  return row.prediction ? std::optional<double>(value(*row.prediction)) : std::nullopt;
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
      {"matched", "matched", "whether rms is at most 3 sigma and no landmark is further than the largest of N may be",
       "", [](const R& r) { return r.registration && r.registration->matched(); }},
      {"prediction_error", "leave-one-out", "root mean square distance of a landmark from where the others predict it",
       "{:.4g}",
       [](const R& r) { return of_prediction(r, [](const Prediction& p) { return p.predictions.error(); }); }},
      {"alignment_error", "leave-one-out, aligned", "the same where the alignment alone predicts it", "{:.4g}",
       [](const R& r) { return of_prediction(r, [](const Prediction& p) { return p.aligned.error(); }); }},
      {"doubted", "doubted", "landmarks further from there than the largest of N may be", "{:.0f}", [](const R& r) {
         return of_prediction(r, [](const Prediction& p) { return static_cast<double>(p.doubted.size()); });
       }}};
  return facts;
}

}  // namespace pulson
