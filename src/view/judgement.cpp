#include "judgement.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>

#include "audit/audit.hpp"
#include "audit/landmark_law.hpp"
#include "audit/robust_alignment.hpp"
#include "pulson/core/alignment.hpp"

namespace pulson::view {
namespace {

using Eigen::Index;
using Eigen::Matrix2d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

constexpr double kProposed = 0.95;     // probability of the ellipse that is shown
constexpr double kFalseAlarms = 0.05;  // of sound shapes, those with a landmark in doubt
constexpr double kTailOfPairs = 4;     // degrees of judgements, as in audit/landmark_law.cpp
// Degrees by which landmarks of one shape differ in how well the others predict them. With 6, of 1,000 random pairs of
// each of five published cohorts 94.7 to 99.0 % of the ellipses hold the landmark: benchmarks/proposals.cpp.
constexpr double kTailOfLandmarks = 6;
constexpr double kClick = 0.002;     // standard deviation of a click, part of the diameter
constexpr double kRounding = 1e-13;  // of s², in squared diameters

// P(|t_ν|² ≤ r²) = p in the plane, in units of the scale matrix: F of 2 and ν degrees has this closed form.
double square_radius(double degrees, double probability) {
  return degrees * (std::pow(1 - probability, -2 / degrees) - 1);
}

/// Where the law expects one landmark, given the others.
struct Expected {
  Vector2d deviation{0, 0};  // of where it is from there
  Matrix2d covariance = Matrix2d::Zero();
  double log_density = -std::numeric_limits<double>::infinity();  // of the others
};

Expected expected_by(const audit::LandmarkLaw::Member& member, int landmark, const VectorXd& y, double directions,
                     double size) {
  const Index row = 2 * landmark;
  const Matrix2d own = member.precision.block<2, 2>(row, row);
  const Eigen::LLT<Matrix2d> factors(own);
  const VectorXd weighted = member.precision * y;
  const Vector2d part = weighted.segment<2>(row);
  Expected expected;
  expected.deviation = factors.solve(part);
  const double rest = std::max(y.dot(weighted) - expected.deviation.dot(part), kRounding * size * size);
  const double degrees = directions - 2;
  expected.covariance = rest / degrees * factors.solve(Matrix2d::Identity());
  expected.log_density =
      member.log_constant - factors.matrixLLT().diagonal().array().log().sum() - degrees / 2 * std::log(rest);
  return expected;
}

// By all members, each weighted by the probability that it gives to the other landmarks: mean and covariance of the
// mixture. The best member alone would be too sure, as a few landmarks do not tell the members apart.
Expected expected_by(const audit::LandmarkLaw& law, int landmark, const VectorXd& y, double size) {
  std::vector<Expected> by_member;
  double most = -std::numeric_limits<double>::infinity();
  for (const audit::LandmarkLaw::Member& member : law.members()) {
    by_member.push_back(expected_by(member, landmark, y, law.directions(), size));
    most = std::max(most, by_member.back().log_density);
  }
  double sum = 0;
  for (Expected& each : by_member) sum += each.log_density = std::exp(each.log_density - most);
  Expected mixture{.log_density = most};
  for (const Expected& each : by_member) mixture.deviation += each.log_density / sum * each.deviation;
  for (const Expected& each : by_member) {
    const Vector2d apart = each.deviation - mixture.deviation;
    mixture.covariance += each.log_density / sum * (each.covariance + apart * apart.transpose());
  }
  return mixture;
}

/// Both shapes without what is not placed, the one aligned with the other.
class AlignedPair {
 public:
  /// @param places landmarks, of which the shape may lack the last
  AlignedPair(const Points& reference, const Points& shape, const std::vector<int>& places)
      : reference_(reference(Eigen::all, places)), size_(diameter(reference_)) {
    const Points own = shape(Eigen::all, places);
    aligned_ = audit::robustly_aligned(own, reference_);
    back_ = align(aligned_, own, AlignmentKind::kSimilarity);
  }

  /// Displacements from the reference, 0 where the shape has no landmark.
  VectorXd displacements() const {
    Points y = aligned_ - reference_;
    y = y.array().isNaN().select(0, y);
    return y.reshaped();
  }

