#include "line_steps.hpp"

#include <algorithm>
#include <stdexcept>

#include "line_profiles.hpp"
#include "line_sums.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson {

using Eigen::Index;

LineSteps::LineSteps(const KernelTerm& term, const std::vector<const LineCovariance*>& steps)
    : term_(term),
      steps_(static_cast<int>(steps.size())),
      landmarks_(steps.front()->variances_.size()),
      blocks_((steps.size() + kLineLanes - 1) / kLineLanes) {
  const auto moments = static_cast<std::size_t>(line_moments(term.profile));
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    Block& block = blocks_[b];
    block.order.resize(static_cast<std::size_t>(landmarks_ * kLineLanes));
    block.gaps.resize(kLineLanes, landmarks_);
    block.decays = block.variances = block.gaps;
    for (std::size_t s = 0; s < moments; ++s) block.gains[s] = block.gaps;
    for (Index lane = 0; lane < kLineLanes; ++lane) {
      const auto step = std::min(b * kLineLanes + static_cast<std::size_t>(lane), steps.size() - 1);
      const LineCovariance& of = *steps[step];
      for (Index i = 0; i < landmarks_; ++i)
        block.order[static_cast<std::size_t>(i * kLineLanes + lane)] = of.order_[static_cast<std::size_t>(i)];
      block.gaps.row(lane) = of.gaps_.transpose();
      block.decays.row(lane) = of.decays_.transpose();
      block.variances.row(lane) = of.variances_.transpose();
      for (std::size_t s = 0; s < moments; ++s) block.gains[s].row(lane) = of.gains_.row(static_cast<Index>(s));
    }
  }
}

int LineSteps::count_of(std::size_t block) const {
  return std::min(kLineLanes, steps_ - static_cast<int>(block) * kLineLanes);
}

LineSteps::Lanes LineSteps::gathered(std::size_t block, const std::vector<Points>& values) const {
  const Block& of = blocks_[block];
  Lanes lanes(kLineLanes, landmarks_);
  for (Index lane = 0; lane < kLineLanes; ++lane) {
    const auto step = std::min(block * kLineLanes + static_cast<std::size_t>(lane), values.size() - 1);
    const double* from = values[step].data();
    for (Index i = 0; i < landmarks_; ++i)
      lanes(lane, i) = from[of.order[static_cast<std::size_t>(i * kLineLanes + lane)]];
  }
  return lanes;
}

void LineSteps::scatter(std::size_t block, const Lanes& from, std::vector<Points>& to) const {
  const Block& of = blocks_[block];
  for (Index lane = 0; lane < count_of(block); ++lane) {
    Points& step = to[block * kLineLanes + static_cast<std::size_t>(lane)];
    step.resize(1, landmarks_);
    for (Index i = 0; i < landmarks_; ++i)
      step.data()[of.order[static_cast<std::size_t>(i * kLineLanes + lane)]] = from(lane, i);
  }
}

struct LineSteps::Sums {
  Lanes first, second;
};

// `first` is of K or of K'. Weights at one place are kept apart until the sweep leaves it: K' leaves them out, and so
// does K'' of the peakon.
template <class Profile, bool kValue, bool kSecond>
LineSteps::Sums LineSteps::swept(const Block& block, const Lanes& weights) const {
  const double scale = line_scale(term_), by_first = term_.weight * (kValue ? 1 : scale);
  const double by_second = term_.weight * scale * scale;
  Sums sums{Lanes(kLineLanes, landmarks_), Lanes(kLineLanes, kSecond ? landmarks_ : 0)};
  const LineLanes zero = LineLanes::Zero();
  const auto first = [](const auto& moments) -> LineLanes {
    if constexpr (kValue)
      return Profile::value(moments);
    else
      return Profile::slope(moments);
  };

  LineMoments<Profile, LineLanes> left(zero), right(zero);
  LineLanes here = zero;
  for (Index i = 0; i < landmarks_; ++i) {
    const LineLanes gap = block.gaps.col(i), decay = block.decays.col(i);
    const LineLanes apart = (gap > 0).template cast<double>();
    left.advance(apart * here, gap, decay);
    here = (1 - apart) * here + weights.col(i).array();
    sums.first.col(i) = by_first * (first(left) + (kValue ? 1 : 0) * here);
    if constexpr (kSecond) sums.second.col(i) = by_second * (Profile::second(left) + Profile::kSecondAtZero * here);
  }
  here = zero;
  for (Index i = landmarks_; i-- > 0;) {
    if (i + 1 < landmarks_) {
      const LineLanes gap = block.gaps.col(i + 1), decay = block.decays.col(i + 1);
      const LineLanes apart = (gap > 0).template cast<double>();
      right.advance(apart * here, gap, decay);
      here *= 1 - apart;
    }
    if constexpr (kValue)
      sums.first.col(i).array() += by_first * (first(right) + here);
    else
      sums.first.col(i).array() -= by_first * first(right);
    if constexpr (kSecond)
      sums.second.col(i).array() += by_second * (Profile::second(right) + Profile::kSecondAtZero * here);
    here += weights.col(i).array();
  }
  return sums;
}

