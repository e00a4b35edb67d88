#include <algorithm>
#include <cmath>
#include <iterator>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/csv_table.hpp"
#include "picture.hpp"
#include "pulson/core/version.hpp"
#include "records/record_text.hpp"
#include "register/facts.hpp"
#include "shell/report_parts.hpp"

namespace pulson {
namespace {

using Json = nlohmann::ordered_json;

Json specimen_json(const SpecimenMatch& specimen) {
  Json json{{"name", specimen.name},
            {"folder", specimen.registration ? Json(specimen.folder) : Json(nullptr)},
            {"source", specimen.source},
            {"centroid_size", specimen.centroid_size}};
  if (!specimen.registration) {
    json["error"] = specimen.error;
    return json;
  }
  const matching::Registration& registration = *specimen.registration;
  json["record"] = specimen.folder + "/registration.json";
  for (const Fact<SpecimenMatch>& fact : match_facts())
    if (fact.key != "specimen" && fact.key != "centroid_size") add_fact(json, fact.key, fact.value(specimen));
  json["kernel"] = registration.kernel;
  json["lambda"] = registration.lambda;
  json["sigma"] = registration.sigma;
  json["seconds"] = registration.seconds;
  return json;
}

// Where it starts, is to go and ends.
html::ReportSketch sketch(const matching::Registration& registration) {
  return {registration.source,
          registration.data.kind == matching::DataKind::kLandmarks ? registration.target.points : Points(),
          registration.result};
}

}  // namespace

double SpecimenMatch::momenta_norm() const {
  const matching::Registration& found = *registration;
  const Points velocity =
      registration_system(found).kernel.apply(found.source.points, found.source.points, found.momenta);
  return std::sqrt(found.momenta.cwiseProduct(velocity).sum());
}

std::string cohort_csv(const CohortMatches& cohort) {
  text::CsvTable table;
  add_header(table, match_facts(), cohort.specimens.front());
  table.words({"error", "folder"}).end_row();
  for (const SpecimenMatch& specimen : cohort.specimens) {
    add_facts(table, match_facts(), specimen);
    if (specimen.registration)
      table.empty().text(specimen.folder).end_row();
    else
      table.text(specimen.error).missing().end_row();
  }
  return std::move(table).take();
}

std::string cohort_json(const CohortMatches& cohort) {
  Json json{{"source", cohort.source.source},
            {"failed", cohort.failed()},
            {"unconverged", cohort.unconverged()},
            {"specimens", Json::array()},
            {"notes", cohort.notes},
            {"seconds", cohort.seconds},
            {"version", version()}};
  for (const SpecimenMatch& specimen : cohort.specimens) json["specimens"].push_back(specimen_json(specimen));
  return records::record_text(json);
}

namespace {

html::ReportTable specimen_table(const CohortMatches& cohort) {
  const bool has_noise = std::any_of(
      cohort.specimens.begin(), cohort.specimens.end(),
      [](const SpecimenMatch& specimen) { return specimen.registration && specimen.registration->noise != "none"; });
  Facts<SpecimenMatch> facts = chosen(match_facts(), {"specimen", "rms", "initial_rms", "total", "energy",
                                                      "momenta_norm", "centroid_size", "prediction_error", "doubted"});
  if (has_noise) facts.push_back(fact_of(match_facts(), "action"));
  html::ReportTable table =
      report_table(facts, cohort.specimens,
                   "Source in blue, target as rings, result dark. The norm of the momenta is the length of the "
                   "geodesic, in length units. Click a column heading to sort.");
  table.header.insert(table.header.begin() + 1, "shape");
  table.header.emplace_back("converged");
  for (std::size_t s = 0; s < cohort.specimens.size(); ++s) {
    const SpecimenMatch& specimen = cohort.specimens[s];
    std::vector<html::ReportCell>& row = table.rows[s];
    html::ReportCell shape{.text = ""}, state{.text = "failed: " + specimen.error, .outlier = true};
    if (const auto& registration = specimen.registration) {
      shape.sketch = sketch(*registration);
      state = {registration->converged ? (registration->matched() ? "yes" : "yes, not matched") : "no"};
    }
    row.insert(row.begin() + 1, std::move(shape));
    row.push_back(std::move(state));
  }
  return table;
}

}  // namespace

html::HtmlReport cohort_report(const CohortMatches& cohort) {
  const auto count = static_cast<std::int64_t>(cohort.specimens.size());
  std::string lead = fmt::format(
      "{} of {} landmarks in {}D, registered from {}.", count_in_words(count, "shape", "shapes"), cohort.source.count(),
      cohort.source.dimension(), cohort.source.source.starts_with("mean of") ? "their mean" : cohort.source.source);
  std::vector<double> rms;
  for (const SpecimenMatch& specimen : cohort.specimens)
    if (specimen.registration) rms.push_back(specimen.registration->rms());
  std::sort(rms.begin(), rms.end());
  if (!rms.empty())
    lead += fmt::format(" Root mean square distance: median {}, largest {}.", report_number(rms[rms.size() / 2], 3),
                        report_number(rms.back(), 3));
  if (cohort.failed() > 0) lead += fmt::format(" {} failed.", cohort.failed());
  if (cohort.unconverged() > 0) lead += fmt::format(" {} did not converge.", cohort.unconverged());
  html::HtmlReport report =
      new_report(short_name(cohort.source) + " → " + counted(count, "shape"), lead, {}, cohort.notes);
  report.sections.push_back({"Specimens", {specimen_table(cohort)}});
  return report;
}

}  // namespace pulson
