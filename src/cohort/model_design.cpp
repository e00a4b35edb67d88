// Design matrices of formulas.

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <set>

#include <Eigen/QR>
#include <fmt/format.h>

#include "core/first_names.hpp"
#include "core/text.hpp"
#include "pulson/cohort/linear_model.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::cohort {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Kind = ModelExpression::Kind;

constexpr double kDependent = 1e-7;  // of a column's norm, that is left beside the columns before it: that of R's lm
constexpr std::size_t kMostLevels = 200;

// A variable's value for each specimen of the data: a number, NaN where there is none, or a level, −1 where there is
// none.
struct Values {
  VectorXd numbers{};
  std::vector<std::string> levels{};
  std::vector<int> level_of{};

  bool is_factor() const { return numbers.size() == 0; }
};

bool is_missing_field(const std::string& field) { return text::is_missing(text::trim(field)); }

class Evaluator {
 public:
  explicit Evaluator(const ModelData& data) : data_(data) {}

  Values of(const ModelVariable& variable) const {
    const ModelExpression& expression = variable.expression;
    if (expression.kind != Kind::kColumn) return {finite(variable, numbers(variable.label, expression))};
    const std::vector<std::string>& fields = column(expression.text);
    const bool are_numbers = std::all_of(fields.begin(), fields.end(), [](const std::string& field) {
      return is_missing_field(field) || text::is_number(text::trim(field));
    });
    if (!variable.is_factor && are_numbers) return {finite(variable, numbers(variable.label, expression))};
    return factor(fields);
  }

 private:
  const std::vector<std::string>& column(const std::string& name) const {
    const auto found = data_.columns.find(name);
    if (found == data_.columns.end())
      throw InputError(fmt::format("the model has '{}', of which there is no column", name));
    return found->second;
  }

  Values factor(const std::vector<std::string>& fields) const {
    Values values;
    std::set<std::string> names;
    for (const std::string& field : fields)
      if (!is_missing_field(field)) names.emplace(text::trim(field));
    values.levels.assign(names.begin(), names.end());
    for (const std::string& field : fields) {
      const auto place = std::find(values.levels.begin(), values.levels.end(), text::trim(field));
      values.level_of.push_back(is_missing_field(field) ? -1 : static_cast<int>(place - values.levels.begin()));
    }
    return values;
  }

  VectorXd numbers(const std::string& label, const ModelExpression& of) const {
    const auto count = static_cast<Index>(data_.specimens.size());
    switch (of.kind) {
      case Kind::kNumber:
        return VectorXd::Constant(count, of.number);
      case Kind::kParentheses:
        return numbers(label, of.arguments.front());
      case Kind::kNegative:
        return -numbers(label, of.arguments.front());
      case Kind::kColumn:
        return column_of_numbers(label, of.text);
      case Kind::kCall:
        return called(label, of);
      case Kind::kBinary:
        break;
    }
    const VectorXd a = numbers(label, of.arguments[0]), b = numbers(label, of.arguments[1]);
    if (of.text == "+") return a + b;
    if (of.text == "-") return a - b;
    if (of.text == "*") return a.cwiseProduct(b);
    if (of.text == "/") return a.cwiseQuotient(b);
    if (of.text == "^") return a.binaryExpr(b, [](double x, double y) { return std::pow(x, y); });
    throw InputError(fmt::format("{}: '{}' is no arithmetic", label, of.text));
  }

  VectorXd column_of_numbers(const std::string& label, const std::string& name) const {
    const std::vector<std::string>& fields = column(name);
    VectorXd values(std::ssize(fields));
    for (std::size_t i = 0; i < fields.size(); ++i) {
      const std::string field{text::trim(fields[i])};
      if (is_missing_field(field))
        values[static_cast<Index>(i)] = text::kMissing;
      else if (text::is_number(field))
        values[static_cast<Index>(i)] = std::stod(field);
      else
        throw InputError(fmt::format("{}: {} of {} for specimen {} is not a number", label, text::in_quotes(field),
                                     name, text::in_quotes(data_.specimens[i])));
    }
    return values;
  }

  VectorXd called(const std::string& label, const ModelExpression& of) const {
    static const std::map<std::string, double (*)(double)> functions = {
        {"log", [](double x) { return std::log(x); }},     {"log2", [](double x) { return std::log2(x); }},
        {"log10", [](double x) { return std::log10(x); }}, {"exp", [](double x) { return std::exp(x); }},
        {"sqrt", [](double x) { return std::sqrt(x); }},   {"I", [](double x) { return x; }}};
    const auto found = functions.find(of.text);
    if (found == functions.end())
      throw InputError(fmt::format("{}: there is no function '{}'; there are log, log2, log10, exp, sqrt, I and factor",
                                   label, of.text));
    return numbers(label, of.arguments.front()).unaryExpr(found->second);
  }