  /// The region of a probability where the k-th is expected, in coordinates of the shape.
  Ellipse region(const Expected& expected, Index k, double degrees, double probability) const {
    const Vector2d here = aligned_.col(k).allFinite() ? aligned_.col(k) : reference_.col(k);
    const double click = kClick * size_;
    const Matrix2d scale = expected.covariance + click * click * Matrix2d::Identity();
    const Matrix2d turn = back_.scale * back_.linear;
    return {back_.apply(here - expected.deviation),
            square_radius(degrees, probability) * turn * scale * turn.transpose()};
  }

  const Points& reference() const { return reference_; }
  double size() const { return size_; }

 private:
  Points reference_;
  double size_;
  Points aligned_;
  Alignment back_;
};

bool can_judge(const Points& reference) {
  return reference.cols() > kFewestKnown && diameter(reference) > 0 && !find_coincident(reference, 1e-6);
}

void propose(const Points& reference, const Points& shape, std::vector<int> known, int wanted, Judgement& judgement) {
  known.push_back(wanted);
  const AlignedPair pair(reference, shape, known);
  if (!can_judge(pair.reference())) return;
  const audit::LandmarkLaw law = audit::pair_law(pair.reference());
  const int last = static_cast<int>(known.size()) - 1;
  const Expected expected = expected_by(law, last, pair.displacements(), pair.size());
  const double degrees = 1 / (1 / (law.directions() - 2) + 1 / kTailOfLandmarks);
  judgement.proposal = pair.region(expected, last, degrees, kProposed);
}

void doubt(const Points& reference, const Points& shape, const std::vector<int>& known, Judgement& judgement) {
  const AlignedPair pair(reference, shape, known);
  if (!can_judge(pair.reference())) return;
  const audit::LandmarkLaw law = audit::pair_law(pair.reference());
  const VectorXd y = pair.displacements();
  const double degrees = std::min(law.directions() - 2, kTailOfPairs);
  const double each = 1 - kFalseAlarms / static_cast<double>(known.size());
  for (std::size_t k = 0; k < known.size(); ++k) {
    const Expected expected = expected_by(law, static_cast<int>(k), y, pair.size());
    const Ellipse region = pair.region(expected, static_cast<Index>(k), degrees, each);
    if (!region.contains(shape.col(known[k]))) judgement.doubtful.push_back({known[k], region});
  }
}

void audit_both(const Points& reference, const Points& shape, const std::vector<int>& known, Judgement& judgement) {
  if (std::ssize(known) < audit::kFewestLandmarksOfPair) return;
  Landmarks first, second;
  first.points = reference(Eigen::all, known);
  second.points = shape(Eigen::all, known);
  for (const int a : known) second.numbers.push_back(a + 1);
  for (const audit::Finding& finding : audit::audit_pair(first, second).findings) {
    judgement.findings.push_back(audit::describe(finding, second));
    if (finding.problem == audit::Problem::kExchanged && finding.landmarks.size() == 2)
      judgement.exchanged.push_back({known[static_cast<std::size_t>(finding.landmarks[0])],
                                     known[static_cast<std::size_t>(finding.landmarks[1])]});
  }
}

}  // namespace

bool Ellipse::contains(const Vector2d& x) const {
  const Vector2d away = x - centre;
  return away.dot(shape.ldlt().solve(away)) <= 1;
}

Judgement judge_placement(const Points& reference, const Points& shape, std::optional<int> wanted) {
  Judgement judgement;
  const std::vector<int> known = audit::observed_in_both(reference, shape);
  if (std::ssize(known) < kFewestKnown || std::ssize(known) > kMostJudged) return judgement;
  if (!(diameter(shape(Eigen::all, known)) > 0)) return judgement;
  if (wanted && reference.col(*wanted).allFinite() && !shape.col(*wanted).allFinite())
    propose(reference, shape, known, *wanted, judgement);
  doubt(reference, shape, known, judgement);
  audit_both(reference, shape, known, judgement);
  return judgement;
}

}  // namespace pulson::view
