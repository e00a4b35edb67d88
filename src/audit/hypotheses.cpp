#include "hypotheses.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include <fmt/core.h>

#include "pulson/core/alignment.hpp"
#include "robust_alignment.hpp"

namespace pulson::audit {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kLeastOdds = 100;
// Points of dense curves exchange with little loss: in pairs, of which the covariance is not known, what is reported
// must bring the shapes this much closer.
constexpr double kCloser = 0.9;
constexpr int kMostInRuns = 150;  // landmarks of a shape in which runs are sought: they cost N³
constexpr double kFurthest = 10;  // root mean square radii: where a wrong landmark may lie

double log_sphere(double dimension) {  // area of the unit sphere
  return std::log(2) + dimension / 2 * std::log(M_PI) - std::lgamma(dimension / 2);
}

Points reordered(const Points& shape, int begin, bool reversed) {
  const auto n = static_cast<int>(shape.cols());
  std::vector<int> order;
  for (int k = 0; k < n; ++k) order.push_back(((reversed ? begin - k : begin + k) % n + n) % n);
  return shape(Eigen::all, order);
}

Points exchanged(Points shape, int a, int b) {
  shape.col(a).swap(shape.col(b));
  return shape;
}

Points run_reversed(Points shape, int first, int last) {
  for (; first < last; ++first, --last) shape.col(first).swap(shape.col(last));
  return shape;
}

std::vector<int> run_of(int first, int last) {
  std::vector<int> run(static_cast<std::size_t>(last - first + 1));
  std::iota(run.begin(), run.end(), first);
  return run;
}

/// One shape and what may be wrong with it.
class Hypotheses {
 public:
  Hypotheses(const LandmarkLaw& law, const Judged& judged, const Points& shape, double shapes_per_error)
      : law_(law), judged_(judged), shape_(shape), shapes_per_error_(shapes_per_error) {
    for (int a = 0; a < shape.cols(); ++a)
      if (law_.has(a)) kept_.push_back(a);
    aligned_ = aligned(shape_);
    displacement_ = displacement(aligned_);
    none_ = law_.log_density(displacement_);
    apart_ = rms_apart(law_.reference(), shape_);
  }

  std::optional<Finding> best() {
    consider_exchange();
    consider_runs();
    consider_mirror();
    if (judged_.is_in_order && std::ssize(kept_) == shape_.cols()) {
      consider_order(true);
      consider_order(false);
    }
    consider_moves();
    if (best_.log_odds > std::log(kLeastOdds)) return best_;
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

  /// @param count how many hypotheses of this kind there are
  void consider(Finding finding, double count) {
    finding.log_odds = finding.log_ratio - std::log(shapes_per_error_ * count);
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

  void consider_mirror() {
    Points mirrored = shape_;
    mirrored.row(0) *= -1;
    consider_corrected(Problem::kMirrored, {}, mirrored, 1);
  }

  // How far a wrong landmark lies away has no scale: its logarithm is as likely between the predicted standard deviation
  // and ten radii of the shape.
  double log_density_of_wrong(const LandmarkLaw::Prediction& prediction) const {
    const auto d = static_cast<double>(shape_.rows());
    const double furthest = kFurthest * centroid_size(law_.reference()) / std::sqrt(law_.reference().cols());
    const double range = std::log(std::max(furthest / prediction.spread, M_E));
    const double away = std::max(prediction.deviation.norm(), prediction.spread);
    return -log_sphere(d) - d * std::log(away) - std::log(range);
  }

  void consider_moves() {
    if (shape_.rows() < 2) return;
    const std::vector<LandmarkLaw::Prediction> predictions = law_.predict(displacement_);
    int best = -1;
    double most = -std::numeric_limits<double>::infinity();
    for (const int a : kept_) {
      const LandmarkLaw::Prediction& here = predictions[static_cast<std::size_t>(a)];
      const double ratio = log_density_of_wrong(here) - here.log_density;
      if (ratio > most) most = ratio, best = a;
    }
    if (best < 0) return;
    Finding finding{.problem = Problem::kMoved, .landmarks = {best}, .log_ratio = most, .corrected = shape_};
    finding.corrected.col(best).setConstant(std::nan(""));
    consider(std::move(finding), static_cast<double>(kept_.size()));
    consider_slips(best, predictions[static_cast<std::size_t>(best)].log_density);
  }

  // What is typed wrongly: the density of what stands there is that of what was meant, over what the slip stretches.
  void consider_slips(int landmark, double log_density_here) {
    const Index d = shape_.rows();
    struct Slip {
      VectorXd meant;
      double log_stretch;
      std::string text;
    };
    std::vector<Slip> slips;
    const VectorXd here = shape_.col(landmark);
    for (Index axis = 0; axis < d; ++axis) {
      const char name = "xyz"[axis];
      const auto add = [&](double factor, const std::string& text) {
        Slip slip{here, -std::log(std::abs(factor)), fmt::format("{} {}", name, text)};
        slip.meant[axis] *= factor;
        slips.push_back(std::move(slip));
      };
      add(0.1, "is 10 times too large");
      add(10, "is 10 times too small");
      add(-1, "has the wrong sign");
      for (Index other = 0; other < axis; ++other) {
        Slip slip{here, 0, fmt::format("{} and {} are exchanged", "xyz"[other], name)};
        std::swap(slip.meant[axis], slip.meant[other]);
        slips.push_back(std::move(slip));
      }
    }
    for (const Slip& slip : slips) {
      Points corrected = shape_;
      corrected.col(landmark) = slip.meant;
      const VectorXd moved = displacement(aligned(corrected));
      const double log_density = law_.predict(moved)[static_cast<std::size_t>(landmark)].log_density;
      Finding finding{.problem = Problem::kMoved,
                      .landmarks = {landmark},
                      .log_ratio = log_density + slip.log_stretch - log_density_here,
                      .slip = slip.text,
                      .corrected = std::move(corrected)};
      consider(std::move(finding), static_cast<double>(kept_.size() * slips.size()));
    }
  }

  const LandmarkLaw& law_;
  const Judged& judged_;
  const Points& shape_;
  double shapes_per_error_;
  std::vector<int> kept_;
  Points aligned_;
  VectorXd displacement_;
  double none_ = 0, apart_ = 0;
  Finding best_{.log_odds = -std::numeric_limits<double>::infinity()};
};

}  // namespace

std::vector<Finding> judge(LandmarkLaw law, const Judged& shape, double shapes_per_error) {
  std::vector<Finding> findings;
  Points points = shape.points;
  const auto most = static_cast<std::size_t>(1 + points.cols() / 4);
  while (findings.size() < most) {
    std::optional<Finding> found = Hypotheses(law, shape, points, shapes_per_error).best();
    if (!found) break;
    points = found->corrected;
    if (found->problem == Problem::kMoved && found->slip.empty()) law.drop(found->landmarks.front());
    findings.push_back(std::move(*found));
  }
  return findings;
}

}  // namespace pulson::audit
