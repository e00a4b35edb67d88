#include "known_matches.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

#include <Eigen/LU>

#include "core/columns.hpp"
#include "response_surface.hpp"

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::size_t kMostKnown = 48;  // that are kept
constexpr double kLeastSpread = 0.01;   // of a coordinate, where places do not differ in it
constexpr double kMostWeight = 8;       // Σ|w|, beyond which the errors of what is known are too much in the sum

// In which the places are as far apart in one direction as in another.
MatrixXd metric_about(const MatrixXd& places) {
  const MatrixXd off = places.colwise() - places.rowwise().mean();
  MatrixXd covariance = off * off.transpose() / static_cast<double>(places.cols());
  covariance.diagonal().array() += kLeastSpread * kLeastSpread;
  return covariance.inverse();
}

}  // namespace

void KnownMatches::add(const VectorXd& x, std::vector<VectorXd> of_shapes) {
  if (std::find(places_.begin(), places_.end(), x) != places_.end()) return;
  if (places_.size() == kMostKnown) {
    places_.erase(places_.begin());
    of_shapes_.erase(of_shapes_.begin());
  }
  places_.push_back(x);
  of_shapes_.push_back(std::move(of_shapes));
}

std::vector<VectorXd> KnownMatches::at(const VectorXd& x) const {
  if (std::ssize(places_) <= x.size()) return {};
  const MatrixXd places = columns_of(places_);
  const VectorXd weights = ResponseSurface::weights_at(x, places, metric_about(places));
  if (!(weights.lpNorm<1>() < kMostWeight)) return {};
  std::vector<VectorXd> sums;
  for (std::size_t s = 0; s < of_shapes_.front().size(); ++s) {
    VectorXd sum = VectorXd::Zero(of_shapes_.front()[s].size());
    for (Index k = 0; k < weights.size(); ++k) sum += weights[k] * of_shapes_[static_cast<std::size_t>(k)][s];
    sums.push_back(std::move(sum));
  }
  return sums;
}

}  // namespace pulson::compare