template <bool kValue, bool kSecond>
std::pair<std::vector<Points>, std::vector<Points>> LineSteps::sums(const std::vector<Points>& weights) const {
  std::pair<std::vector<Points>, std::vector<Points>> all{std::vector<Points>(weights.size()),
                                                          std::vector<Points>(kSecond ? weights.size() : 0)};
  parallel_for(static_cast<int>(blocks_.size()), [&](int index) {
    const auto b = static_cast<std::size_t>(index);
    const Lanes lanes = gathered(b, weights);
    const Sums sums = [&] {
      switch (line_moments(term_.profile)) {
        case 1:
          return swept<PeakonOnLine, kValue, kSecond>(blocks_[b], lanes);
        case 2:
          return swept<Matern32OnLine, kValue, kSecond>(blocks_[b], lanes);
        default:
          return swept<Matern52OnLine, kValue, kSecond>(blocks_[b], lanes);
      }
    }();
    scatter(b, sums.first, all.first);
    if constexpr (kSecond) scatter(b, sums.second, all.second);
  });
  return all;
}

std::vector<Points> LineSteps::value(const std::vector<Points>& weights) const {
  return sums<true, false>(weights).first;
}

std::vector<Points> LineSteps::slope(const std::vector<Points>& weights) const {
  return sums<false, false>(weights).first;
}

std::pair<std::vector<Points>, std::vector<Points>> LineSteps::slope_and_second(
    const std::vector<Points>& weights) const {
  return sums<false, true>(weights);
}

template <int S>
void LineSteps::solve_lanes(const Block& block, Lanes& v) const {
  LineLaneStates<S> mean, adjoint;  // of the filter, and of its mean
  mean.fill(LineLanes::Zero());
  adjoint.fill(LineLanes::Zero());
  for (Index i = 0; i < landmarks_; ++i) {
    propagate<S>(mean, block.gaps.col(i), block.decays.col(i));
    const LineLanes innovation = v.col(i).array() - mean[0];
    v.col(i) = innovation;
    for (std::size_t s = 0; s < S; ++s) mean[s] += block.gains[s].col(i).array() * innovation;
  }
  for (Index i = landmarks_; i-- > 0;) {
    LineLanes value = v.col(i).array() / block.variances.col(i).array();
    for (std::size_t s = 0; s < S; ++s) value += block.gains[s].col(i).array() * adjoint[s];
    v.col(i) = value;
    adjoint[0] -= value;
    propagate_back<S>(adjoint, block.gaps.col(i), block.decays.col(i));
  }
}

std::vector<Points> LineSteps::solve(const std::vector<Points>& v) const {
  std::vector<Points> solved(v.size());
  parallel_for(static_cast<int>(blocks_.size()), [&](int index) {
    const auto b = static_cast<std::size_t>(index);
    Lanes lanes = gathered(b, v);
    switch (line_moments(term_.profile)) {
      case 1:
        solve_lanes<1>(blocks_[b], lanes);
        break;
      case 2:
        solve_lanes<2>(blocks_[b], lanes);
        break;
      default:
        solve_lanes<3>(blocks_[b], lanes);
    }
    scatter(b, lanes, solved);
  });
  return solved;
}

}  // namespace pulson
