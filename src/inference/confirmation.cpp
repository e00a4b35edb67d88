#include "confirmation.hpp"

#include <algorithm>
#include <cmath>

#include "core/undefined.hpp"
#include "normal_quantile.hpp"

namespace pulson::inference {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

namespace {

constexpr double kByChance = 0.002;
constexpr double kFewestEffective = 200;
constexpr double kLargestError = 0.5;  // of a log evidence that says anything
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

  /// @return the difference of the means
  double compare(const Eigen::Ref<const RowVectorXd>& row, const Estimate& other, const std::string& name) {
    const DrawSummary own = summarise(draws_.by_chain(row));
    note(own.mean - other.value, std::hypot(own.mcse, other.standard_error), name);
    return own.mean - other.value;
  }

  Confirmation& found() { return found_; }

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
  return rhat <= kHighRhatOfShort && tempered.log_evidence.standard_error <= kLargestError &&
         *std::min_element(tempered.exchanged.begin(), tempered.exchanged.end()) >= kFewestExchanges;
}

Confirmation confirmed_by(const ImportanceEstimate& other, const ChainSetting& setting, const PosteriorDraws& draws) {
  Comparison comparison(draws, Confirmation::By::kImportance, other.log_evidence);
  Confirmation& found = comparison.found();
  auto number = other.numbers.begin();
  const auto differences = [&](const MatrixXd& rows, const std::string& name) {
    VectorXd all(rows.rows());
    for (Index i = 0; i < rows.rows(); ++i) all[i] = comparison.compare(rows.row(i), *number++, name);
    return all;
  };
  found.parameters.resize(setting.space.count());
  for (Index j = 0; j < setting.space.count(); ++j) {
    const ParameterPrior& prior = setting.space.priors()[static_cast<std::size_t>(j)];
    const RowVectorXd phi = (draws.parameters.row(j).array() / prior.median).log() / prior.log_deviation;
    found.parameters[j] = prior.log_deviation * comparison.compare(phi, *number++, prior.name);
  }
  std::size_t first = 0;
  for (const Specimen& specimen : setting.specimens) {
    if (specimen.momentum_unknowns() > 0) found.momenta.push_back(differences(draws.momenta[first], "momenta"));
    const std::size_t count = specimen.branches().size();
    for (std::size_t path = first; path < first + count; ++path)
      found.ends.push_back(differences(draws.ends[path], "paths"));
    for (std::size_t path = first; path < first + count; ++path)
      found.middles.push_back(differences(draws.middles[path], "paths"));
    first += count;
  }
  return std::move(comparison).take();
}

Confirmation confirmed_by(const PosteriorDraws& tempered, const PosteriorDraws& draws) {
  Comparison comparison(draws, Confirmation::By::kTempering, tempered.log_evidence);
  Confirmation& found = comparison.found();
  const auto differences = [&](const MatrixXd& rows, const MatrixXd& others, const std::string& name) {
    VectorXd all(rows.rows());
    for (Index i = 0; i < rows.rows(); ++i) {
      const DrawSummary other = summarise(tempered.by_chain(others.row(i)));
      all[i] = comparison.compare(rows.row(i), {other.mean, other.mcse}, name);
    }
    return all;
  };
  found.parameters = differences(draws.parameters.array().log(), tempered.parameters.array().log(), "parameters");
  for (std::size_t path = 0; path < draws.momenta.size(); ++path)
    found.momenta.push_back(differences(draws.momenta[path], tempered.momenta[path], "momenta"));
  for (std::size_t path = 0; path < draws.ends.size(); ++path) {
    found.ends.push_back(differences(draws.ends[path], tempered.ends[path], "paths"));
    found.middles.push_back(differences(draws.middles[path], tempered.middles[path], "paths"));
  }
  return std::move(comparison).take();
}

}  // namespace pulson::inference
