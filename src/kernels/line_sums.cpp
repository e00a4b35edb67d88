#include "line_sums.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "line_profiles.hpp"
#include "own_kernels.hpp"

namespace pulson {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// The different places of targets and sources from left to right.
struct Places {
  std::vector<double> at;
  std::vector<Index> of_targets, of_sources;  // their places

  Places(const VectorXd& x, const VectorXd& y)
      : of_targets(static_cast<std::size_t>(x.size())), of_sources(static_cast<std::size_t>(y.size())) {
    const std::vector<Index> targets = sorted_order(x), sources = sorted_order(y);
    at.reserve(targets.size() + sources.size());
    for (std::size_t i = 0, j = 0; i < targets.size() || j < sources.size();) {
      const bool is_target = j == sources.size() || (i < targets.size() && x[targets[i]] <= y[sources[j]]);
      const double place = is_target ? x[targets[i]] : y[sources[j]];
      if (at.empty() || at.back() != place) at.push_back(place);
      const auto index = static_cast<Index>(at.size()) - 1;
      if (is_target)
        of_targets[static_cast<std::size_t>(targets[i++])] = index;
      else
        of_sources[static_cast<std::size_t>(sources[j++])] = index;
    }
  }
};

// Adds the sums of a term at all places, R×D each.
template <class Profile, int R>
void add_sweeps(const KernelTerm& term, const std::vector<double>& at, const MatrixXd& weights, MatrixXd& value,
                MatrixXd& slope, MatrixXd& second) {
  const double scale = line_scale(term);
  const double w = term.weight, by_slope = w * scale, by_second = w * scale * scale;
  const auto count = static_cast<Index>(at.size());
  VectorXd gaps(count), decays(count);
  for (Index i = 0; i + 1 < count; ++i)
    gaps[i] = scale * (at[static_cast<std::size_t>(i) + 1] - at[static_cast<std::size_t>(i)]);
  if (count > 0) gaps[count - 1] = 0;
  gaps = gaps.cwiseMin(kFurthestOnLine);
  decays = line_decays(gaps);

  using Column = Eigen::Array<double, R, 1>;
  LineMoments<Profile, Column> left(Column::Zero()), right(Column::Zero());
  for (Index i = 0; i < count; ++i) {
    const Column here = weights.col(i).template head<R>().array();
    value.col(i).array() += w * (Profile::value(left) + here);
    slope.col(i).array() += by_slope * Profile::slope(left);
    second.col(i).array() += by_second * (Profile::second(left) + Profile::kSecondAtZero * here);
    left.advance(here, gaps[i], decays[i]);
  }
  for (Index i = count - 1; i >= 0; --i) {
    value.col(i).array() += w * Profile::value(right);
    slope.col(i).array() -= by_slope * Profile::slope(right);
    second.col(i).array() += by_second * Profile::second(right);
    const Column here = weights.col(i).template head<R>().array();
    if (i > 0) right.advance(here, gaps[i - 1], decays[i - 1]);
  }
}

template <int R>
void add_term(const KernelTerm& term, const std::vector<double>& at, const MatrixXd& weights, MatrixXd& value,
              MatrixXd& slope, MatrixXd& second) {
  switch (term.profile) {
    case KernelProfile::kPeakon:
      return add_sweeps<PeakonOnLine, R>(term, at, weights, value, slope, second);
    case KernelProfile::kMatern32:
      return add_sweeps<Matern32OnLine, R>(term, at, weights, value, slope, second);
    case KernelProfile::kMatern52:
      return add_sweeps<Matern52OnLine, R>(term, at, weights, value, slope, second);
    case KernelProfile::kGaussian:
      throw std::logic_error("a gaussian has no sums along a line");
  }
}

}  // namespace

std::vector<Index> sorted_order(const VectorXd& x) {
  std::vector<Index> order(static_cast<std::size_t>(x.size()));
  std::iota(order.begin(), order.end(), Index{0});
  const auto before = [&](Index a, Index b) { return x[a] < x[b]; };
  if (!std::is_sorted(order.begin(), order.end(), before)) std::sort(order.begin(), order.end(), before);
  return order;
}

int line_moments(KernelProfile profile) {
  if (profile == KernelProfile::kPeakon) return PeakonOnLine::kMoments;
  if (profile == KernelProfile::kMatern32) return Matern32OnLine::kMoments;
  if (profile == KernelProfile::kMatern52) return Matern52OnLine::kMoments;
  throw std::logic_error("a gaussian has no sums along a line");
}

Eigen::MatrixXd line_decays(const MatrixXd& gaps) {
  return (gaps.array() < kFurthestOnLine).select((-gaps.array()).exp(), 0);
}

double line_scale(const KernelTerm& term) { return std::sqrt(2.0 * line_moments(term.profile) - 1) / term.alpha; }

bool has_line_sums(const std::vector<KernelTerm>& terms) {
  return std::none_of(terms.begin(), terms.end(), [](const KernelTerm& term) {
    return term.profile == KernelProfile::kGaussian || is_own(term.profile);
  });
}

LineSums line_sums(const std::vector<KernelTerm>& terms, const VectorXd& x, const VectorXd& y,
                   const MatrixXd& weights) {
  const Places places(x, y);
  const auto count = static_cast<Index>(places.at.size());
  const Index columns = weights.cols();
  MatrixXd at_places = MatrixXd::Zero(columns, count);
  for (Index j = 0; j < y.size(); ++j)
    at_places.col(places.of_sources[static_cast<std::size_t>(j)]) += weights.row(j).transpose();
  MatrixXd value = MatrixXd::Zero(columns, count), slope = value, second = value;
  for (const KernelTerm& term : terms) {
    if (columns == 1)
      add_term<1>(term, places.at, at_places, value, slope, second);
    else if (columns == 2)
      add_term<2>(term, places.at, at_places, value, slope, second);
    else if (columns == 3)
      add_term<3>(term, places.at, at_places, value, slope, second);
    else
      throw std::logic_error("sums along a line are of one to three weights");
  }
  const auto of_targets = [&](const MatrixXd& sums) -> MatrixXd {
    return sums(Eigen::all, places.of_targets).transpose();
  };
  return {of_targets(value), of_targets(slope), of_targets(second)};
}

}  // namespace pulson
