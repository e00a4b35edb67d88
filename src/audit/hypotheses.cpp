#include "hypotheses.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <fmt/core.h>

#include "points_without_order.hpp"
#include "pulson/core/alignment.hpp"
#include "reorderings.hpp"
#include "robust_alignment.hpp"
#include "slips.hpp"

namespace pulson::audit {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

// Points of dense curves exchange with little loss: in pairs, of which the covariance is not known, what is reported
// must bring the shapes this much closer.
constexpr double kCloser = 0.95;
// Landmarks of a shape in which runs and skips are sought: they cost N³, for each member of a law.
constexpr int kMostInRuns = 150, kMostInSkipsOfPairs = 60;
constexpr double kFurthest = 10;  // root mean square radii: where a wrong landmark may lie
constexpr double kRegion = 2;     // the same: where one that belongs elsewhere on the shape lies
// Slips are sought of landmarks that are further from where they are expected, in predicted standard deviations.
constexpr double kDoubted = 4;
// Two landmarks exactly at one place are not there by chance, where they are expected so many predicted standard
// deviations apart; the odds are those of what is exactly so.
constexpr double kApart = 3;
// A shape of another kind is further than both from the mean, root mean square: over the median of the others, and in
// radii. Of 1,279 shapes of 15 published cohorts, but for those accused of something else, the furthest are at 5.6 and
// 0.18.
constexpr double kForeignDistance = 4, kForeignRadii = 0.25;
constexpr double kAsASet = 4;  // the same, over the median, to the nearest landmarks: points in no order are nearer

int landmarks_in(const LandmarkLaw& law, const Points& shape) {
  int count = 0;
  for (int a = 0; a < shape.cols(); ++a)
    if (law.has(a) && shape.col(a).allFinite()) ++count;
  return count;
}

double log_sphere(double dimension) {  // area of the unit sphere
  return std::log(2) + dimension / 2 * std::log(M_PI) - std::lgamma(dimension / 2);
}

/// One shape and what may be wrong with it.
class Hypotheses {
 public:
  Hypotheses(const LandmarkLaw& of_all, const Judged& judged, const Points& shape, const Odds& odds)
      : of_all_(of_all), law_(of_all), judged_(judged), shape_(shape), odds_(odds) {
    for (int a = 0; a < shape.cols(); ++a) {
      if (!law_.has(a)) continue;
      if (shape.col(a).allFinite())
        kept_.push_back(a);
      else
        law_.drop(a);
    }
    aligned_ = aligned(shape_);
    displacement_ = displacement(aligned_);
    predictions_ = law_.predict(displacement_);
    none_ = law_.log_density(displacement_);
    for (const int a : kept_) {
      const LandmarkLaw::Prediction& here = predictions_[static_cast<std::size_t>(a)];
      unusual_ = std::max(unusual_, here.log_rest + here.log_density - none_);
    }
    apart_ = rms_apart(law_.reference(), shape_);
  }

  /// What is left between the shape and the others' mean, root mean square.
  double distance() const { return displacement_.norm() / std::sqrt(static_cast<double>(kept_.size())); }

  /// Whether that is more than shapes of this kind differ by.
  bool is_foreign() const {
    return judged_.has_others && distance() > kForeignDistance * judged_.typical_distance &&
           distance() > kForeignRadii * radius();
  }

  /// What is said of such a shape as it was given: whether it is of the kind but for the landmarks' order.
  Finding foreign() const {
    const Points target = law_.reference()(Eigen::all, kept_);
    const bool is_near_as_set = distance_as_set(shape_(Eigen::all, kept_), target) < kAsASet * judged_.typical_distance;
    return Finding{
        .problem = is_near_as_set ? Problem::kUnordered : Problem::kForeign, .before = apart_, .after = apart_};
  }

  std::optional<Finding> best() {
    consider_exchange();
    consider_runs();
    consider_mirror();
    if (judged_.is_in_order && std::ssize(kept_) == shape_.cols()) {
      consider_order(true);
      consider_order(false);
    }
    consider_skips();
    consider_moves();
    // Of a pair the variance is not known; an exchange fits at two places, which one landmark in the tail does not.
    if (judged_.has_others || best_.problem == Problem::kMoved || best_.problem == Problem::kShifted) {
      best_.log_ratio -= unusual_;
      best_.log_odds -= unusual_;
    }
    if (best_.log_odds > odds_.least_log) return best_;
    return std::nullopt;
  }

