// Formulas of linear models: the parser, and terms.

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include <fmt/format.h>

#include "core/text.hpp"
#include "pulson/cohort/linear_model.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::cohort {
namespace {

using Kind = ModelExpression::Kind;
using Terms = std::vector<std::uint64_t>;  // sets of variables, as bits

constexpr std::size_t kMostVariables = 30;
constexpr std::size_t kMostFormulaTerms = 200;

// Precedence as R's: ^, sign, :, %in%, * and /, + and -.
class FormulaParser {
 public:
  explicit FormulaParser(const std::string& text) : text_(text) {}

  ModelExpression parse() {
    skip_left_side();
    ModelExpression found = sum();
    if (at_ < text_.size()) fail("unexpected " + text::in_quotes(text_.substr(at_, 1)));
    return found;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(fmt::format("formula {}: {} at character {}", text::in_quotes(text_), what, at_ + 1));
  }

  // The shapes are on the left, whatever they are called.
  void skip_left_side() {
    const std::size_t tilde = text_.find('~');
    if (tilde == std::string::npos) return;
    const std::string left{text::trim(text_.substr(0, tilde))};
    if (!left.empty() && left != "shape" && left != "coords")
      throw InputError(fmt::format("formula {}: on its left are the shapes; leave out {}", text::in_quotes(text_),
                                   text::in_quotes(left)));
    at_ = tilde + 1;
  }

  void skip_blanks() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_])) != 0) ++at_;
  }

  // The first of the operators that is next, taken.
  std::string take(std::initializer_list<const char*> operators) {
    skip_blanks();
    for (std::string op : operators)
      if (text_.compare(at_, op.size(), op) == 0) {
        at_ += op.size();
        return op;
      }
    return {};
  }

  template <class Operand>
  ModelExpression chain(std::initializer_list<const char*> operators, const Operand& operand) {
    ModelExpression left = operand();
    for (std::string op = take(operators); !op.empty(); op = take(operators))
      left = {Kind::kBinary, 0, op, {std::move(left), operand()}};
    skip_blanks();
    return left;
  }

  ModelExpression sum() {
    return chain({"+", "-"}, [&] { return product(); });
  }
  ModelExpression product() {
    return chain({"*", "/"}, [&] { return nested(); });
  }
  ModelExpression nested() {
    return chain({"%in%"}, [&] { return interaction(); });
  }
  ModelExpression interaction() {
    return chain({":"}, [&] { return signed_power(); });
  }
  ModelExpression signed_power() {
    if (!take({"-"}).empty()) return {Kind::kNegative, 0, "-", {signed_power()}};
    if (!take({"+"}).empty()) return signed_power();
    ModelExpression base = operand();
    if (take({"^"}).empty()) return base;
    return {Kind::kBinary, 0, "^", {std::move(base), signed_power()}};
  }

  static bool begins_name(char c) {
    return std::isalpha(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '_' ||
           (static_cast<unsigned char>(c) & 0x80U) != 0;
  }

  ModelExpression operand() {
    skip_blanks();
    if (at_ >= text_.size()) fail("something is missing");
    const char c = text_[at_];
    if (c == '(') {
      ++at_;
      ModelExpression inner = sum();
      if (take({")"}).empty()) fail("')' is missing");
      return {Kind::kParentheses, 0, "(", {std::move(inner)}};
    }
    if (text::is_digit(c) || (c == '.' && at_ + 1 < text_.size() && text::is_digit(text_[at_ + 1]))) {
      char* end = nullptr;
      const double value = std::strtod(text_.c_str() + at_, &end);
      at_ = static_cast<std::size_t>(end - text_.c_str());
      return {Kind::kNumber, value, "", {}};
    }
    if (c == '`') {
      const std::size_t end = text_.find('`', at_ + 1);
      if (end == std::string::npos) fail("a backtick is missing");
      std::string name = text_.substr(at_ + 1, end - at_ - 1);
      at_ = end + 1;
      return {Kind::kColumn, 0, std::move(name), {}};
    }
    if (!begins_name(c)) fail("unexpected " + text::in_quotes(std::string(1, c)));
    std::size_t end = at_;
    while (end < text_.size() && (begins_name(text_[end]) || text::is_digit(text_[end]))) ++end;
    std::string name = text_.substr(at_, end - at_);
    at_ = end;
    if (take({"("}).empty()) return {Kind::kColumn, 0, std::move(name), {}};
    ModelExpression call{Kind::kCall, 0, std::move(name), {sum()}};
    if (!take({","}).empty()) fail(fmt::format("{}() takes one argument", call.text));
    if (take({")"}).empty()) fail("')' is missing");
    return call;
  }

  const std::string& text_;
  std::size_t at_ = 0;
};