  // Missing where a column of it is missing, and finite elsewhere.
  VectorXd finite(const ModelVariable& variable, VectorXd values) const {
    std::vector<std::string> names = ModelFormula{{variable}, {{0}}}.columns();
    for (Index i = 0; i < values.size(); ++i) {
      const auto place = static_cast<std::size_t>(i);
      const bool is_known = std::none_of(
          names.begin(), names.end(), [&](const std::string& name) { return is_missing_field(column(name)[place]); });
      if (!is_known)
        values[i] = text::kMissing;
      else if (!std::isfinite(values[i]))
        throw InputError(fmt::format("{} is not a finite number for specimen {}", variable.label,
                                     text::in_quotes(data_.specimens[place])));
    }
    return values;
  }

  const ModelData& data_;
};

// A column of the design, in words too.
struct Column {
  std::string name;
  VectorXd values;
};

// Of a variable: a number, or an indicator for each level, that of the first level last, since columns that depend on
// those before them are left out.
std::vector<Column> columns_of(const ModelVariable& variable, const Values& values) {
  if (!values.is_factor()) return {{variable.label, values.numbers}};
  std::vector<Column> all;
  const auto count = static_cast<int>(values.levels.size());
  for (int k = 1; k <= count; ++k) {
    const int level = k % count;
    VectorXd indicator(std::ssize(values.level_of));
    for (Index i = 0; i < indicator.size(); ++i)
      indicator[i] = values.level_of[static_cast<std::size_t>(i)] == level ? 1 : 0;
    all.push_back({variable.label + values.levels[static_cast<std::size_t>(level)], std::move(indicator)});
  }
  return all;
}

class Designer {
 public:
  Designer(const ModelFormula& formula, const ModelData& data) : formula_(formula), data_(data) {
    for (const ModelVariable& variable : formula.variables) values_.push_back(Evaluator(data).of(variable));
    leave_out_incomplete();
    for (std::size_t v = 0; v < values_.size(); ++v) check(v);
  }

  ModelDesign make() {
    basis_ = MatrixXd::Constant(rows(), 1, 1 / std::sqrt(static_cast<double>(rows())));
    for (int t = 0; t < static_cast<int>(formula_.terms.size()); ++t) add_term(t);
    if (design_.residual_df() < 1)
      throw InputError(
          fmt::format("the model {} has {} coefficients for {} specimens, and leaves nothing to estimate the "
                      "variance by: leave terms out",
                      formula_.text(), design_.columns.cols() + 1, rows()));
    const MatrixXd all = with_intercept(design_.columns);
    design_.weights = solved(all, MatrixXd::Identity(rows(), rows())).bottomRows(design_.columns.cols());
    for (std::size_t t = 0; t < design_.terms.size(); ++t) add_groups(t);
    return std::move(design_);
  }

 private:
  Index rows() const { return std::ssize(design_.specimens); }

  static MatrixXd with_intercept(const MatrixXd& columns) {
    MatrixXd all(columns.rows(), columns.cols() + 1);
    all << VectorXd::Ones(columns.rows()), columns;
    return all;
  }

  // Least squares, with columns of norm 1.
  static MatrixXd solved(const MatrixXd& columns, const MatrixXd& right) {
    const VectorXd norms = columns.colwise().norm();
    const MatrixXd scaled = columns * norms.cwiseInverse().asDiagonal();
    return norms.cwiseInverse().asDiagonal() * scaled.householderQr().solve(right);
  }

  void leave_out_incomplete() {
    std::vector<std::string> missing;
    for (int i = 0; i < static_cast<int>(data_.specimens.size()); ++i) {
      const bool is_known = std::all_of(values_.begin(), values_.end(), [i](const Values& values) {
        return values.is_factor() ? values.level_of[static_cast<std::size_t>(i)] >= 0
                                  : std::isfinite(values.numbers[i]);
      });
      if (is_known)
        design_.specimens.push_back(i);
      else
        missing.push_back(data_.specimens[static_cast<std::size_t>(i)]);
    }
    if (std::ssize(design_.specimens) < 3)
      throw InputError(fmt::format("{} have all of {}; a model needs three",
                                   text::counted(design_.specimens.size(), "specimen"),
                                   fmt::join(formula_.columns(), ", ")));
    for (Values& values : values_) values = of_specimens(values, design_.specimens);
    if (missing.empty()) return;
    const std::size_t count = missing.size();
    design_.notes.push_back(fmt::format("{}: {} left out of the model, since {} in {}", formula_.text(),
                                        count == 1 ? "1 specimen is" : fmt::format("{} specimens are", count),
                                        "a value is missing", text::first_of(std::move(missing), 5)));
  }