 private:
  Points aligned(const Points& shape) const { return robustly_aligned(shape, law_.reference()); }

  VectorXd displacement(const Points& moved) const {
    VectorXd apart = VectorXd::Zero(moved.size());
    const Index d = moved.rows();
    for (const int a : kept_) apart.segment(a * d, d) = moved.col(a) - law_.reference().col(a);
    return apart;
  }

  double radius() const { return centroid_size(law_.reference()) / std::sqrt(law_.reference().cols()); }

  /// @param count how many hypotheses of this kind there are
  void consider(Finding finding, double count) {
    finding.log_odds = finding.log_ratio - std::log(odds_.shapes_per_error * count);
    if (finding.log_odds <= best_.log_odds) return;
    finding.before = apart_;
    finding.after = rms_apart(law_.reference(), finding.corrected);
    if (judged_.has_others || finding.after < kCloser * finding.before) best_ = std::move(finding);
  }

  void consider_corrected(Problem problem, std::vector<int> landmarks, const Points& corrected, double count) {
    Finding finding{.problem = problem, .landmarks = std::move(landmarks), .corrected = corrected};
    finding.log_ratio = law_.log_density(displacement(aligned(corrected))) - none_;
    consider(std::move(finding), count);
  }

  // Exchanging a and b adds v = (E_a − E_b)(t_b − t_a) to y, and 2vᵀPy + vᵀPv to yᵀPy.
  void consider_exchange() {
    const Index d = shape_.rows();
    int first = -1, second = -1;
    double most = -std::numeric_limits<double>::infinity();
    for (const LandmarkLaw::Member& member : law_.members()) {
      const VectorXd weighted = member.precision * displacement_;
      const double square = displacement_.dot(weighted);
      for (const int b : kept_)
        for (const int a : kept_) {
          if (a >= b) break;
          const VectorXd t = aligned_.col(b) - aligned_.col(a);
          const auto block = [&](int i, int j) { return member.precision.block(i * d, j * d, d, d); };
          const VectorXd pv = (block(a, a) + block(b, b) - block(a, b) - block(b, a)) * t;
          const double changed =
              square + 2 * t.dot(weighted.segment(a * d, d) - weighted.segment(b * d, d)) + t.dot(pv);
          const double here = law_.log_density(member, changed);
          if (here > most) most = here, first = a, second = b;
        }
    }
    const auto n = static_cast<double>(kept_.size());
    if (first >= 0)
      consider_corrected(Problem::kExchanged, {first, second}, exchanged(shape_, first, second), n * (n - 1) / 2);
  }

  // Runs of the same middle grow by an exchange at their ends.
  void consider_runs() {
    const auto n = static_cast<int>(shape_.cols());
    if (std::ssize(kept_) < n || n > kMostInRuns) return;
    const Index d = shape_.rows();
    int first = -1, last = -1;
    double most = -std::numeric_limits<double>::infinity();
    for (const LandmarkLaw::Member& member : law_.members()) {
      const VectorXd weighted = member.precision * displacement_;
      const double square = displacement_.dot(weighted);
      for (int middle = 1; middle < 2 * n - 2; ++middle) {
        double changed = square;
        VectorXd pv = VectorXd::Zero(displacement_.size());
        for (int a = (middle - 1) / 2, b = middle - a; a >= 0 && b < n; --a, ++b) {
          const VectorXd t = aligned_.col(b) - aligned_.col(a);
          const auto gain = [&](const VectorXd& of) { return t.dot(of.segment(a * d, d) - of.segment(b * d, d)); };
          changed += 2 * gain(weighted) + 2 * gain(pv);
          const VectorXd added = (member.precision.middleCols(a * d, d) - member.precision.middleCols(b * d, d)) * t;
          changed += gain(added);
          pv += added;
          const double here = law_.log_density(member, changed);
          if (b - a >= 3 && here > most) most = here, first = a, last = b;
        }
      }
    }
    if (first >= 0)
      consider_corrected(Problem::kReversed, run_of(first, last), run_reversed(shape_, first, last),
                         static_cast<double>(n) * (n - 1) / 2);
  }

