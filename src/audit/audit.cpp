#include "audit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <mutex>
#include <numeric>
#include <optional>

#include "cohort_law.hpp"
#include "core/landmark_pairs.hpp"
#include "hypotheses.hpp"
#include "pulson/core/alignment.hpp"
#include "pulson/core/parallel.hpp"
#include "robust_alignment.hpp"

namespace pulson::audit {
namespace {

constexpr double kShapesPerError = 50;
// The greatest odds against a landmark of 11 published cohorts that is not known to be wrong are 8. What is suspected
// does not widen the tails that are fitted: from odds of 1/20 on sound landmarks are left out, too, and accused with
// odds of 70; from 1 on, of 90 landmarks planted 8 predicted standard deviations away 44 are found in place of 62.
constexpr double kLeastOdds = 20, kSuspectedOdds = 1.0 / 8;
constexpr int kMeanRounds = 5;
constexpr int kRefits = 2;       // without the shapes accused
constexpr int kFewestSound = 2;  // shapes that a law is fitted to: each of them is judged by one other at least
// Radii from the mean within which exactly the numbers of a code are taken for a place; sound landmarks are up to 0.5
// away, but seldom at such numbers.
constexpr double kNear = 0.25;
const Odds kFound{kShapesPerError, std::log(kLeastOdds)}, kSuspected{kShapesPerError, std::log(kSuspectedOdds)};
constexpr double kAlike = 0.85;  // cosine of 32°: half of the 90° between the poses of two axes' reflections is 45°

Points observed_of(const Points& points, const std::vector<int>& observed) { return points(Eigen::all, observed); }

double spread_of(const Points& shape) { return centroid_size(shape) / std::sqrt(static_cast<double>(shape.cols())); }

// The median distance from the median of each coordinate, which single landmarks far away do not change.
double middle_radius(const Points& shape) {
  Points centred = shape;
  for (Eigen::Index axis = 0; axis < shape.rows(); ++axis)
    centred.row(axis).array() -= median_of({shape.row(axis).begin(), shape.row(axis).end()});
  const Eigen::VectorXd distances = centred.colwise().norm().transpose();
  return median_of({distances.begin(), distances.end()});
}

bool is_at_one_place(const Points& points) {
  const std::vector<int> observed = observed_in_both(points, points);
  return std::ssize(observed) < 2 || !(diameter(observed_of(points, observed)) > 0);
}

// Landmarks of several groups, as of two objects, are not in one order around an outline.
bool may_be_reordered(const Landmarks& shape) { return landmarks_by_group(shape).size() == 1; }

// Landmarks of each shape at numbers that stand for a missing one, where they are all of its coordinates; but for
// numbers at which most shapes have a landmark, as one is that coordinates begin at.
std::vector<std::vector<int>> at_missing_codes(const std::vector<Landmarks>& shapes) {
  constexpr std::array kCodes = {0.0, -1.0, -9.0, -99.0, -999.0, -9999.0, 99.0, 999.0, 9999.0};
  std::vector<std::vector<int>> found(shapes.size());
  if (shapes.front().dimension() < 2) return found;
  for (const double code : kCodes) {
    const auto count_at = [&](const Landmarks& shape) {
      return (shape.points.array() == code).colwise().all().count();
    };
    const auto with =
        std::count_if(shapes.begin(), shapes.end(), [&](const auto& shape) { return count_at(shape) > 0; });
    if (2 * with > std::ssize(shapes)) continue;
    for (std::size_t i = 0; i < shapes.size(); ++i)
      for (int a = 0; a < shapes[i].count(); ++a)
        if ((shapes[i].points.col(a).array() == code).all()) found[i].push_back(a);
  }
  return found;
}

// The median of each coordinate over shapes that are aligned with it.
Points robust_mean(const std::vector<Points>& shapes) {
  std::vector<Landmarks> all(shapes.size());
  for (std::size_t i = 0; i < shapes.size(); ++i) all[i].points = shapes[i];
  Points mean = procrustes_mean(all, AlignmentKind::kSimilarity).points;
  for (int round = 0; round < kMeanRounds; ++round) {
    std::vector<std::vector<double>> values(static_cast<std::size_t>(mean.size()));
    for (const Points& shape : shapes) {
      const Points moved = robustly_aligned(shape, mean);
      for (std::size_t k = 0; k < values.size(); ++k)
        if (const double value = moved.reshaped()[static_cast<Eigen::Index>(k)]; !std::isnan(value))
          values[k].push_back(value);
    }
    for (std::size_t k = 0; k < values.size(); ++k)
      mean.reshaped()[static_cast<Eigen::Index>(k)] = median_of(std::move(values[k]));
  }
  return mean;
}

// Sizes that differ from most by much more than these differ from one another, and by more than shapes of one kind do;
// or by less, where the factor between two units explains it.
std::vector<Finding> other_units(const std::vector<Points>& shapes) {
  constexpr double kLeastFactor = 5, kDeviations = 8, kNormal = 1.4826;  // median absolute deviation to standard one
  constexpr double kFromMost = 5, kNearMost = 2.5;                       // before and after a known factor is undone
  constexpr std::array kFactors = {2.54, 10.0, 25.4, 100.0, 1000.0};
  std::vector<double> sizes, apart;
  for (const Points& shape : shapes)
    sizes.push_back(std::log(middle_radius(observed_of(shape, observed_in_both(shape, shape)))));
  const double middle = median_of(sizes);
  for (const double size : sizes) apart.push_back(std::abs(size - middle));
  const double deviation = kNormal * median_of(apart);
  const double least = std::max(std::log(kLeastFactor), kDeviations * deviation);
  std::vector<Finding> found;
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const bool is_known = std::any_of(kFactors.begin(), kFactors.end(), [&](double factor) {
      return std::abs(apart[i] - std::log(factor)) <= kNearMost * deviation;
    });
    if (apart[i] <= least && !(is_known && apart[i] > kFromMost * deviation)) continue;
    const double factor = std::exp(sizes[i] - middle);
    found.push_back({.problem = Problem::kUnit,
                     .specimen = static_cast<int>(i),
                     .log_odds = kLogCertain,
                     .factor = factor,
                     .corrected = shapes[i] / factor});
  }
  return found;
}

// A mirror image is one about some axis, or of two axes in each other's place: that whose pose is the others'. The
// reflections differ by rotations alone, so that only the pose can show which it is.
void tell_axes(std::vector<Finding>& findings, const Points& reference, const Eigen::MatrixXd& others) {
  const auto first = std::find_if(findings.begin(), findings.end(),
                                  [](const Finding& finding) { return finding.problem == Problem::kMirrored; });
  if (first == findings.end()) return;
  const Eigen::Index d = reference.rows();
  Eigen::MatrixXd flip = Eigen::MatrixXd::Identity(d, d);
  flip(0, 0) = -1;
  double most = -std::numeric_limits<double>::infinity();
  Eigen::MatrixXd best = flip;
  const auto consider = [&](const Eigen::MatrixXd& reflection) {
    const Points corrected = reflection * flip * first->corrected;
    const Eigen::MatrixXd pose = align(corrected, reference, AlignmentKind::kRigid).linear;
    if (const double agreement = pose.cwiseProduct(others).sum(); agreement > most) most = agreement, best = reflection;
  };
  for (Eigen::Index axis = 0; axis < d; ++axis) {
    Eigen::MatrixXd reflection = Eigen::MatrixXd::Identity(d, d);
    reflection(axis, axis) = -1;
    consider(reflection);
    for (Eigen::Index other = 0; other < axis; ++other) {
      Eigen::MatrixXd swap = Eigen::MatrixXd::Identity(d, d);
      swap.col(axis).swap(swap.col(other));
      consider(swap);
    }
  }
  // the others' poses differ by less than half of the angle between the axes' reflections
  if (most < kAlike * static_cast<double>(d)) return;
  const bool is_swap = best.diagonal().minCoeff() == 0;
  if (is_swap) first->problem = Problem::kAxes;
  for (auto finding = first; finding != findings.end(); ++finding)
    if (finding->corrected.size() > 0) finding->corrected = best * flip * finding->corrected;
}

/// The shapes of a cohort that can be judged by a law, and what is said of the others at once.
class CohortAudit {
 public:
  CohortAudit(const std::vector<Landmarks>& shapes, const std::function<void(double)>& on_progress)
      : shapes_(shapes), on_progress_(on_progress), codes_(at_missing_codes(shapes)) {
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      Points points = shapes[i].points;
      points(Eigen::all, codes_[i]).setConstant(std::nan(""));
      if (is_at_one_place(points)) {
        if (observed_in_both(shapes[i].points, shapes[i].points).size() > 1)
          add({.problem = Problem::kUndigitised,
               .specimen = static_cast<int>(i),
               .log_odds = kLogCertain,
               .corrected = Points::Constant(points.rows(), points.cols(), std::nan(""))});
        continue;
      }
      const auto observed = std::ssize(observed_in_both(points, points));
      if (shapes[i].dimension() > 1 && observed < std::min<std::ptrdiff_t>(kFewestLandmarks, points.cols())) continue;
      place_.push_back(i);
      points_.push_back(std::move(points));
    }
    if (points_.size() < kFewestShapes) return;
    for (Finding unit : other_units(points_)) {
      unit.specimen = static_cast<int>(place_[static_cast<std::size_t>(unit.specimen)]);
      add(std::move(unit));
    }
    const auto n = static_cast<int>(points_.front().cols());
    if (shapes.front().dimension() > 1 && n >= kFewestLandmarks && n <= kMostLandmarks && has_each_landmark())
      judge_all();
  }

