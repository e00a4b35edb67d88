#include <algorithm>
#include <cmath>
#include <iterator>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cohort.hpp"
#include "core/csv_table.hpp"
#include "picture.hpp"
#include "pulson/core/version.hpp"
#include "records/record_text.hpp"
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
  json["rms"] = registration.rms();
  json["initial_rms"] = registration.initial_rms();
  json["energy"] = registration.cost.energy;
  json["action"] = registration.cost.action;
  json["data"] = registration.cost.data;
  json["total"] = registration.cost.total();
  json["momenta_norm"] = specimen.momenta_norm();
  json["converged"] = registration.converged;
  json["matched"] = registration.matched();
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
  text::CsvTable table{"specimen",     "rms",  "energy",      "action",  "total", "converged", "centroid_size",
                       "momenta_norm", "data", "initial_rms", "matched", "error", "folder"};
  const double none = std::nan("");
  for (const SpecimenMatch& specimen : cohort.specimens) {
    table.text(specimen.name);
    if (const auto& registration = specimen.registration) {
      const matching::MatchingCost& cost = registration->cost;
      table.numbers(registration->rms(), cost.energy, cost.action, cost.total(), registration->converged ? 1 : 0,
                    specimen.centroid_size, specimen.momenta_norm(), cost.data, registration->initial_rms(),
                    registration->matched() ? 1 : 0);
      table.empty().text(specimen.folder).end_row();
    } else {
      table.numbers(none, none, none, none, 0, specimen.centroid_size, none, none, none, 0);
      table.text(specimen.error).missing().end_row();
    }
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
  html::ReportTable table{
      {"specimen", "shape", "rms", "rms before", "J", "energy", "momenta norm", "centroid size", "converged"},
      {},
      "Source in blue, target as rings, result dark. The norm of the momenta is the length of the "
      "geodesic, in length units. Click a column heading to sort."};
  if (has_noise) table.header.emplace_back("action");
  for (const SpecimenMatch& specimen : cohort.specimens) {
    std::vector<html::ReportCell> row = {{specimen.name}};
    if (const auto& registration = specimen.registration) {
      row.push_back({.text = "", .sketch = sketch(*registration)});
      for (const double value : {registration->rms(), registration->initial_rms(), registration->cost.total(),
                                 registration->cost.energy, specimen.momenta_norm(), specimen.centroid_size})
        row.push_back({report_number(value)});
      row.push_back({registration->converged ? (registration->matched() ? "yes" : "yes, not matched") : "no"});
    } else {
      row.insert(row.end(), 6, {""});
      row.push_back({report_number(specimen.centroid_size)});
      row.push_back({.text = "failed: " + specimen.error, .outlier = true});
    }
    if (has_noise) row.push_back({specimen.registration ? report_number(specimen.registration->cost.action) : ""});
    table.rows.push_back(std::move(row));
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