  // Of all beginnings the one that fits best, before it is judged: an outline has as many as landmarks.
  void consider_order(bool reversed) {
    const auto n = static_cast<int>(shape_.cols());
    int best = reversed ? n - 1 : 1;
    double least = std::numeric_limits<double>::infinity();
    for (int begin = reversed ? 0 : 1; begin < n; ++begin)
      if (const double here = rms_apart(law_.reference(), reordered(shape_, begin, reversed)); here < least)
        least = here, best = begin;
    consider_corrected(reversed ? Problem::kReversed : Problem::kShifted, {best}, reordered(shape_, best, reversed), n);
  }

  // A landmark was left out, or a point too many was set, and those from there on have their neighbours' names: the
  // positions from `free` to `skipped` move by one, so that the one at `free`, if there is any, belongs nowhere.
  Points moved_by_one(const Points& shape, int free, int skipped) const {
    Points corrected = shape;
    const int step = skipped > free ? 1 : -1;
    for (int a = free; a != skipped; a += step) corrected.col(a) = shape.col(a + step);
    corrected.col(skipped).setConstant(std::nan(""));
    return corrected;
  }

  void consider_skips() {
    const auto n = static_cast<int>(shape_.cols());
    if (of_all_.landmarks() < n || n > (judged_.has_others ? kMostInRuns : kMostInSkipsOfPairs)) return;
    std::vector<std::pair<int, int>> skips;
    const auto add = [&](int free, int skipped) {
      if (std::abs(free - skipped) >= 2 && law_.has(skipped)) skips.emplace_back(free, skipped);
    };
    const auto missing = n - std::ssize(kept_);
    for (int a = 0; a < n; ++a) {
      for (const int end : {0, n - 1}) {
        if (law_.has(end)) add(end, a);
        if (law_.has(a) && a != 0 && a != n - 1) add(a, end);
      }
      for (int free = 0; missing <= 2 && free < n; ++free)
        if (!law_.has(free)) add(free, a);
    }
    std::pair<int, int> best{-1, -1};
    double most = -std::numeric_limits<double>::infinity();
    for (const auto& [free, skipped] : skips) {
      const double ratio = log_ratio_of_skip(aligned_, free, skipped);
      if (ratio > most) most = ratio, best = {free, skipped};
    }
    if (best.first < 0) return;
    Finding finding{.problem = Problem::kShifted, .corrected = moved_by_one(shape_, best.first, best.second)};
    finding.landmarks = run_of(std::min(best.first, best.second), std::max(best.first, best.second));
    if (best.second > best.first) std::reverse(finding.landmarks.begin(), finding.landmarks.end());
    const double density = log_density_of(aligned(finding.corrected), best.first, best.second);
    finding.log_ratio = density + log_density_of_junk(best.first) - none_;
    consider(std::move(finding), static_cast<double>(skips.size()));
  }

  // @param moved with the landmarks as given, aligned
  double log_ratio_of_skip(const Points& moved, int free, int skipped) const {
    const Points corrected = moved_by_one(moved, free, skipped);
    return log_density_of(corrected, free, skipped) + log_density_of_junk(free) - none_;
  }

  double log_density_of_junk(int landmark) const {
    if (!law_.has(landmark)) return 0;
    return -static_cast<double>(shape_.rows()) * std::log(kRegion * radius());
  }

  // Of a shape that lacks the landmark `skipped`, and has `free`.
  double log_density_of(const Points& moved, int free, int skipped) const {
    const Index d = shape_.rows();
    VectorXd apart = VectorXd::Zero(moved.size());
    for (int a = 0; a < moved.cols(); ++a)
      if (moved.col(a).allFinite()) apart.segment(a * d, d) = moved.col(a) - law_.reference().col(a);
    if (law_.has(free)) return law_.log_density_without(skipped, apart);
    LandmarkLaw law = of_all_;
    for (int a = 0; a < moved.cols(); ++a)
      if (!law_.has(a) && a != free) law.drop(a);
    return law.log_density_without(skipped, apart);
  }

  void consider_mirror() {
    Points mirrored = shape_;
    mirrored.row(0) *= -1;
    consider_corrected(Problem::kMirrored, {}, mirrored, 1);
  }