  Audit result() && {
    std::stable_sort(findings_.begin(), findings_.end(),
                     [](const Finding& a, const Finding& b) { return a.specimen < b.specimen; });
    return {.findings = std::move(findings_), .reference = std::move(reference_), .shapes_per_error = kShapesPerError};
  }

 private:
  void add(Finding finding) { findings_.push_back(std::move(finding)); }

  // In some shape.
  bool has_each_landmark() const {
    for (Eigen::Index a = 0; a < points_.front().cols(); ++a)
      if (std::none_of(points_.begin(), points_.end(), [&](const Points& shape) { return shape.col(a).allFinite(); }))
        return false;
    return true;
  }

  // @param fit how many came before
  void judge_each(const CohortLaw& law, const Odds& odds, int fit, std::vector<std::vector<Finding>>& found) const {
    std::mutex reporting;
    int done = 0;
    parallel_for(static_cast<int>(points_.size()), [&](int i) {
      const auto at = static_cast<std::size_t>(i);
      found[at] = judge_one(law, at, odds);
      if (!on_progress_) return;
      const std::lock_guard lock(reporting);
      on_progress_((fit + ++done / static_cast<double>(points_.size())) / (kRefits + 1));
    });
  }

  // A landmark that is about where it belongs may be there, whatever its numbers.
  void restore_codes(const Points& mean) {
    const double radius = spread_of(mean);
    for (std::size_t i = 0; i < points_.size(); ++i) {
      std::vector<int>& codes = codes_[place_[i]];
      if (codes.empty()) continue;
      const Points moved = robustly_aligned(shapes_[place_[i]].points, mean);
      std::erase_if(codes, [&](int a) {
        const bool belongs = (moved.col(a) - mean.col(a)).norm() < kNear * radius;
        if (belongs) points_[i].col(a) = shapes_[place_[i]].points.col(a);
        return belongs;
      });
    }
  }