// As R writes it.
std::string deparsed(const ModelExpression& of) {
  const auto argument = [&](std::size_t i) { return deparsed(of.arguments[i]); };
  switch (of.kind) {
    case Kind::kNumber:
      return fmt::format("{:g}", of.number);
    case Kind::kColumn:
      return of.text;
    case Kind::kCall:
      return fmt::format("{}({})", of.text, argument(0));
    case Kind::kParentheses:
      return fmt::format("({})", argument(0));
    case Kind::kNegative:
      return "-" + argument(0);
    case Kind::kBinary:
      break;
  }
  const bool is_close = of.text == "/" || of.text == "^" || of.text == ":";
  return fmt::format("{0}{1}{2}{1}{3}", argument(0), is_close ? "" : " ", of.text, argument(1));
}

std::uint64_t all_of(const Terms& terms) {
  std::uint64_t all = 0;
  for (const std::uint64_t term : terms) all |= term;
  return all;
}

Terms with(Terms terms, const Terms& more) {
  for (const std::uint64_t term : more)
    if (std::find(terms.begin(), terms.end(), term) == terms.end()) terms.push_back(term);
  if (terms.size() > kMostFormulaTerms)
    throw InputError(fmt::format("the formula has more than {} terms", kMostFormulaTerms));
  return terms;
}

Terms interactions(const Terms& first, const Terms& second) {
  Terms found;
  for (const std::uint64_t a : first)
    for (const std::uint64_t b : second) found = with(found, {a | b});
  return found;
}

class TermReader {
 public:
  explicit TermReader(ModelFormula& formula) : formula_(formula) {}

  Terms read(const ModelExpression& of) {
    switch (of.kind) {
      case Kind::kNumber:
        if (of.number != 1) throw InputError("the model has an intercept; a formula takes no number but 1");
        return {};
      case Kind::kColumn:
      case Kind::kCall:
        return {variable(of)};
      case Kind::kParentheses:
        return read(of.arguments.front());
      case Kind::kNegative:
        return removed({}, of.arguments.front());
      case Kind::kBinary:
        break;
    }
    if (of.text == "^") return power(of);
    const Terms first = read(of.arguments[0]);
    if (of.text == "-") return removed(first, of.arguments[1]);
    const Terms second = read(of.arguments[1]);
    if (of.text == "+") return with(first, second);
    if (of.text == ":" || of.text == "%in%") return interactions(first, second);
    if (of.text == "*") return with(with(first, second), interactions(first, second));
    return with(first, interactions({all_of(first)}, second));  // nested
  }

 private:
  std::uint64_t variable(const ModelExpression& of) {
    const std::string label = deparsed(of);
    auto& all = formula_.variables;
    auto found = std::find_if(all.begin(), all.end(), [&](const auto& known) { return known.label == label; });
    if (found == all.end()) {
      if (all.size() == kMostVariables)
        throw InputError(fmt::format("the formula has more than {} variables", kMostVariables));
      const bool is_factor = of.kind == Kind::kCall && (of.text == "factor" || of.text == "as.factor");
      if (is_factor && of.arguments.front().kind != Kind::kColumn)
        throw InputError(fmt::format("{}: factor() takes the name of a column", label));
      all.push_back({label, is_factor ? of.arguments.front() : of, is_factor});
      found = all.end() - 1;
    }
    return std::uint64_t{1} << (found - all.begin());
  }