  // How far a wrong landmark lies away has no scale: its logarithm is as likely between the predicted standard
  // deviation and ten radii of the shape.
  double log_density_of_wrong(const LandmarkLaw::Prediction& prediction) const {
    const auto d = static_cast<double>(shape_.rows());
    const double range = std::log(std::max(kFurthest * radius() / prediction.spread, M_E));
    const double away = std::max(prediction.deviation.norm(), prediction.spread);
    return -log_sphere(d) - d * std::log(away) - std::log(range);
  }

  void consider_moves() {
    if (shape_.rows() < 2) return;
    int best = -1;
    double most = -std::numeric_limits<double>::infinity();
    for (const int a : kept_) {
      const LandmarkLaw::Prediction& here = predictions_[static_cast<std::size_t>(a)];
      const double ratio = here.log_rest + log_density_of_wrong(here) - none_;
      consider_coincidence(a);
      if (ratio > most) most = ratio, best = a;
    }
    if (best < 0) return;
    Finding finding{.problem = Problem::kMoved,
                    .landmarks = {best},
                    .log_ratio = most,
                    .slip = coincidence_of(best),
                    .corrected = shape_};
    finding.corrected.col(best).setConstant(std::nan(""));
    consider(std::move(finding), static_cast<double>(kept_.size()));
    if (predictions_[static_cast<std::size_t>(best)].distance > kDoubted) consider_slips(best);
  }

  std::string coincidence_of(int landmark) const {
    for (const int other : kept_)
      if (other != landmark && shape_.col(other) == shape_.col(landmark))
        return fmt::format("it coincides with landmark {}", other + 1);
    return {};
  }

  // Of the two the one further from where it is expected.
  void consider_coincidence(int landmark) {
    const auto& own = predictions_[static_cast<std::size_t>(landmark)];
    for (const int other : kept_) {
      if (other == landmark || shape_.col(other) != shape_.col(landmark)) continue;
      const auto& its = predictions_[static_cast<std::size_t>(other)];
      const double apart = (law_.reference().col(other) - law_.reference().col(landmark)).norm();
      if (apart < kApart * std::max(own.spread, its.spread) || own.distance < its.distance) continue;
      Finding finding{.problem = Problem::kMoved,
                      .landmarks = {landmark},
                      .log_ratio = kLogCertain,
                      .slip = coincidence_of(landmark),
                      .corrected = shape_};
      finding.corrected.col(landmark).setConstant(std::nan(""));
      consider(std::move(finding), 1);
    }
  }

  // What is typed wrongly: the density of what stands there is that of what was meant, over what the slip stretches.
  void consider_slips(int landmark) {
    const std::vector<Slip> slips = slips_of(shape_.col(landmark));
    for (const Slip& slip : slips) {
      Points corrected = shape_;
      corrected.col(landmark) = slip.meant;
      const double density = law_.log_density(displacement(aligned(corrected)));
      Finding finding{.problem = Problem::kMoved,
                      .landmarks = {landmark},
                      .log_ratio = density + slip.log_stretch - none_,
                      .slip = slip.text,
                      .corrected = std::move(corrected)};
      consider(std::move(finding), static_cast<double>(kept_.size() * slips.size()));
    }
  }

  const LandmarkLaw& of_all_;
  LandmarkLaw law_;  // of the landmarks that the shape has
  const Judged& judged_;
  const Points& shape_;
  const Odds& odds_;
  std::vector<int> kept_;
  Points aligned_;
  VectorXd displacement_;
  std::vector<LandmarkLaw::Prediction> predictions_;
  double none_ = 0, apart_ = 0;
  double unusual_ = 0;  // log density of a sound shape with one landmark in the tail, over none_

  Finding best_{.log_odds = -std::numeric_limits<double>::infinity()};
};

}  // namespace

std::vector<Finding> judge(const LandmarkLaw& law, const Judged& shape, const Odds& odds) {
  std::vector<Finding> findings;
  Points points = shape.points;
  const auto most = static_cast<std::size_t>(1 + points.cols() / 4);
  const auto is_judged = [&] { return landmarks_in(law, points) >= kFewestLandmarks; };
  while (findings.size() < most && is_judged()) {
    std::optional<Finding> found = Hypotheses(law, shape, points, odds).best();
    if (!found) break;
    points = found->corrected;
    findings.push_back(std::move(*found));
  }
  if (is_judged() && Hypotheses(law, shape, points, odds).is_foreign())
    return {Hypotheses(law, shape, shape.points, odds).foreign()};
  return findings;
}

}  // namespace pulson::audit