  void judge_all() {
    const Points mean = robust_mean(points_);
    restore_codes(mean);
    const ShapeDirections directions(mean);
    std::vector<bool> accused(points_.size(), false);
    std::vector<std::vector<Finding>> found(points_.size());
    for (int fit = 0; fit <= kRefits; ++fit) {
      const CohortLaw law(points_, directions, accused);
      reference_ = law.reference();
      if (fit < kRefits) {
        judge_each(law, kSuspected, fit, found);
        std::vector<bool> now;
        for (const auto& of_one : found) now.push_back(!of_one.empty());
        accused = std::move(now);
        if (std::count(accused.begin(), accused.end(), false) >= kFewestSound) continue;
      }
      judge_each(law, kFound, kRefits, found);
      break;
    }
    Eigen::MatrixXd poses = Eigen::MatrixXd::Zero(reference_.rows(), reference_.rows());
    for (std::size_t i = 0; i < found.size(); ++i)
      if (found[i].empty())
        poses += align(points_[i], reference_, AlignmentKind::kRigid).linear / static_cast<double>(points_.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
      tell_axes(found[i], reference_, poses);
      for (Finding& finding : found[i]) {
        finding.specimen = static_cast<int>(place_[i]);
        add(std::move(finding));
      }
    }
  }

  std::vector<Finding> judge_one(const CohortLaw& law, std::size_t i, const Odds& odds) const {
    const Landmarks& shape = shapes_[place_[i]];
    std::vector<Finding> found = judge_codes(law, i);
    const bool is_ordered = may_be_reordered(shape);
    for (Finding& finding : judge(law.law_without(i), {points_[i], is_ordered, true, law.typical_distance()}, odds))
      found.push_back(std::move(finding));
    return found;
  }

