#include "evidence_map.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "core/columns.hpp"
#include "response_surface.hpp"

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kLeastWeight = 1e-9;  // so that the inverse is a number
constexpr double kRounding = 1e-9;     // of coordinates
constexpr double kNats = 4;            // of evidence, over which what samples add there counts less by a factor of e

// log of the mean of e^l over the sets of other groups, and half of its variance, which the logarithm takes off.
double log_mean(const VectorXd& logs, Index first_group, int left_out) {
  const double largest = logs.maxCoeff();
  if (!std::isfinite(largest)) return largest;
  double sum = 0;
  double squares = 0;
  double count = 0;
  for (Index i = 0; i < logs.size(); ++i) {
    if ((first_group + i) % EvidenceMap::kGroups == left_out) continue;
    const double weight = std::exp(logs[i] - largest);
    sum += weight;
    squares += weight * weight;
    ++count;
  }
  const double mean = sum / count;
  const double variance = (squares / count - mean * mean) / (mean * mean * std::max(1.0, count - 1));
  return largest + std::log(mean) + 0.5 * variance;
}

// Of the numbers of a model and back a place returns but for rounding.
std::optional<std::size_t> index_of(const VectorXd& x, const std::vector<VectorXd>& places) {
  const auto found = std::find_if(places.begin(), places.end(), [&](const VectorXd& place) {
    return (place - x).cwiseAbs().maxCoeff() <= kRounding;
  });
  if (found == places.end()) return std::nullopt;
  return static_cast<std::size_t>(found - places.begin());
}

}  // namespace

double sum_of_log_means(const std::vector<VectorXd>& excess, int left_out) {
  double sum = 0;
  Index first_group = 0;
  for (const VectorXd& logs : excess) {
    sum += log_mean(logs, first_group, left_out);
    first_group += logs.size();
  }
  return sum;
}

void EvidenceMap::add(const VectorXd& x, double laplace) {
  if (index_of(x, places_)) return;
  places_.push_back(x);
  laplace_.push_back(laplace);
}

void EvidenceMap::add_samples(const VectorXd& x, std::vector<VectorXd> excess) {
  if (index_of(x, sampled_)) return;
  sampled_.push_back(x);
  excess_.push_back(std::move(excess));
}

std::optional<double> EvidenceMap::evidence_at(const VectorXd& x) const {
  const std::optional<double> laplace = laplace_at(x);
  if (!laplace || !has_samples()) return laplace;
  const auto sampled = index_of(x, sampled_);
  if (!sampled) return std::nullopt;
  return *laplace + sum_of_log_means(excess_[*sampled]);
}

const VectorXd& EvidenceMap::best_place(const Likelihood& likelihood) const {
  const auto& places = has_samples() ? sampled_ : places_;
  return *std::max_element(places.begin(), places.end(), [&](const VectorXd& a, const VectorXd& b) {
    return likelihood.value(a) < likelihood.value(b);
  });
}

std::vector<VectorXd> EvidenceMap::likely_places(const Likelihood& likelihood, double nats) const {
  const double least = likelihood.value(likelihood.maximum) - nats;
  std::vector<VectorXd> likely;
  for (const VectorXd& place : has_samples() ? sampled_ : places_)
    if (likelihood.value(place) >= least) likely.push_back(place);
  return likely;
}

bool EvidenceMap::is_known(const VectorXd& x, bool sampled, const MatrixXd& metric, double deviations) const {
  const auto& places = sampled ? sampled_ : places_;
  return std::any_of(places.begin(), places.end(), [&](const VectorXd& place) {
    return (place - x).dot(metric * (place - x)) < deviations * deviations;
  });
}

std::optional<double> EvidenceMap::laplace_at(const VectorXd& x) const {
  const auto known = index_of(x, places_);
  if (!known) return std::nullopt;
  return laplace_[*known];
}

Likelihood EvidenceMap::likelihood(const MatrixXd& metric, const Box& box, int left_out) const {
  const auto laplace = std::make_shared<ResponseSurface>(columns_of(places_),
                                                         VectorXd::Map(laplace_.data(), std::ssize(laplace_)), metric);
  std::shared_ptr<ResponseSurface> added;
  if (has_samples()) {
    VectorXd values(std::ssize(sampled_));
    for (Index k = 0; k < values.size(); ++k)
      values[k] = sum_of_log_means(excess_[static_cast<std::size_t>(k)], left_out);
    VectorXd evidence = values;
    for (Index k = 0; k < values.size(); ++k) evidence[k] += laplace_at(sampled_[static_cast<std::size_t>(k)]).value();
    const VectorXd weights = ((evidence.array() - evidence.maxCoeff()) / kNats).exp().cwiseMax(kLeastWeight);
    added = std::make_shared<ResponseSurface>(columns_of(sampled_), values, metric, weights);
  }
  return {[=](const VectorXd& x) { return (*laplace)(x) + (added ? (*added)(x) : 0); },
          [=](const VectorXd& x) {
            SecondOrder sum = laplace->second_order(x);
            if (!added) return sum;
            const SecondOrder more = added->second_order(x);
            return SecondOrder{sum.gradient + more.gradient, sum.information + more.information};
          },
          box, places_.front()};
}

}  // namespace pulson::compare