  Terms removed(const Terms& from, const ModelExpression& what) {
    if (what.kind == Kind::kNumber) throw InputError("the model has an intercept, which a formula cannot leave out");
    const Terms gone = read(what);
    Terms kept;
    std::copy_if(from.begin(), from.end(), std::back_inserter(kept),
                 [&](std::uint64_t term) { return std::find(gone.begin(), gone.end(), term) == gone.end(); });
    return kept;
  }

  Terms power(const ModelExpression& of) {
    const ModelExpression& exponent = of.arguments[1];
    if (exponent.kind != Kind::kNumber || exponent.number < 1 || exponent.number > 10 ||
        exponent.number != std::floor(exponent.number))
      throw InputError(
          fmt::format("{}: a formula takes powers 1 to 10; I({}) is that of a number", deparsed(of), deparsed(of)));
    const Terms base = read(of.arguments[0]);
    Terms found = base;
    for (int i = 1; i < static_cast<int>(exponent.number); ++i) found = with(found, interactions(found, base));
    return found;
  }

  ModelFormula& formula_;
};

int bits_in(std::uint64_t term) {
  int count = 0;
  for (; term != 0; term &= term - 1) ++count;
  return count;
}

void add_columns(const ModelExpression& of, std::vector<std::string>& names) {
  if (of.kind == Kind::kColumn && std::find(names.begin(), names.end(), of.text) == names.end())
    names.push_back(of.text);
  for (const ModelExpression& argument : of.arguments) add_columns(argument, names);
}

// Variables that no term has, as `a - a` leaves them, go.
ModelFormula with_variables_in_use(const ModelFormula& all) {
  std::vector<int> place(all.variables.size(), -1);
  ModelFormula kept;
  for (std::size_t v = 0; v < all.variables.size(); ++v)
    for (const std::vector<int>& term : all.terms)
      if (place[v] < 0 && std::find(term.begin(), term.end(), static_cast<int>(v)) != term.end()) {
        place[v] = static_cast<int>(kept.variables.size());
        kept.variables.push_back(all.variables[v]);
      }
  kept.terms = all.terms;
  for (std::vector<int>& term : kept.terms)
    for (int& v : term) v = place[static_cast<std::size_t>(v)];
  return kept;
}

}  // namespace

ModelFormula ModelFormula::parse(const std::string& text) {
  ModelFormula formula;
  Terms terms = TermReader(formula).read(FormulaParser(text).parse());
  std::stable_sort(terms.begin(), terms.end(), [](auto a, auto b) { return bits_in(a) < bits_in(b); });
  for (const std::uint64_t term : terms) {
    formula.terms.emplace_back();
    for (std::size_t v = 0; v < formula.variables.size(); ++v)
      if (((term >> v) & 1U) != 0) formula.terms.back().push_back(static_cast<int>(v));
  }
  if (formula.terms.empty()) throw InputError(fmt::format("formula {}: it has no term", text::in_quotes(text)));
  return with_variables_in_use(formula);
}

ModelFormula ModelFormula::of_column(const std::string& name, bool is_factor) {
  ModelFormula formula;
  formula.variables.push_back({name, {Kind::kColumn, 0, name, {}}, is_factor});
  formula.terms = {{0}};
  return formula;
}

std::vector<std::string> ModelFormula::columns() const {
  std::vector<std::string> names;
  for (const ModelVariable& variable : variables) add_columns(variable.expression, names);
  return names;
}

std::string ModelFormula::label_of(int term) const {
  std::vector<std::string> labels;
  for (const int v : terms[static_cast<std::size_t>(term)])
    labels.push_back(variables[static_cast<std::size_t>(v)].label);
  return fmt::format("{}", fmt::join(labels, ":"));
}

std::string ModelFormula::text() const {
  std::vector<std::string> labels;
  for (int term = 0; term < static_cast<int>(terms.size()); ++term) labels.push_back(label_of(term));
  return fmt::format("{}", fmt::join(labels, " + "));
}

}  // namespace pulson::cohort
