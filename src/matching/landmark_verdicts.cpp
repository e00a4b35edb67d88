#include "pulson/matching/landmark_verdicts.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kMostAction = 0.9;
// At most a third of the landmarks is few: of 24 matches with ch-sd of 5 % and 100 % it takes 40 to 72 % of the
// landmarks in 20, and 6 to 17 % where a few have to change their order or to part from their neighbours.
constexpr int kOneOf = 3;

// The median over the landmarks of the distance to the nearest other one.
double spacing_of(const Points& q) {
  std::vector<double> nearest;
  for (Index a = 0; a < q.cols(); ++a) {
    Eigen::ArrayXd squares = (q.colwise() - q.col(a)).colwise().squaredNorm().transpose();
    squares[a] = std::numeric_limits<double>::infinity();
    nearest.push_back(std::sqrt(squares.minCoeff()));
  }
  const auto middle = nearest.begin() + std::ssize(nearest) / 2;
  std::nth_element(nearest.begin(), middle, nearest.end());
  return *middle;
}

// Whether the noise moves landmarks beyond σ; it does where the flow cannot be followed without it.
bool moves_landmarks(const Registration& registration, const LandmarkShares& shares) {
  const auto count = static_cast<double>(registration.source.count());
  return shares.noise.size() == 0 || std::sqrt(shares.noise.squaredNorm() / count) > registration.sigma;
}

// The fewest landmarks with this part of the sum, in their order.
std::vector<int> fewest_with(const VectorXd& parts, double most) {
  std::vector<int> order(static_cast<std::size_t>(parts.size()));
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return parts[a] > parts[b]; });
  double sum = 0;
  std::size_t count = 0;
  while (count < order.size() && sum < most) sum += parts[order[count++]];
  order.resize(count);
  std::sort(order.begin(), order.end());
  return order;
}

PredictionWord word_of(const Registration& registration, const PredictionOfMatch& prediction) {
  const bool differs = registration.initial_rms() > 3 * registration.sigma;
  const std::vector<int>& doubted = prediction.doubted;
  if (differs && prediction.predictions.error(doubted) >= prediction.aligned.error(doubted))
    return PredictionWord::kNoCommonPart;
  return doubted.empty() ? PredictionWord::kPredicted : PredictionWord::kDoubted;
}

}  // namespace

const std::vector<int>& LandmarkVerdicts::doubted() const {
  static const std::vector<int> none;
  return prediction ? prediction->doubted : none;
}

double LandmarkVerdicts::concentrated_share() const { return action_share(concentrated).sum(); }

LandmarkVerdicts judge_landmarks(const Registration& registration, const LandmarkShares& shares) {
  LandmarkVerdicts verdicts;
  verdicts.residual = registration.residuals_over_sigma();
  verdicts.weight = registration.robust ? registration.robust->weights : registration.data.weights;
  verdicts.prediction = predict_match(registration);
  if (const auto& prediction = verdicts.prediction) {
    verdicts.predicted = prediction->predictions.over_sigma();
    verdicts.word = word_of(registration, *prediction);
    verdicts.may_be_unordered = verdicts.word == PredictionWord::kNoCommonPart &&
                                prediction->aligned.error(prediction->doubted) > spacing_of(registration.source.points);
  }
  if (shares.action.size() == 0 || !(shares.action.sum() > 0)) return verdicts;
  verdicts.action_share = shares.action / shares.action.sum();
  std::vector<int> most = fewest_with(verdicts.action_share, kMostAction);
  if (kOneOf * std::ssize(most) <= registration.source.count() && moves_landmarks(registration, shares))
    verdicts.concentrated = std::move(most);
  return verdicts;
}

}  // namespace pulson::matching