  // Levels that are left are numbered anew, sorted: labels that are all numbers by their values.
  static Values of_specimens(const Values& all, const std::vector<int>& specimens) {
    if (!all.is_factor()) return {all.numbers(specimens)};
    std::set<int> used;
    for (const int i : specimens) used.insert(all.level_of[static_cast<std::size_t>(i)]);
    std::vector<int> order(used.begin(), used.end());
    const auto name = [&](int level) -> const std::string& { return all.levels[static_cast<std::size_t>(level)]; };
    if (std::all_of(order.begin(), order.end(), [&](int level) { return text::is_number(name(level)); }))
      std::stable_sort(order.begin(), order.end(),
                       [&](int a, int b) { return std::stod(name(a)) < std::stod(name(b)); });
    Values kept;
    for (const int level : order) kept.levels.push_back(name(level));
    for (const int i : specimens)
      kept.level_of.push_back(static_cast<int>(
          std::find(order.begin(), order.end(), all.level_of[static_cast<std::size_t>(i)]) - order.begin()));
    return kept;
  }

  void check(std::size_t v) {
    const Values& values = values_[v];
    const std::string& label = formula_.variables[v].label;
    if (values.is_factor()) {
      if (values.levels.size() < 2)
        throw InputError(
            fmt::format("{} is one group, '{}'; a comparison needs two groups", label, values.levels.front()));
      if (std::ssize(values.levels) == rows())
        throw InputError(fmt::format("each specimen is a group of its own in {}; some group needs two", label));
      if (values.levels.size() > kMostLevels)
        throw InputError(
            fmt::format("{} has {} groups; a model takes up to {}", label, values.levels.size(), kMostLevels));
      return;
    }
    const std::set<double> different(values.numbers.begin(), values.numbers.end());
    if (different.size() < 2) throw InputError(fmt::format("{} has the same value for all specimens", label));
    constexpr std::size_t kFewValues = 6;
    const bool are_whole = std::all_of(different.begin(), different.end(), [](double x) { return x == std::floor(x); });
    if (formula_.variables[v].expression.kind == Kind::kColumn && are_whole && different.size() <= kFewValues &&
        4 * std::ssize(different) <= rows())
      design_.notes.push_back(fmt::format("{} is a number with {} values; factor({}) would take them as groups", label,
                                          different.size(), label));
  }

  std::vector<Column> columns_of_term(const std::vector<int>& term, const std::vector<Values>& values) const {
    std::vector<Column> all{{"", VectorXd::Ones(rows())}};
    for (const int v : term) {
      const auto place = static_cast<std::size_t>(v);
      const std::vector<Column> more = columns_of(formula_.variables[place], values[place]);
      std::vector<Column> products;
      for (const Column& b : more)
        for (const Column& a : all)
          products.push_back({a.name.empty() ? b.name : a.name + ":" + b.name, a.values.cwiseProduct(b.values)});
      all = std::move(products);
    }
    return all;
  }

  void add_term(int t) {
    ModelDesign::Term term{.label = formula_.label_of(t), .first = static_cast<int>(design_.columns.cols())};
    const std::vector<int>& variables = formula_.terms[static_cast<std::size_t>(t)];
    kept_.emplace_back();
    const std::vector<Column> all = columns_of_term(variables, values_);
    for (std::size_t c = 0; c < all.size(); ++c) {
      if (!add_to_basis(all[c].values)) continue;
      design_.columns.conservativeResize(rows(), design_.columns.cols() + 1);
      design_.columns.rightCols(1) = all[c].values;
      design_.names.push_back(all[c].name);
      kept_.back().push_back(c);
      design_.deviations.conservativeResize(design_.columns.cols());
      design_.deviations[design_.columns.cols() - 1] = is_of_factors(variables) ? 1 : deviation(all[c].values);
      ++term.df;
    }
    if (term.df == 0)
      throw InputError(fmt::format(
          "{} is a combination of the terms before it, and explains nothing more: leave it out", term.label));
    design_.terms.push_back(std::move(term));
  }