  // What stands for a missing landmark is where no landmark is expected.
  std::vector<Finding> judge_codes(const CohortLaw& law, std::size_t i) const {
    const Landmarks& shape = shapes_[place_[i]];
    const std::vector<int>& codes = codes_[place_[i]];
    if (codes.empty()) return {};
    return {{.problem = Problem::kZero,
             .specimen = 0,
             .landmarks = codes,
             .log_odds = kLogCertain,
             .before = rms_apart(law.reference(), shape.points),
             .after = rms_apart(law.reference(), points_[i]),
             .corrected = points_[i]}};
  }

  const std::vector<Landmarks>& shapes_;
  const std::function<void(double)>& on_progress_;
  std::vector<std::vector<int>> codes_;  // of each shape
  std::vector<std::size_t> place_;       // in the cohort, of each that is judged
  std::vector<Points> points_;
  std::vector<Finding> findings_;
  Points reference_;
};

// Of two shapes, one of which may be a picture's copy of another resolution.
std::optional<Finding> other_unit(const Points& reference, const Points& shape) {
  constexpr double kLeastFactor = 20;
  const double ratio = spread_of(shape) / spread_of(reference);
  if (!std::isfinite(ratio) || std::abs(std::log(ratio)) < std::log(kLeastFactor)) return std::nullopt;
  return Finding{.problem = Problem::kUnit, .specimen = 1, .log_odds = kLogCertain, .factor = ratio};
}

// Of positions in a random order a similarity explains this part with the probability 0.7^(n − 2) in the plane.
std::optional<Finding> without_order(const Points& reference, const Points& shape) {
  constexpr double kExplained = 0.3;
  const double apart = rms_apart(reference, shape);
  if (1 - std::pow(apart / spread_of(shape), 2) > kExplained) return std::nullopt;
  return Finding{.problem = Problem::kUnordered, .specimen = 1, .before = apart, .after = apart};
}

}  // namespace

Audit audit_pair(const Landmarks& reference, const Landmarks& shape) {
  Audit audit{.findings = {}, .reference = reference.points, .shapes_per_error = kShapesPerError};
  const std::vector<int> observed = observed_in_both(reference.points, shape.points);
  const Points x = observed_of(reference.points, observed), t = observed_of(shape.points, observed);
  const auto n = std::ssize(observed);
  if (x.rows() > 1 && n >= kFewestLandmarksOfPair && n <= kMostLandmarks && !is_at_one_place(x) &&
      !is_at_one_place(t)) {
    audit.findings = judge(pair_law(x), {t, n == shape.count() && may_be_reordered(shape), false, 0}, kFound);
    tell_axes(audit.findings, x, Eigen::MatrixXd::Identity(x.rows(), x.rows()));
    for (Finding& finding : audit.findings) {
      finding.specimen = 1;
      for (int& landmark : finding.landmarks) landmark = observed[static_cast<std::size_t>(landmark)];
      Points all = shape.points;
      all(Eigen::all, observed) = finding.corrected;
      finding.corrected = std::move(all);
    }
    if (audit.findings.empty())
      if (const auto found = without_order(x, t)) audit.findings.push_back(*found);
  }
  if (audit.findings.empty() && n > 1)
    if (const auto found = other_unit(x, t)) audit.findings.push_back(*found);
  return audit;
}

Audit audit_cohort(const std::vector<Landmarks>& shapes, const std::function<void(double)>& on_progress) {
  if (shapes.empty()) return {};
  return CohortAudit(shapes, on_progress).result();
}

}  // namespace pulson::audit
