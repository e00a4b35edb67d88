#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "pulson/cohort/statistics.hpp"

namespace pulson::cohort {

/// What is known of specimens beside their shapes.
struct ModelData {
  std::vector<std::string> specimens;  ///< n names, for messages
  /// Of each name n fields as they were written; empty or NA where a specimen has none.
  std::map<std::string, std::vector<std::string>> columns;
};

/// An arithmetic expression of a formula, such as log(size).
struct ModelExpression {
  enum class Kind : unsigned char { kNumber, kColumn, kCall, kParentheses, kNegative, kBinary };
  Kind kind = Kind::kNumber;
  double number = 0;
  std::string text;  ///< the name of a column or function, the operator
  std::vector<ModelExpression> arguments;
};

/// A variable of a formula: a column, or a function of columns.
struct ModelVariable {
  std::string label;  ///< as in the formula: `log(size)`
  ModelExpression expression;
  bool is_factor = false;  ///< its fields are labels even where they look like numbers
};

/// The right side of a formula in the notation of R (G. Wilkinson and C. Rogers 1973): `log(size) + species * site`.
/// `a + b` both, `a:b` their interaction, `a * b` is a + b + a:b, `a / b` (b nested in a) is a + a:b, `(a + b)^2` all
/// up to products of two, `- a:b` leaves it out. There is an intercept. Functions of numbers are log, log2, log10, exp,
/// sqrt and I(…), which holds arithmetic; factor(a) takes the fields of a as labels. Other names are in backticks.
struct ModelFormula {
  std::vector<ModelVariable> variables;
  /// Variables of each term, by the number of variables in a term and then as written, which is R's order.
  std::vector<std::vector<int>> terms;

  /// @throws InputError that names the place
  static ModelFormula parse(const std::string& text);
  /// The formula of one column.
  static ModelFormula of_column(const std::string& name, bool is_factor);

  /// Of the data, in order of appearance.
  std::vector<std::string> columns() const;
  std::string label_of(int term) const;
  /// The terms, joined by " + ".
  std::string text() const;
};

/// The design matrix of a formula. A factor has a column for each level but the first (of sorted levels), as R's
/// treatment contrasts; columns that are combinations of those before them are left out.
struct ModelDesign {
  /// A combination of levels.
  struct Group {
    std::string name;  ///< levels joined by ":"
    int size = 0;
  };
  struct Term {
    std::string label;
    int first = 0, df = 0;            ///< columns
    std::vector<Group> groups{};      ///< of a term of factors alone
    std::vector<int> group_of{};      ///< of each specimen
    Eigen::MatrixXd group_weights{};  ///< g×n: least-squares means of the groups, of the model up to this term
  };

  std::vector<int> specimens;      ///< that have all variables, of those of the data
  Eigen::MatrixXd columns;         ///< n×k, of full rank, without the intercept
  std::vector<std::string> names;  ///< k, of the coefficients: `speciesTeyah`
  std::vector<Term> terms;
  Eigen::MatrixXd weights;           ///< k×n: the coefficients are weights·rows
  Eigen::VectorXd deviations;        ///< k: standard deviation of each column, or 1 where it is of factors alone
  std::vector<std::string> notes{};  ///< specimens left out and the like

  int residual_df() const { return static_cast<int>(columns.rows()) - static_cast<int>(columns.cols()) - 1; }
};

/// @throws InputError where a column is missing or does not vary, a factor has one level, a term is a combination of
/// those before it, or no degree of freedom is left
ModelDesign make_design(const ModelFormula& formula, const ModelData& data);

/// A term of a linear model of shapes.
struct TermTest {
  double ss = 0;  ///< of the term after those before it (type I)
  double r_squared = 0, f = 0;
  double z = 0;        ///< effect size, see effect_size()
  double z_error = 0;  ///< its standard error by the random permutations
  double p_value = 1;  ///< part of the permutations, the identity included, whose F is no less
};

/// Two groups of a term.
struct PairTest {
  int term = 0, first = 0, second = 0;
  double distance = 0;  ///< of their least-squares means
  double z = 0, p_value = 1;
};

struct ModelTest {
  std::vector<TermTest> terms;
  std::vector<PairTest> pairs;
  double residual_ss = 0, total_ss = 0;
  int permutations = 0;
};

/// Groups of a term whose pairs are compared, at most.
inline constexpr int kMostPairGroups = 30;

/// Analysis of variance of shapes by distances, with sums of squares of type I and randomised residuals of the model
/// without the term and those behind it (RRPP; M. Collyer, D. Sekora and D. Adams 2015): what `procD.lm` of R's
/// geomorph and, for pairs, `pairwise` of RRPP compute. F has the mean square of the residuals of the full model below.
/// Pairs are of terms of factors alone with up to 30 groups: distances between least-squares means, covariates at their
/// mean, of the model up to the term. It assumes that those residuals are exchangeable.
/// @param rows a row for each specimen of the data; squared distances between them are those of the shapes
ModelTest test_model(const ModelDesign& design, const Eigen::MatrixXd& rows, const PermutationOptions& options = {});

/// The first of positive values in standard deviations from the mean of all, after the Box–Cox transformation
/// (y^λ − 1)/λ whose λ in (−2, 2) is the most likely one of the others (M. Collyer and D. Adams 2018); NaN where they
/// do not vary.
double effect_size(const Eigen::VectorXd& values);

}  // namespace pulson::cohort