  static double deviation(const VectorXd& values) {
    return std::sqrt((values.array() - values.mean()).square().sum() / static_cast<double>(values.size() - 1));
  }

  bool is_of_factors(const std::vector<int>& variables) const {
    return std::all_of(variables.begin(), variables.end(),
                       [&](int v) { return values_[static_cast<std::size_t>(v)].is_factor(); });
  }

  bool add_to_basis(const VectorXd& column) {
    const double norm = column.norm();
    if (!(norm > 0) || basis_.cols() == rows()) return false;
    VectorXd rest = column / norm;
    for (int twice = 0; twice < 2; ++twice) rest -= basis_ * (basis_.transpose() * rest);
    if (rest.norm() < kDependent) return false;
    basis_.conservativeResize(Eigen::NoChange, basis_.cols() + 1);
    basis_.rightCols(1) = rest.normalized();
    return true;
  }

  // Of a term of factors alone: who is in which combination, and the weights of least-squares means.
  void add_groups(std::size_t t) {
    const std::vector<int>& variables = formula_.terms[t];
    if (!is_of_factors(variables)) return;
    ModelDesign::Term& term = design_.terms[t];
    std::map<std::vector<int>, int> known;
    std::size_t combinations = 1;
    for (const int v : variables) combinations *= values_[static_cast<std::size_t>(v)].levels.size();
    std::vector<std::vector<int>> of_specimens;
    for (Index i = 0; i < rows(); ++i) {
      std::vector<int>& levels = of_specimens.emplace_back();
      for (const int v : variables)
        levels.push_back(values_[static_cast<std::size_t>(v)].level_of[static_cast<std::size_t>(i)]);
      known.emplace(levels, 0);
    }
    for (auto& [levels, place] : known) {
      place = static_cast<int>(term.groups.size());
      std::vector<std::string> names;
      for (std::size_t k = 0; k < levels.size(); ++k)
        names.push_back(values_[static_cast<std::size_t>(variables[k])].levels[static_cast<std::size_t>(levels[k])]);
      term.groups.push_back({fmt::format("{}", fmt::join(names, ":")), 0});
    }
    for (const std::vector<int>& levels : of_specimens) {
      term.group_of.push_back(known.at(levels));
      ++term.groups[static_cast<std::size_t>(term.group_of.back())].size;
    }
    if (known.size() < combinations)
      design_.notes.push_back(fmt::format("{}: {} of the {} combinations have no specimen", term.label,
                                          combinations - known.size(), combinations));
    if (std::ssize(term.groups) > kMostPairGroups)
      design_.notes.push_back(fmt::format("{}: pairs of its {} groups are not compared, {} at most", term.label,
                                          term.groups.size(), kMostPairGroups));
    term.group_weights = group_weights(term, t);
  }

  // Rows of the design, averaged over each group, with numbers at their means, times the pseudo-inverse of the design
  // up to the term.
  MatrixXd group_weights(const ModelDesign::Term& term, std::size_t t) const {
    std::vector<Values> values = values_;
    for (Values& of : values)
      if (!of.is_factor()) of.numbers.setConstant(of.numbers.mean());
    const int count = term.first + term.df;
    MatrixXd at_means(rows(), count);
    for (std::size_t s = 0, column = 0; s <= t; ++s) {
      const std::vector<Column> all = columns_of_term(formula_.terms[s], values);
      for (const std::size_t c : kept_[s]) at_means.col(static_cast<Index>(column++)) = all[c].values;
    }
    const MatrixXd predicted = with_intercept(at_means) * solved(with_intercept(design_.columns.leftCols(count)),
                                                                 MatrixXd::Identity(rows(), rows()));
    MatrixXd weights = MatrixXd::Zero(std::ssize(term.groups), rows());
    for (Index i = 0; i < rows(); ++i) {
      const auto group = static_cast<std::size_t>(term.group_of[static_cast<std::size_t>(i)]);
      weights.row(static_cast<Index>(group)) += predicted.row(i) / term.groups[group].size;
    }
    return weights;
  }

  const ModelFormula& formula_;
  const ModelData& data_;
  std::vector<Values> values_;
  std::vector<std::vector<std::size_t>> kept_;  // columns of each term
  MatrixXd basis_;                              // orthonormal, of the columns so far
  ModelDesign design_;
};

}  // namespace

ModelDesign make_design(const ModelFormula& formula, const ModelData& data) { return Designer(formula, data).make(); }

}  // namespace pulson::cohort
