// What linear models found: facts, record, tables and the summary.

#include <algorithm>

#include <fmt/format.h>

#include "atlas/results.hpp"
#include "atlas/shape_models.hpp"
#include "core/csv_table.hpp"
#include "core/text.hpp"
#include "records/record_text.hpp"
#include "shell/messages.hpp"

namespace pulson {
namespace {

using Json = formats::Json;

using Test = cohort::ModelTest ShapeModel::*;

const cohort::ModelDesign& design_of(const TermRow& row) { return row.model->design; }

bool is_term(const TermRow& row) { return row.term < design_of(row).terms.size(); }

std::string term_label(const TermRow& row) {
  const auto& terms = design_of(row).terms;
  if (is_term(row)) return terms[row.term].label;
  return row.term == terms.size() ? "residuals" : "total";
}

long degrees(const TermRow& row) {
  if (is_term(row)) return design_of(row).terms[row.term].df;
  const auto& columns = design_of(row).columns;
  return row.term == design_of(row).terms.size() ? long{design_of(row).residual_df()} : long{columns.rows() - 1};
}

double sum_of_squares(const TermRow& row, Test test) {
  const cohort::ModelTest& found = row.model->*test;
  if (is_term(row)) return found.terms[row.term].ss;
  return row.term == found.terms.size() ? found.residual_ss : found.total_ss;
}

double share(const TermRow& row, Test test) { return sum_of_squares(row, test) / (row.model->*test).total_ss; }

// Of a term; NaN in the other lines.
template <class Value>
double of_term(const TermRow& row, Test test, const Value& value) {
  return is_term(row) ? value((row.model->*test).terms[row.term]) : text::kMissing;
}

Estimate effect(const TermRow& row, Test test) {
  return {of_term(row, test, [](const cohort::TermTest& found) { return found.z; }),
          of_term(row, test, [](const cohort::TermTest& found) { return found.z_error; })};
}

constexpr Test kProcrustes = &ShapeModel::procrustes, kMomenta = &ShapeModel::momenta;

const cohort::PairTest& pair_of(const PairRow& row, Test test) { return (row.model->*test).pairs[row.pair]; }

const cohort::ModelDesign::Term& term_of(const PairRow& row) {
  return row.model->design.terms[static_cast<std::size_t>(pair_of(row, kProcrustes).term)];
}

std::string group_name(const PairRow& row, int group) {
  return term_of(row).groups[static_cast<std::size_t>(group)].name;
}

Json test_json(const ShapeModel& model, Test test, std::size_t term) {
  const cohort::TermTest& found = (model.*test).terms[term];
  return {{"ss", found.ss},
          {"r_squared", found.r_squared},
          {"f", records::defined_or_null(found.f)},
          {"z", records::defined_or_null(found.z)},
          {"z_error", records::defined_or_null(found.z_error)},
          {"p_value", found.p_value}};
}

Json pair_json(const cohort::PairTest& pair) {
  return {{"distance", pair.distance}, {"z", records::defined_or_null(pair.z)}, {"p_value", pair.p_value}};
}

Json landmarks_json(const Points& points) {
  Json rows = Json::array();
  for (const auto& point : points.colwise()) rows.push_back(std::vector<double>(point.begin(), point.end()));
  return rows;
}

Json model_json(const ShapeModel& model) {
  Json json{{"formula", model.formula.text()},
            {"specimens", model.design.specimens.size()},
            {"permutations", model.procrustes.permutations},
            {"terms", Json::array()},
            {"residuals",
             {{"df", model.design.residual_df()},
              {"procrustes", {{"ss", model.procrustes.residual_ss}}},
              {"momenta", {{"ss", model.momenta.residual_ss}}}}},
            {"coefficients", Json::array()},
            {"pairs", Json::array()}};
  for (std::size_t t = 0; t < model.design.terms.size(); ++t)
    json["terms"].push_back({{"term", model.design.terms[t].label},
                             {"df", model.design.terms[t].df},
                             {"procrustes", test_json(model, kProcrustes, t)},
                             {"momenta", test_json(model, kMomenta, t)}});
  for (std::size_t c = 0; c < model.design.names.size(); ++c)
    json["coefficients"].push_back({{"name", model.design.names[c]},
                                    {"procrustes", landmarks_json(model.procrustes_coefficients[c])},
                                    {"momenta", landmarks_json(model.momenta_coefficients[c])}});
  for (std::size_t p = 0; p < model.procrustes.pairs.size(); ++p) {
    const PairRow row{&model, p};
    const cohort::PairTest& pair = pair_of(row, kProcrustes);
    json["pairs"].push_back({{"term", term_of(row).label},
                             {"groups", {group_name(row, pair.first), group_name(row, pair.second)}},
                             {"procrustes", pair_json(pair)},
                             {"momenta", pair_json(pair_of(row, kMomenta))}});
  }
  return json;
}

void print_pairs(const ShapeModel& model) {
  constexpr std::size_t kMostPairs = 10;
  const std::size_t count = model.procrustes.pairs.size();
  for (std::size_t p = 0; p < std::min(count, kMostPairs); ++p) {
    const PairRow row{&model, p};
    const cohort::PairTest &pair = pair_of(row, kProcrustes), &of_momenta = pair_of(row, kMomenta);
    print_text("            {} – {}: Procrustes distance {:.4g}, p {:.4g}; momenta {:.4g}, p {:.4g}\n",
               group_name(row, pair.first), group_name(row, pair.second), pair.distance, pair.p_value,
               of_momenta.distance, of_momenta.p_value);
  }
  if (count > kMostPairs) print_text("            and {} more in pairs.csv\n", counted(count - kMostPairs, "pair"));
}

}  // namespace

const Facts<TermRow>& term_facts() {
  using R = TermRow;
  static const Facts<R> facts = {
      {"model", "model", "formula", "", [](const R& r) { return r.model->formula.text(); }},
      {"term", "term", "of the formula, after those before it; residuals; total", "", term_label},
      {"df", "df", "degrees of freedom", "", degrees},
      {"procrustes_ss", "SS", "sum of squares of Procrustes coordinates", "{:.4g}",
       [](const R& r) { return sum_of_squares(r, kProcrustes); }},
      {"procrustes_r_squared", "R²", "part of the total", "{:.4f}", [](const R& r) { return share(r, kProcrustes); }},
      {"procrustes_f", "F", "mean square over that of the residuals", "{:.4g}",
       [](const R& r) { return of_term(r, kProcrustes, [](const auto& found) { return found.f; }); }},
      {"procrustes_z", "Z", "effect size, with its Monte Carlo error", "{:.2f}",
       [](const R& r) { return effect(r, kProcrustes); }},
      {"procrustes_p_value", "p", "by permutations of residuals", "{:.4g}",
       [](const R& r) { return of_term(r, kProcrustes, [](const auto& found) { return found.p_value; }); }},
      {"ss", "momenta: SS", "the same of momenta in the kernel's metric", "{:.4g}",
       [](const R& r) { return sum_of_squares(r, kMomenta); }},
      {"r_squared", "R²", "of momenta", "{:.4f}", [](const R& r) { return share(r, kMomenta); }},
      {"f", "F", "of momenta", "{:.4g}",
       [](const R& r) { return of_term(r, kMomenta, [](const auto& found) { return found.f; }); }},
      {"z", "Z", "of momenta", "{:.2f}", [](const R& r) { return effect(r, kMomenta); }},
      {"p_value", "p", "of momenta", "{:.4g}",
       [](const R& r) { return of_term(r, kMomenta, [](const auto& found) { return found.p_value; }); }}};
  return facts;
}

const Facts<PairRow>& pair_facts() {
  using R = PairRow;
  static const Facts<R> facts = {
      {"model", "model", "formula", "", [](const R& r) { return r.model->formula.text(); }},
      {"term", "term", "of factors", "", [](const R& r) { return term_of(r).label; }},
      {"first", "first", "a group", "", [](const R& r) { return group_name(r, pair_of(r, kProcrustes).first); }},
      {"second", "second", "another", "", [](const R& r) { return group_name(r, pair_of(r, kProcrustes).second); }},
      {"procrustes_distance", "Procrustes distance", "of their least-squares means", "{:.4g}",
       [](const R& r) { return pair_of(r, kProcrustes).distance; }},
      {"procrustes_z", "Z", "effect size", "{:.2f}", [](const R& r) { return pair_of(r, kProcrustes).z; }},
      {"procrustes_p_value", "p", "by permutations of residuals", "{:.4g}",
       [](const R& r) { return pair_of(r, kProcrustes).p_value; }},
      {"distance", "momenta: distance", "of their mean momenta, in the kernel's metric", "{:.4g}",
       [](const R& r) { return pair_of(r, kMomenta).distance; }},
      {"z", "Z", "of momenta", "{:.2f}", [](const R& r) { return pair_of(r, kMomenta).z; }},
      {"p_value", "p", "of momenta", "{:.4g}", [](const R& r) { return pair_of(r, kMomenta).p_value; }}};
  return facts;
}

std::vector<TermRow> term_rows(const std::vector<ShapeModel>& models) {
  std::vector<TermRow> rows;
  for (const ShapeModel& model : models)
    for (std::size_t t = 0; t < model.design.terms.size() + 2; ++t) rows.push_back({&model, t});
  return rows;
}

std::vector<PairRow> pair_rows(const std::vector<ShapeModel>& models) {
  std::vector<PairRow> rows;
  for (const ShapeModel& model : models)
    for (std::size_t p = 0; p < model.procrustes.pairs.size(); ++p) rows.push_back({&model, p});
  return rows;
}

formats::Json models_json(const AtlasResults& results) {
  Json json = Json::array();
  for (const ShapeModel& model : results.models) json.push_back(model_json(model));
  return json;
}

std::string coefficients_csv(const AtlasResults& results) {
  const Landmarks& shape = results.atlas.template_shape;
  text::CsvTable table;
  table.words({"model", "coefficient", "landmark"});
  for (const char* prefix : {"procrustes_", "p"})
    for (int axis = 0; axis < shape.dimension(); ++axis)
      table.word(fmt::format("{}{}", prefix, text::kAxisLetters[static_cast<std::size_t>(axis)]));
  table.end_row();
  const std::vector<int>& common = results.procrustes.landmarks;
  for (const ShapeModel& model : results.models)
    for (std::size_t c = 0; c < model.design.names.size(); ++c)
      for (int a = 0; a < shape.count(); ++a) {
        Eigen::VectorXd of_procrustes = Eigen::VectorXd::Constant(shape.dimension(), text::kMissing);
        if (const auto place = std::find(common.begin(), common.end(), a); place != common.end())
          of_procrustes = model.procrustes_coefficients[c].col(place - common.begin());
        table.text(model.formula.text()).text(model.design.names[c]).number(shape.number(a));
        table.numbers(of_procrustes).numbers(model.momenta_coefficients[c].col(a)).end_row();
      }
  return std::move(table).take();
}

void print_models(const AtlasResults& results) {
  for (const ShapeModel& model : results.models) {
    print_text("model       {}: {}, {} permutations\n", model.formula.text(),
               counted(static_cast<std::int64_t>(model.design.specimens.size()), "specimen"),
               model.procrustes.permutations);
    std::vector<std::vector<std::string>> table{{"", "", "Procrustes", "", "", "", "momenta", "", "", ""}};
    const Facts<TermRow> facts =
        chosen(term_facts(), {"term", "df", "procrustes_r_squared", "procrustes_f", "procrustes_z",
                              "procrustes_p_value", "r_squared", "f", "z", "p_value"});
    for (std::vector<std::string>& row : text_table(facts, term_rows({model}))) table.push_back(std::move(row));
    table.pop_back();  // the total
    for (std::vector<std::string>& row : table) row.insert(row.begin(), "          ");
    print_table(table);
    print_pairs(model);
  }
}

}  // namespace pulson
