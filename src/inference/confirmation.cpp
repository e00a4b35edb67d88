#include "confirmation.hpp"

#include <algorithm>
#include <cmath>

#include "core/undefined.hpp"
#include "normal_quantile.hpp"

namespace pulson::inference {

using Eigen::Index;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

namespace {

constexpr double kByChance = 0.002;
constexpr double kFewestEffective = 200;
constexpr double kLargestError = 0.5;  // of a log evidence that says anything
constexpr double kMixed = 1.05;        // R-hat of the log likelihood of tempered chains that are short
constexpr double kFewestExchanges = 0.05;

// The estimates of chains, compared with those of other draws one after the other.
class Comparison {
 public:
  Comparison(const PosteriorDraws& draws, Confirmation::By by, const Estimate& log_evidence) : draws_(draws) {
    found_.by = by;
    found_.log_evidence = log_evidence;
    const Estimate& own = draws.log_evidence;
    found_.difference = own.value - log_evidence.value;
    note(found_.difference, std::hypot(own.standard_error, log_evidence.standard_error), "the evidence");
  }

  void compare(const Eigen::Ref<const RowVectorXd>& row, const Estimate& other, const std::string& name) {
    const DrawSummary own = summarise(draws_.by_chain(row));
    note(own.mean - other.value, std::hypot(own.mcse, other.standard_error), name);
  }

  Confirmation take() && {
    found_.furthest_allowed = -normal_quantile(0.5 * kByChance / count_);
    found_.agrees = found_.furthest <= found_.furthest_allowed;
    return std::move(found_);
  }

 private:
  void note(double difference, double error, const std::string& name) {
    ++count_;
    // Numbers that no draw changes, as those of a landmark that nothing moves.
    const double apart = difference == 0 ? 0 : std::abs(difference) / error;
    if (apart <= found_.furthest) return;
    found_.furthest = apart;
    found_.furthest_of = name;
  }

  const PosteriorDraws& draws_;
  Confirmation found_;
  int count_ = 0;
};

}  // namespace

bool is_of_use(const ImportanceEstimate& estimate) {
  return estimate.pareto_k <= kHighParetoK && estimate.effective >= kFewestEffective;
}

bool is_of_use(const PosteriorDraws& tempered) {
  const double rhat = rank_rhat(tempered.by_chain(tempered.log_likelihood.transpose()));
  return rhat <= kMixed && tempered.log_evidence.standard_error <= kLargestError &&
         *std::min_element(tempered.exchanged.begin(), tempered.exchanged.end()) >= kFewestExchanges;
}

Confirmation confirmed_by(const ImportanceEstimate& other, const ChainSetting& setting, const PosteriorDraws& draws) {
  Comparison comparison(draws, Confirmation::By::kImportance, other.log_evidence);
  auto number = other.numbers.begin();
  for (Index j = 0; j < setting.space.count(); ++j) {
    const ParameterPrior& prior = setting.space.priors()[static_cast<std::size_t>(j)];
    const RowVectorXd phi = (draws.parameters.row(j).array() / prior.median).log() / prior.log_deviation;
    comparison.compare(phi, *number++, prior.name);
  }
  std::size_t path = 0;
  for (const Specimen& specimen : setting.specimens) {
    if (specimen.momentum_unknowns() > 0)
      for (Index i = 0; i < draws.momenta[path].rows(); ++i)
        comparison.compare(draws.momenta[path].row(i), *number++, "momenta");
    const std::size_t first = path, count = specimen.branches().size();
    for (const auto* of_paths : {&draws.ends, &draws.middles})
      for (path = first; path < first + count; ++path)
        for (Index i = 0; i < (*of_paths)[path].rows(); ++i)
          comparison.compare((*of_paths)[path].row(i), *number++, "paths");
  }
  return std::move(comparison).take();
}

Confirmation confirmed_by(const PosteriorDraws& tempered, const PosteriorDraws& draws) {
  Comparison comparison(draws, Confirmation::By::kTempering, tempered.log_evidence);
  const auto compare_rows = [&](const Eigen::MatrixXd& rows, const Eigen::MatrixXd& others, const std::string& name) {
    for (Index i = 0; i < rows.rows(); ++i) {
      const DrawSummary other = summarise(tempered.by_chain(others.row(i)));
      comparison.compare(rows.row(i), {other.mean, other.mcse}, name);
    }
  };
  compare_rows(draws.parameters.array().log(), tempered.parameters.array().log(), "parameters");
  for (std::size_t path = 0; path < draws.momenta.size(); ++path)
    compare_rows(draws.momenta[path], tempered.momenta[path], "momenta");
  for (std::size_t path = 0; path < draws.ends.size(); ++path) {
    compare_rows(draws.ends[path], tempered.ends[path], "paths");
    compare_rows(draws.middles[path], tempered.middles[path], "paths");
  }
  return std::move(comparison).take();
}

}  // namespace pulson::inference
